"""Seeded random tasks of one arm without a reduced problem, each of which some path is known to do.

A part is moved along a line, an arc or a chain of short lines. A base near the path and a posture are drawn; the grasp
is what makes them meet in the middle. The draw counts if the posture can be followed to both ends inside the limits
and steps, by plain damped Newton steps. What was drawn is thrown away: the search sees task, grasp and region.

Four kinds: ``path``; ``endless``, arms with joints without end; ``dwell``, with some hundred poses at one place of the
path; ``tilted``, with the base on a slope, a wall or a ceiling.
"""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np

from bench.random_arms.ways import dwelling
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_about, rotation_z, transform
from duocell.models.catalogue.catalogue import names, robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import line, task_from_poses
from duocell.models.kinematics.batch_kinematics import forward_and_jacobian, pose_error
from duocell.models.kinematics.chain import Chain, chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.robot import Robot

KINDS = ("path", "endless", "dwell", "tilted")
SHAPES = ("line", "arc", "corners")
SIZES = (0.3, 1.0, 2.4)
"""m, sides of the square in which bases may stand."""
STEPS = (0.6, np.pi / 2, np.pi)
REACHED = 1e-6


def arms_without_reduction(endless: bool) -> list[str]:
    """Robots of the catalogue that have no reduced problem: those with joints without end, or the others."""
    without = [name for name in names() if closed_form(robot(name)) is None or not chain_of(robot(name)).vertical_sign]
    return [name for name in without if bool(np.all(robot(name).limited)) != endless]


def drawn_cell(rng: np.random.Generator, name: str, kind: str = "path") -> Cell:
    """A task of one of the `KINDS` that robot ``name`` can do."""
    mount = np.eye(3)
    if kind == "tilted":
        mount = rotation_about(rng.normal(size=3), rng.uniform(0.3, np.pi))
    while True:
        cell = _attempt(rng, robot(name), mount)
        if cell is not None:
            return replace(cell, task=task_from_poses(dwelling(cell.task.poses, rng))) if kind == "dwell" else cell


