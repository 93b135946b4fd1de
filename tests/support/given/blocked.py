"""Cells that are blocked on purpose, each by something known."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from functools import cache
from typing import Unpack

import numpy as np

from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box, Sphere
from duocell.models.robot.arm import BaseRegion, range_weights
from duocell.optimizer.infeasibility.explain import explain
from duocell.optimizer.infeasibility.searched.conflict import Conflict, ConflictSearch
from duocell.optimizer.results.findings import Explanation
from duocell.optimizer.results.layout import Layout, Outcome, Search
from tests.support.given.arms import make_arm, region
from tests.support.given.fields import ArmFields

DOWN = rotation_x(np.pi)
ASKED = Clearances(arm_obstacle=0.01)


def carried(count: int = 4, turn: float = 0.0, height: float = 0.35) -> Task:
    """A part carried 0.3 m along x, turned about the vertical on the way; gripped from above."""
    shares = np.linspace(0.0, 1.0, count)
    positions = np.column_stack([0.3 * (shares - 0.5), np.zeros(count), np.full(count, height)])
    return Task(transform(rotation_z(turn * shares), positions))


def one_arm(
    robot: str = "ur5e",
    task: Task | None = None,
    obstacles: Sequence[Body] = (),
    base: BaseRegion | None = None,
    **given: Unpack[ArmFields],
) -> Cell:
    """An arm that may stand within half a metre of the way, at height 0."""
    fields: ArmFields = {
        "grasp": transform(DOWN, np.zeros(3)),
        "tool": transform(np.eye(3), [0.0, 0.0, 0.1]),
        **given,
    }
    arm = make_arm(
        robot,
        "main",
        base or region((-0.7, 0.7), (-0.7, 0.7)),
        **fields,
    )
    around = blocked_by(*obstacles) if obstacles else Surroundings()
    return Cell(task or carried(), (arm,), surroundings=around)


def blocked_by(*obstacles: Body) -> Surroundings:
    """Nothing but obstacles."""
    return Surroundings(obstacles=obstacles, clearances=ASKED)


def ball_at_pose(cell: Cell, pose: int, name: str = "ball") -> Body:
    """A ball in the place of the flange at one pose: no base, posture or yaw can help."""
    return Body(name, transform(np.eye(3), cell.flange_targets(cell.arms[0])[pose][:3, 3]), Sphere(0.02))


def far_box(name: str = "far") -> Body:
    """A box that is in nobody's way."""
    return Body(name, transform(np.eye(3), [4.0, 4.0, 0.5]), Box(np.full(3, 0.5)))


def halves() -> tuple[Body, Body]:
    """Two platforms, too high to stand in, that overlap and cover all ground within reach only together."""
    left, right = (
        Body(name, transform(np.eye(3), [0.0, side * 2.4, 0.0]), Box(np.array([8.0, 5.0, 0.3])))
        for name, side in (("left", 1.0), ("right", -1.0))
    )
    return left, right


def turned_too_far() -> Cell:
    """A part turned by 120° on the spot, held from above: the last joint has to make that turn, and may make 100°."""
    poses = transform(rotation_z(np.linspace(0.0, np.radians(120.0), 7)), [0.0, 0.0, 0.35])
    cell = one_arm(task=Task(poses))
    arm = cell.arms[0]
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[5], upper[5] = np.radians(-50.0), np.radians(50.0)
    limited = replace(arm, lower=lower, upper=upper, weights=range_weights(lower, upper))
    return replace(cell, arms=(limited,))


def conflict_of(cell: Cell, seconds: float = 60.0) -> Conflict:
    return ConflictSearch(cell, time.perf_counter() + seconds, 0).run()


@cache
def ball_in_the_way() -> tuple[Cell, Conflict]:
    """Three obstacles, the second in the place of the hand at a pose."""
    bare = one_arm(base=region((-0.7, 0.7), -0.4))
    cell = replace(bare, surroundings=blocked_by(far_box(), ball_at_pose(bare, 2), far_box("other")))
    return cell, conflict_of(cell)


@cache
def limited() -> tuple[Cell, Conflict]:
    cell = turned_too_far()
    return cell, conflict_of(cell)


NOTHING = Layout(Outcome.UNKNOWN, None, (), (), Search(0, 0, 0, 0.0), None)


def explained(cell: Cell, seconds: float = 100.0) -> Explanation:
    found = explain(cell, NOTHING, 0, time.perf_counter() + seconds)
    assert isinstance(found, Explanation)
    return found
