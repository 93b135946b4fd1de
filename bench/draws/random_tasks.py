"""Seeded random tasks of two PUMA arms, each of which some layout is known to solve.

A part is moved along a random line with a turn. For each arm a base near the path and a comfortable posture are drawn;
the grasp is what makes them meet in the middle of the path. The draw counts if the arm then follows the whole path
inside its limits, in one posture. The layout drawn is thrown away: methods see the task, the grasp and a square floor.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_about, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task, line
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem

FLOOR = 2.4
"""m, side of the square about the path in which bases may stand."""


def random_cell(seed: int) -> Cell:
    """Task ``seed``: 5 to 25 poses, two arms."""
    rng = np.random.default_rng([19910, seed])
    task = _random_task(rng)
    arms: list[Arm] = []
    while len(arms) < 2:
        arm = _random_arm(rng, task, ("main", "follower")[len(arms)])
        if _follows(Cell(task, (arm,)), arm):
            arms.append(_without_hints(arm, task))
    return Cell(task, tuple(arms), name=f"random {seed}")


def _random_task(rng: np.random.Generator) -> Task:
    axis = rng.normal(size=3)
    turned = rotation_about(axis, rng.uniform(0.0, np.pi / 2))
    first = rotation_z(rng.uniform(-np.pi, np.pi))
    start = np.array([*rng.uniform(-0.3, 0.3, 2), rng.uniform(0.0, 0.3)])
    heading = rng.uniform(-np.pi, np.pi)
    travel = np.array([np.cos(heading), np.sin(heading), rng.uniform(-0.3, 0.3)]) * rng.uniform(0.2, 0.6)
    count = int(rng.integers(5, 26))
    return line(transform(first, start), transform(first @ turned, start + travel), count)


def _random_arm(rng: np.random.Generator, task: Task, name: str) -> Arm:
    """An arm that stands at the drawn base and holds the part in the middle of the path."""
    puma = robot("puma560")
    span = puma.upper - puma.lower
    q = puma.lower + span * rng.uniform(0.2, 0.8, puma.dof)
    reached = flange_poses(puma, q)[0]
    middle = task.poses[len(task) // 2]
    yaw = rng.uniform(-np.pi, np.pi)
    offset = np.array([*rng.uniform(-0.1, 0.1, 2), 0.0])
    height = rng.uniform(-0.1, 0.1)
    # The base stands so that the flange is over the part; on the floor, so its height is the part's minus the arm's.
    stand = middle[:3, 3] + offset - rotation_z(yaw) @ reached[:3, 3]
    base = transform(rotation_z(yaw), np.array([stand[0], stand[1], stand[2] + height]))
    grasp = inverse(middle) @ base @ reached
    reference = np.clip(q + rng.normal(0.0, 0.4, puma.dof), puma.lower + 0.1 * span, puma.upper - 0.1 * span)
    x, y, z = (Interval(float(v), float(v)) for v in base[:3, 3])
    weights = range_weights(puma.lower, puma.upper)
    return Arm(name, puma, np.eye(4), grasp, BaseRegion(x, y, z), puma.lower, puma.upper, reference, weights)


def _follows(cell: Cell, arm: Arm) -> bool:
    """True if some posture does the whole path from the base that was drawn."""
    problem = reduced_problem(cell, arm)
    if problem is None:
        raise AssertionError("the PUMA has a closed form")
    here = np.array([[arm.base.x.low, arm.base.y.low, arm.base.z.low]])
    return bool((evaluate(problem, here).violation == 0.0).any())


def _without_hints(arm: Arm, task: Task) -> Arm:
    """The same arm, free to stand anywhere on the floor about the path, at the height that was drawn."""
    middle: Floats = 0.5 * (task.poses[0, :2, 3] + task.poses[-1, :2, 3])
    sides = [Interval(float(c) - 0.5 * FLOOR, float(c) + 0.5 * FLOOR) for c in middle]
    region = BaseRegion(sides[0], sides[1], arm.base.z)
    return Arm(arm.name, arm.robot, arm.tool, arm.grasp, region, arm.lower, arm.upper, arm.reference, arm.weights)