def _attempt(rng: np.random.Generator, drawn: Robot, mount: Floats) -> Cell | None:
    """One draw, or None if its posture cannot be followed."""
    reach = float(np.linalg.norm(np.diff(chain_of(drawn).points, axis=0), axis=1).sum())
    poses = _poses(rng, str(rng.choice(SHAPES)), int(rng.integers(4, 21)), min(reach, 1.0))
    lower, upper = _limits(rng, drawn)
    low, high = np.maximum(lower, -np.pi), np.minimum(upper, np.pi)
    q = low + (high - low) * rng.uniform(0.1, 0.9, drawn.dof)
    rotations, positions, _ = forward_and_jacobian(chain_of(drawn), q[None])
    flange = transform(rotations[0], positions[0])
    middle, yaw = poses[len(poses) // 2], float(rng.uniform(-np.pi, np.pi))
    stand = middle[:3, 3] + rng.uniform(-0.1, 0.1, 3) - mount @ rotation_z(yaw) @ positions[0]
    base = transform(mount @ rotation_z(yaw), stand)
    grasp = inverse(middle) @ base @ flange
    step = float(rng.choice(STEPS))
    if not _follows(chain_of(drawn), inverse(base) @ poses @ grasp, q, (lower, upper), step):
        return None
    arm = Arm(
        name="a",
        robot=drawn,
        tool=np.eye(4),
        grasp=grasp,
        base=_region(rng, stand, yaw, middle[:3, 3]),
        lower=lower,
        upper=upper,
        reference=np.clip(drawn.reference, lower, upper),
        weights=range_weights(lower, upper),
        mount=mount,
    )
    return Cell(task_from_poses(poses), (arm,), max_joint_step=step, name=drawn.name)


def _poses(rng: np.random.Generator, shape: str, count: int, reach: float) -> Floats:
    """(m, 4, 4) poses of the part."""
    start = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(0.0, 0.5)])
    first = rotation_about(rng.normal(size=3), rng.uniform(0, np.pi))
    size = rng.uniform(0.15, 0.6) * reach
    if shape == "line":
        travel = rng.normal(size=3) * [1.0, 1.0, 0.4]
        turned = rotation_about(rng.normal(size=3), rng.uniform(0.0, np.pi / 2))
        end = transform(first @ turned, start + size * travel / np.linalg.norm(travel))
        return line(transform(first, start), end, count).poses
    if shape == "arc":
        axis = rng.normal(size=3)
        radius = np.cross(axis, rng.normal(size=3))
        radius *= 0.5 * size / np.linalg.norm(radius)
        angles = np.linspace(0.0, rng.uniform(0.7, 2.5), count)
        moved = start + rotation_about(axis, angles) @ radius - radius
        return transform(rotation_about(axis, 0.6 * angles) @ first, moved)
    corners = [transform(first, start)]
    for _ in range(3):
        turned = corners[-1][:3, :3] @ rotation_about(rng.normal(size=3), rng.uniform(0.0, 0.6))
        corners.append(transform(turned, corners[-1][:3, 3] + rng.normal(size=3) * size / 3.0))
    legs = [line(a, b, max(count // 3, 2)).poses for a, b in pairwise(corners)]
    return np.concatenate([legs[0], *(leg[1:] for leg in legs[1:])])


def _limits(rng: np.random.Generator, drawn: Robot) -> tuple[Floats, Floats]:
    """The robot's limits, in a third of the draws narrowed to 70 %."""
    lower, upper = drawn.lower.copy(), drawn.upper.copy()
    if rng.random() < 1.0 / 3.0:
        some = drawn.limited
        middle, half = 0.5 * (lower[some] + upper[some]), 0.35 * (upper[some] - lower[some])
        lower[some], upper[some] = middle - half, middle + half
    return lower, upper


def _region(rng: np.random.Generator, stand: Floats, yaw: float, middle: Floats) -> BaseRegion:
    """Where the base may stand: a square that holds the drawn place, one height or a range, any yaw or some."""
    side = float(rng.choice(SIZES))
    x, y = stand[:2] + rng.uniform(-0.4, 0.4, 2) * side if side < 2.0 else middle[:2]
    z, height = float(stand[2]), 0.0 if rng.random() < 0.7 else 0.2
    yaws = Interval(-np.pi, np.pi) if rng.random() < 0.7 else Interval(yaw - 0.4, yaw + 0.5)
    sides = [Interval(float(c) - 0.5 * side, float(c) + 0.5 * side) for c in (x, y)]
    return BaseRegion(sides[0], sides[1], Interval(z - height, z + height), yaws)


def _follows(chain: Chain, targets: Floats, q: Floats, limits: tuple[Floats, Floats], step: float) -> bool:
    """True if a posture (n,) for the middle target can be followed to both ends."""
    middle = len(targets) // 2
    for order in (range(middle, len(targets)), range(middle, -1, -1)):
        here = q
        for j in order:
            there = _reach(chain, targets[j], here)
            if there is None or np.any(there < limits[0]) or np.any(there > limits[1]):
                return False
            if j != middle and float(np.max(np.abs(there - here))) > step:
                return False
            here = there
    return True


def _reach(chain: Chain, target: Floats, q: Floats) -> Floats | None:
    """Joints (n,) that take a pose, from joints nearby."""
    for _ in range(30):
        rotations, positions, jacobians = forward_and_jacobian(chain, q[None])
        error = pose_error(rotations, positions, target)[0]
        if float(np.max(np.abs(error))) < REACHED:
            return q
        jacobian = jacobians[0]
        change = jacobian.T @ np.linalg.solve(jacobian @ jacobian.T + 1e-6 * np.eye(6), error)
        q = q + change * min(1.0, 0.3 / max(float(np.max(np.abs(change))), 1e-12))
    return None
