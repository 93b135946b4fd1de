"""Arms that stand in one place: nobody can bolt two bases to one spot, whether or not their bodies are looked at."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.robot.arm import Arm

NEAREST = 0.05
"""m between the origins of two bases: less than the radius of any base in the catalogue."""
_SIDES = ("_left", "_right")


def one_machine(first: Arm, second: Arm) -> bool:
    """Whether two arms are sides of one machine, whose frames may coincide: chains of one file, or left and right."""
    one, other = first.robot, second.robot
    if one.description and one.description == other.description and one.joint_names != other.joint_names:
        return True
    stems = {name.removesuffix(side) for name, side in zip(sorted((one.name, other.name)), _SIDES, strict=True)}
    return len(stems) == 1 and one.name != other.name


def in_one_place(arms: Sequence[Arm], positions: Sequence[Floats]) -> list[tuple[int, int, float]]:
    """Pairs of arms whose bases are nearer to each other than any two can stand, with their distance.

    Args:
        arms: of a cell. positions: (3,) m, origin of the base of each.

    Returns:
        Indices of both, and m.
    """
    found = []
    for first, second in combinations(range(len(arms)), 2):
        apart = float(np.linalg.norm(np.subtract(positions[first], positions[second])))
        if apart < NEAREST - KEPT and not one_machine(arms[first], arms[second]):
            found.append((first, second, apart))
    return found
