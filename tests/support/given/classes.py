"""The catalogue by class; loads every arm."""

from __future__ import annotations

from duocell.models.catalogue import catalogue
from duocell.models.kinematics.closed_form import closed_form

CLOSED = tuple(name for name in catalogue.names() if closed_form(catalogue.robot(name)) is not None)
"""Arms with a closed form."""
OTHERS = tuple(name for name in catalogue.names() if name not in CLOSED)
"""All others: seven joints, or six of another geometry."""
