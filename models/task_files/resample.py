"""As few of the given poses as stand for all of them within a chordal error."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_angle, rotation_from_axis_angle, rotation_vector


def chosen_poses(positions: Floats, rotations: Floats, position_error: float, rotation_error: float) -> list[int]:
    """Indices of the poses to keep, the first and the last among them (Douglas and Peucker 1973, with rotations).

    Between two kept poses the part moves straight and turns at constant speed about one axis. Every pose that is left
    out is within both errors of where it is then at the same share of the way, which is measured along the given poses
    in units of the two errors. A pose that is farther away is kept, the worst first.

    Args:
        positions: (m, 3) m. rotations: (m, 3, 3).
        position_error: m, above 0. rotation_error: rad, above 0.
    """
    way = _way(positions, rotations, position_error, rotation_error)
    kept = {0, len(positions) - 1}
    waiting = [(0, len(positions) - 1)]
    while waiting:
        first, last = waiting.pop()
        if last - first < 2:
            continue
        away, turned = errors_between(positions, rotations, way, first, last)
        worst = np.maximum(away / position_error, turned / rotation_error)
        index = int(np.argmax(worst))
        if worst[index] > 1.0:
            middle = first + 1 + index
            kept.add(middle)
            waiting += [(first, middle), (middle, last)]
    return sorted(kept)


def errors_between(positions: Floats, rotations: Floats, way: Floats, first: int, last: int) -> tuple[Floats, Floats]:
    """Errors [m], [rad] of the poses between two that are kept: (last - first - 1,) each.

    Args:
        positions: (m, 3) m. rotations: (m, 3, 3). way: (m,) rising. first, last: what is kept.
    """
    inner = slice(first + 1, last)
    length = way[last] - way[first]
    shares = (way[inner] - way[first]) / length if length > 0.0 else np.zeros(last - first - 1)
    straight = positions[first] + shares[:, None] * (positions[last] - positions[first])
    vector = rotation_vector(rotations[first].T @ rotations[last])
    turned = rotations[first] @ rotation_from_axis_angle(shares[:, None] * vector)
    return (
        np.linalg.norm(positions[inner] - straight, axis=1),
        rotation_angle(np.swapaxes(turned, 1, 2) @ rotations[inner]),
    )


def largest_errors(
    positions: Floats, rotations: Floats, kept: list[int], position_error: float, rotation_error: float
) -> tuple[float, float]:
    """By how much [m], [rad] the poses that were left out are off at most; arguments as for `chosen_poses`."""
    way = _way(positions, rotations, position_error, rotation_error)
    errors = [errors_between(positions, rotations, way, first, last) for first, last in pairwise(kept)]
    return (
        max((float(away.max(initial=0.0)) for away, _ in errors), default=0.0),
        max((float(turned.max(initial=0.0)) for _, turned in errors), default=0.0),
    )


def _way(positions: Floats, rotations: Floats, position_error: float, rotation_error: float) -> Floats:
    """(m,) length of the way up to each pose, in units of the two errors."""
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1) / position_error
    steps += rotation_angle(np.swapaxes(rotations[:-1], 1, 2) @ rotations[1:]) / rotation_error
    way: Floats = np.concatenate([[0.0], np.cumsum(steps)])
    return way
