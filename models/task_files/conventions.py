"""Units of length and conventions of rotation that files come in."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRotation
from duocell.models.base.pose import (
    rotation_from_abc_deg,
    rotation_from_axis_angle,
    rotation_from_euler_zyz,
    rotation_from_matrix,
    rotation_from_quaternion,
    rotation_from_quaternion_wxyz,
    rotation_from_rpy,
    rotation_from_wpr_deg,
)
from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.tool_axis import rotations_along

UNITS = {"m": 1.0, "mm": 1e-3, "cm": 1e-2, "inch": 0.0254}
"""Name -> m."""
FARTHEST = 1e4
"""m; no cell is larger: the unit is another one."""


@dataclass(frozen=True, slots=True)
class Convention:
    """A way to write rotations.

    Attributes:
        count: numbers of each.
        rotations: (m, count) -> (m, 3, 3); raises InvalidRotation.
        words: what the numbers are.
        free_roll: True if the turn about the z axis of the pose is not given, but chosen.
    """

    count: int
    rotations: Callable[[Floats], Floats]
    words: str
    free_roll: bool = False


def _of_degrees(convert: Callable[[ArrayLike], Floats]) -> Callable[[Floats], Floats]:
    return lambda values: convert(np.radians(values))


def _of_rows(values: Floats) -> Floats:
    return rotation_from_matrix(values.reshape(-1, 3, 3))


def _unturned(values: Floats) -> Floats:
    return np.tile(np.eye(3), (len(values), 1, 1))


ROTATIONS: dict[str, Convention] = {
    "quaternion": Convention(4, rotation_from_quaternion, "x, y, z, w"),
    "quaternion_wxyz": Convention(4, rotation_from_quaternion_wxyz, "w, x, y, z, as ABB writes them"),
    "axis_angle": Convention(3, rotation_from_axis_angle, "a rotation vector in rad, as Universal Robots writes it"),
    "axis_angle_deg": Convention(3, _of_degrees(rotation_from_axis_angle), "a rotation vector in degrees"),
    "rpy": Convention(3, rotation_from_rpy, "roll, pitch, yaw in rad about the fixed axes x, y, z"),
    "rpy_deg": Convention(3, _of_degrees(rotation_from_rpy), "roll, pitch, yaw in degrees about fixed x, y, z"),
    "abc_deg": Convention(3, rotation_from_abc_deg, "A, B, C in degrees, as KUKA writes them"),
    "wpr_deg": Convention(3, rotation_from_wpr_deg, "W, P, R in degrees, as FANUC writes them"),
    "euler_zyz": Convention(3, rotation_from_euler_zyz, "Euler angles about z, y, z in rad"),
    "euler_zyz_deg": Convention(3, _of_degrees(rotation_from_euler_zyz), "Euler angles about z, y, z in degrees"),
    "matrix": Convention(9, _of_rows, "nine numbers, row by row"),
    "tool_axis": Convention(3, rotations_along, "direction i, j, k from the tip into the tool", free_roll=True),
    "none": Convention(0, _unturned, "no orientation: nothing is turned"),
}


def rotations_of(rotation: str, values: Sequence[Sequence[float]], lines: Sequence[int]) -> Floats:
    """Rotations (m, 3, 3) in a convention.

    Args:
        rotation: name of the convention.
        values: numbers of each. lines: where they stand.

    Raises:
        InvalidTaskFile: one is no rotation; with its line.
    """
    convention = ROTATIONS[rotation]
    numbers = np.array(values, dtype=np.float64).reshape(len(values), convention.count)
    try:
        return convention.rotations(numbers)
    except InvalidRotation as error:
        for line, row in zip(lines, numbers, strict=True):
            try:
                convention.rotations(row[None])
            except InvalidRotation as own:
                raise InvalidTaskFile(f"{own.detail} It was taken for {rotation}.", line) from own
        raise InvalidTaskFile(error.detail) from error


def positions_of(units: str, values: Sequence[Sequence[float]], lines: Sequence[int]) -> Floats:
    """Positions (m, 3) in m.

    Args:
        units: name of the unit.
        values: numbers of each. lines: where they stand.

    Raises:
        InvalidTaskFile: one is outside of any cell; with its line.
    """
    positions: Floats = np.array(values, dtype=np.float64) * UNITS[units]
    far = np.flatnonzero(np.abs(positions).max(axis=1) > FARTHEST)
    if len(far):
        worst = float(np.abs(positions[far[0]]).max())
        raise InvalidTaskFile(
            f"a coordinate is {worst:g} m in the unit {units}, far outside of any cell. Say the unit of the file: "
            f"one of {', '.join(UNITS)}.",
            lines[int(far[0])],
        )
    return positions
