"""Contact that may be meant: which setting of a request allows it."""

from __future__ import annotations

from duocell.models.cell.surroundings import PairClass

SETTINGS = {
    PairClass.PART_OBSTACLE: (
        "if the part is meant to lie or stand there, set clearance.part_obstacle to null (nothing is then looked at "
        "between the part and obstacles)"
    ),
    PairClass.ARM_PART: (
        "if the arm is meant to hold the part there, set part.grasp_zone to the half size of a cube around the grasp "
        "that it may enter, or clearance.arm_part to null"
    ),
}
"""Per class, a clause for the end of a sentence; arms are not meant to touch each other or obstacles."""


def if_meant(kind: PairClass) -> str:
    """A clause that begins with a semicolon, or nothing.

    Args:
        kind: class of the pair that is in contact, or too near.
    """
    return f"; {SETTINGS[kind]}" if kind in SETTINGS else ""
