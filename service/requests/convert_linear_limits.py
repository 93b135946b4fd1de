"""Limits between the joints of an arm: those of a request, or of a form, as they hold for a robot."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.robot.linear_limits import LinearLimits, row_fault, row_name, sums_between
from duocell.models.robot.robot import Robot
from duocell.service.common.issues import IssueCollector
from duocell.service.schemas.arm import LinearLimit


def linear_limits_of(
    rows: Sequence[LinearLimit], robot: Robot, limits: tuple[Floats, Floats], pointer: str, issues: IssueCollector
) -> LinearLimits | None:
    """The limits of a list of rows, or None where there are none.

    Args:
        rows: as sent. robot: that they are about. limits: (n,) rad, lower and upper ones of its joints.
        pointer: place of the list. issues: where to note what is wrong.
    """
    faults = [_fault(row, robot, limits) for row in rows]
    for index, fault in enumerate(faults):
        if fault is not None:
            issues.add(f"{pointer}/{index}{fault[0]}", fault[1])
    if not rows or any(fault is not None for fault in faults):
        return None
    return LinearLimits(
        names=tuple(row.name or row_name(row.coefficients, robot.joint_names) for row in rows),
        matrix=np.array([row.coefficients for row in rows]),
        lower=np.array([row.lower for row in rows]),
        upper=np.array([row.upper for row in rows]),
    )


def _fault(row: LinearLimit, robot: Robot, limits: tuple[Floats, Floats]) -> tuple[str, str] | None:
    """Where in a row something is wrong, and what; None if nothing is."""
    if len(row.coefficients) != robot.dof:
        return "/coefficients", (
            f"{len(row.coefficients)} values, but {robot.name} has {robot.dof} joints; one per joint is needed, 0 for "
            f"those that have no part in it. The joints are {', '.join(robot.joint_names)}."
        )
    shifted = [j for j, c in enumerate(row.coefficients) if robot.prismatic[j] and c != 0.0]
    if shifted:
        return f"/coefficients/{shifted[0]}", (
            f"{robot.joint_names[shifted[0]]} is prismatic: its value is a length, and the others are angles; a sum of "
            "both has no unit. Send 0 for it, and limit it by `limits`."
        )
    fault = row_fault(row.coefficients, row.lower, row.upper)
    if fault is not None:
        return "/coefficients" if "coefficient" in fault else "/lower", f"{fault[0].upper()}{fault[1:]}"
    least, most = sums_between(np.array(row.coefficients), *limits)
    if least > row.upper or most < row.lower:
        return "", (
            f"Within the limits of the joints the sum lies between {least:.4g} and {most:.4g} rad, which is nowhere "
            f"within [{row.lower:g}, {row.upper:g}] rad: no posture keeps it. See that it is in rad, and the signs of "
            "the coefficients."
        )
    return None
