"""Search of an arm that is not quite as drawn, by rounding or calibration: found on the drawing, kept on the arm.

The arm that was meant (`models.nominal`) has a closed form, so its bases and postures are searched like those of any
such arm. Its optima are starts on the true arm: joints are brought to the poses by Newton's method, the local solver
moves the base to the true optimum, and everything is checked on the true kinematics.
"""

from __future__ import annotations

import time
from collections.abc import Callable

import numpy as np

from models.arm import Arm
from models.cell import Cell
from models.closed_form import closed_form
from models.nominal import Nominal
from models.numeric_inverse import brought_to
from models.pose import inverse
from optimizer.measure import path_signs
from optimizer.program import ArmPoint

STARTS = 4
"""Optima of the drawing that are taken over."""
APART = 1e-3
"""m and rad; optima nearer to each other are the same start."""


def starts_from(
    cell: Cell, arm: Arm, meant: Nominal, optima: list[tuple[float, ArmPoint]], deadline: float
) -> list[ArmPoint]:
    """Points of the true arm, one for each of the best distinct optima of the drawing.

    Args:
        cell: task.
        arm: the true arm. meant: what it was drawn as.
        optima: (objective, point) of the drawing, best first.
        deadline: `time.perf_counter` value, soft.
    """
    found: list[ArmPoint] = []
    taken: list[ArmPoint] = []
    for _, point in optima:
        if len(found) >= STARTS or time.perf_counter() > deadline:
            break
        if any(_same(point, other) for other in taken):
            continue
        taken.append(point)
        base = arm.base_in_world(point.position, point.yaw)
        q, reached = brought_to(arm.robot, point.joints, inverse(base) @ cell.flange_targets(arm))
        if np.all(reached):
            found.append(ArmPoint(point.position, point.yaw, q, None))
    return found


def admitted(arm: Arm, meant: Nominal) -> Callable[[ArmPoint], bool]:
    """Whether a point of the true arm is in a posture that the request admits."""
    form = closed_form(meant.robot)

    def admits(point: ArmPoint) -> bool:
        return form is None or arm.posture.admits(path_signs(form, point.joints))

    return admits


def _same(first: ArmPoint, second: ArmPoint) -> bool:
    away = max(float(np.max(np.abs(first.position - second.position))), abs(first.yaw - second.yaw))
    return first.signs == second.signs and away < APART


def what_is_bounded(meant: Nominal, bound: float | None) -> str:
    """What a proof on the drawing says about the true arm."""
    apart = f"at most {1000.0 * meant.position:.3g} mm and {1000.0 * meant.angle:.3g} mrad at any posture"
    said = "no bound was found" if bound is None else f"nothing costs less than {bound:.6g}"
    return (
        "no proof for this arm itself: its geometry is that of one with a closed form but for rounding or calibration, "
        f"{apart}; for that one {said}"
    )
