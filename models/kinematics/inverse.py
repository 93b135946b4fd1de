"""Every inverse-kinematics branch of a pose, behind one interface whatever the arm.

Four sources, in this order: our vectorised closed forms; ssik's analytic solvers for the other arms of its
catalogue; the closed form of the arm that a rounded or calibrated one was drawn as, refined; Newton's method from many
seeds for general arms given by a table or a file. Six-joint arms have finitely
many branches; for seven joints the branches are those at samples of the redundancy, and completeness is not claimed.
"""

from __future__ import annotations

from collections.abc import Iterator
from functools import lru_cache

import numpy as np
import ssik

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.branches import solve_branches
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.nominal import Nominal, nominal, posture_form
from duocell.models.kinematics.numeric_inverse import brought_to, numeric_branches, unique
from duocell.models.robot.robot import Robot

REACHED = 1e-9
"""m; a branch that misses less than this exists."""


def branches(robot: Robot, targets: Floats) -> Iterator[Floats]:
    """Branches of flange poses.

    Args:
        robot: the arm.
        targets: (k, 4, 4) flange poses in the base frame.

    Yields:
        For each pose (K, n) joint values [rad] modulo 2π, whatever the limits; K = 0 where nothing reaches.
    """
    form = closed_form(robot)
    if form is not None:
        found = solve_branches(form, targets[:, :3, :3], targets[:, :3, 3])
        for j in range(len(targets)):
            yield found.joints[:, found.missing[:, j] < REACHED, j].T
    elif robot.ssik_name is not None:
        solver = _manipulator(robot.ssik_name)
        for target in targets:
            # without the rescue: it perturbs poses that nothing reaches, at many times the cost, to recover branches on
            # rank-deficient ridges of measure zero
            solutions = solver.solve(target, respect_limits=False, allow_rescue=False)
            yield np.array([solution.q for solution in solutions]).reshape(-1, robot.dof)
    else:
        meant = nominal(robot)
        for target in targets:
            nearby = np.zeros((0, robot.dof)) if meant is None else _refined(robot, meant, target)
            yield nearby if len(nearby) else numeric_branches(robot, target)


def _refined(robot: Robot, meant: Nominal, target: Floats) -> Floats:
    """Branches (K, n) of a flange pose (4, 4) from those of the arm that ``robot`` was drawn as."""
    form = closed_form(meant.robot)
    if form is None:
        raise AssertionError("a nominal arm without a closed form")
    found = solve_branches(form, target[None, :3, :3], target[None, :3, 3])
    near = found.joints[:, found.missing[:, 0] < max(meant.position, REACHED), 0].T
    q, reached = brought_to(robot, near, np.broadcast_to(target, (len(near), 4, 4)))
    return unique(q[reached], robot.prismatic)


@lru_cache(maxsize=128)
def _manipulator(name: str) -> ssik.Manipulator:
    return ssik.Manipulator.from_prebuilt(name)


def source_of_branches(robot: Robot) -> str:
    """How `branches` are found for this robot, in words for a user."""
    form = closed_form(robot)
    if form is not None:
        return f"closed form ({form.kind.replace('-', ' ')}), all eight branches"
    if robot.ssik_name is not None:
        samples = ", at samples of the redundancy" if robot.dof > 6 else ""
        return f"analytic (ssik){samples}"
    meant = nominal(robot)
    if meant is not None:
        kind = "spherical wrist" if meant.kind == "spherical-wrist" else "three parallel"
        return (
            f"closed form ({kind}) of the geometry that was meant, from which this one differs by at most "
            f"{1000.0 * meant.position:.3g} mm and {1000.0 * meant.angle:.3g} mrad; refined on the true geometry"
        )
    return "numeric from many seeds, completeness not claimed"


def posture_definitions(robot: Robot) -> dict[str, dict[str, str]] | None:
    """What the words of a posture mean for this robot; None for robots without postures."""
    form = posture_form(robot)
    if form is None:
        return None
    names = robot.joint_names
    side = _direction(form.n)
    first = names[0]
    if form.offset > 1e-9:
        left = f"the wrist is in front of the axis of {first}, the arm passing on its {side} side (all joints at zero)"
        right = f"the wrist is behind the axis of {first}: the arm reaches over backwards, on the other side"
    else:
        left = f"the wrist is in front of the axis of {first}; front is {_direction(form.forward)} with {first} at zero"
        right = f"the wrist is behind the axis of {first}: the arm reaches over backwards"
    zero = round(float(np.degrees(form.wrist_zero)), 6) + 0.0  # + 0.0: never "-0"
    bent = f"{names[4]}" if zero == 0.0 else f"{names[4]} - ({zero:g}°)"
    return {
        "shoulder": {"left": left, "right": right},
        "elbow": {
            "up": "the elbow lies on the upper side of the line from shoulder to wrist, seen with the wrist in front",
            "down": "the elbow lies on the lower side of that line",
        },
        "wrist": {
            "noflip": f"{bent} between 0° and 180° (modulo 360°)",
            "flip": f"{bent} between -180° and 0° (modulo 360°)",
        },
    }


def _direction(vector: Floats) -> str:
    """A unit vector of the base frame as text."""
    words = {0: "x", 1: "y", 2: "z"}
    axis = int(np.argmax(np.abs(vector)))
    if abs(abs(vector[axis]) - 1.0) < 1e-6:
        return f"{'+' if vector[axis] > 0 else '-'}{words[axis]} (base frame)"
    return f"({vector[0]:.3f}, {vector[1]:.3f}, {vector[2]:.3f}) (base frame)"
