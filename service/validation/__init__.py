"""What a request may be: JSON without ambiguities, counts and ranges that can be carried out, fields that are known."""

from duocell.service.validation.fields import validate

__all__ = ["validate"]
