"""Poses of a tool of which only the axis is given: what turns about it turns as little as it can."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRotation

_STRAIGHT = 1e-6
"""Sine below which a direction says nothing about the plane at right angles to the axis."""
LENGTH_TOLERANCE = 1e-2
"""How far the length of an axis may be from one: few printed digits."""


def rotations_along(axes: Floats) -> Floats:
    """Rotations whose z axis points out of the tool, against the given axes, and whose x axis turns about it as little
    as possible from each to the next; the first is as near to the x axis of the world as it can be.

    Args:
        axes: (m, 3) unit directions from the tip into the tool (APT's i, j, k).

    Returns:
        (m, 3, 3).

    Raises:
        InvalidRotation: a direction has no length near one.
    """
    lengths = np.linalg.norm(axes, axis=1)
    wrong = np.abs(lengths - 1.0) > LENGTH_TOLERANCE
    if wrong.any():
        raise InvalidRotation(
            f"the tool axis has length {lengths[np.argmax(wrong)]:.6g}; it must be 1 to within {LENGTH_TOLERANCE:g}."
        )
    result = np.empty((len(axes), 3, 3))
    x = np.array([1.0, 0.0, 0.0])
    for index, z in enumerate(-axes / lengths[:, None]):
        x = _across(x, z)
        result[index] = np.column_stack([x, np.cross(z, x), z])
    return result


def _across(x: Floats, z: Floats) -> Floats:
    """The direction across ``z`` that is nearest to ``x``, or to an axis of the world if that is along it."""
    for wanted in (x, *np.eye(3)):
        rest = wanted - (wanted @ z) * z
        length = float(np.linalg.norm(rest))
        if length > _STRAIGHT:
            across: Floats = rest / length
            return across
    raise AssertionError("every direction is along the axis")
