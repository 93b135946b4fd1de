"""Ranges of lengths, checked in one sentence."""

from __future__ import annotations

from duocell.models.base.errors import InvalidInput


def check_between(what: str, value: float, allowed: tuple[float, float], pointer: str) -> None:
    """Refuse a length outside of a range; no number at all is outside too.

    Args:
        what: the value in words. value: m. allowed: m, least and most. pointer: its place.

    Raises:
        InvalidInput: it is too small, too large, or no number.
    """
    low, high = allowed
    if not low <= value <= high:
        raise InvalidInput(
            f"{what} is {value:g} m; it must lie between {low:g} and {high:g} m. Lengths are metres.", pointer
        )
