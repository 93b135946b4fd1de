"""The benchmark's tasks: what every method is given.

Two thesis-shaped cases (the acceptance cases, written out here), twenty seeded random two-arm tasks that are feasible
by construction, UR10e pairs, long tasks, and bases that may choose their height.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from bench.draws.random_tasks import random_cell
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_from_rpy, rotation_x, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task, arc_through_center, line
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights

RANDOM_TASKS = 20
FLAT = Interval(0.0, 0.0)

MAIN_GRASP = transform([[0, 0, 1], [1, 0, 0], [0, 1, 0]], [-0.06, -0.015, -0.02])
FOLLOWER_GRASP = transform([[0, 0, -1], [1, 0, 0], [0, -1, 0]], [0.06, 0.015, 0.02])
UP_LEFT = np.radians([10.0, -22.5, 155.0, 30.0, 10.0, 10.0])
UP_RIGHT = np.radians([10.0, -157.0, 25.0, 30.0, 10.0, 10.0])


@dataclass(frozen=True, eq=False)
class BenchTask:
    """One task.

    Attributes:
        name: unique. group: what it stands for in the tables.
        cell: the problem.
        budget: CPU seconds that a search method may spend on it.
    """

    name: str
    group: str
    cell: Cell
    budget: float


def all_tasks() -> list[BenchTask]:
    """Every task of the full run, in the order of the tables."""
    shaped = [
        BenchTask("line", "thesis-shaped", thesis_line(10), 6.0),
        BenchTask("arc", "thesis-shaped", thesis_arc(), 6.0),
    ]
    others = [
        BenchTask("ur10e-beam", "UR10e pair", ur_beam(), 3.0),
        BenchTask("ur10e-turn", "UR10e pair", ur_turn(), 3.0),
        BenchTask("line-100", "100 poses", thesis_line(100), 4.0),
        BenchTask("line-1000", "1,000 poses", thesis_line(1000), 6.0),
        BenchTask("line-z", "z free", free_height(thesis_line(10)), 3.0),
        BenchTask("arc-z", "z free", free_height(thesis_arc()), 3.0),
    ]
    chance = [BenchTask(f"random-{seed:02d}", "random", random_cell(seed), 1.5) for seed in range(RANDOM_TASKS)]
    return shaped + chance + others


def quick_tasks() -> list[BenchTask]:
    """A few of them, for a run of two minutes."""
    names = {"line", "arc", "random-00", "random-01", "random-02", "ur10e-beam"}
    return [replace(task, budget=1.0) for task in all_tasks() if task.name in names]


@cache
def thesis_line(count: int) -> Cell:
    """Example 1 of the source, with the end points fixed by hand (the scan lost them)."""
    turned = rotation_z(-np.pi / 4)
    start, end = [0.7331344418400145, 0.3524090098774652, 0.1], [1.0948655581599856, 0.6975909901225348, 0.1]
    task = line(transform(turned, start), transform(turned, end), count)
    return _puma_pair(task, Interval(-0.286, 2.114), Interval(-0.675, 1.725), UP_LEFT, UP_LEFT)


@cache
def thesis_arc() -> Cell:
    """Example 2 of the source likewise: an arc of 900 mm radius, the object turns by -90° about its x axis."""
    turned = rotation_z(-np.pi / 4)
    start, end = [0.12057713659400515, 0.65, 0.1], [0.45, 0.32057713659400515, 0.1]
    last = transform(turned @ rotation_x(-np.pi / 2), end)
    task = arc_through_center(transform(turned, start), last, [0.9, 1.1, 0.1], 10)
    low_x, low_y = -0.9275476178975979, -0.7275476178975979
    return _puma_pair(task, Interval(low_x, low_x + 2.4), Interval(low_y, low_y + 2.4), UP_LEFT, UP_RIGHT)


def _puma_pair(task: Task, x: Interval, y: Interval, main: Floats, follower: Floats) -> Cell:
    region = BaseRegion(x, y, FLAT)
    return Cell(
        task,
        (
            _arm("main", "puma560", region, MAIN_GRASP, main),
            _arm("follower", "puma560", region, FOLLOWER_GRASP, follower),
        ),
    )


def _arm(name: str, model: str, base: BaseRegion, grasp: Floats, reference: Floats | None = None) -> Arm:
    chosen = robot(model)
    return Arm(
        name=name,
        robot=chosen,
        tool=np.eye(4),
        grasp=grasp,
        base=base,
        lower=chosen.lower,
        upper=chosen.upper,
        reference=chosen.reference if reference is None else reference,
        weights=range_weights(chosen.lower, chosen.upper),
    )


def free_height(cell: Cell) -> Cell:
    """The same cell with bases that may stand up to 0.4 m lower or higher."""
    arms = tuple(replace(arm, base=replace(arm.base, z=Interval(-0.4, 0.4))) for arm in cell.arms)
    return replace(cell, arms=arms)


@cache
def ur_beam() -> Cell:
    """Two UR10e carry a beam of 1.2 m sideways and up, its direction kept."""
    start, end = transform(np.eye(3), [0.0, 0.0, 0.3]), transform(np.eye(3), [0.3, 0.4, 0.6])
    return _ur_pair(line(start, end, 10))


@cache
def ur_turn() -> Cell:
    """The beam is turned by 60° about the vertical while it is lowered."""
    start = transform(rotation_z(0.2), [0.1, 0.2, 0.7])
    end = transform(rotation_z(0.2 + np.pi / 3), [0.4, 0.3, 0.4])
    return _ur_pair(line(start, end, 10))


def _ur_pair(task: Task) -> Cell:
    down = rotation_from_rpy([np.pi, 0.0, 0.0])
    middle = task.poses[:, :3, 3].mean(axis=0)
    sides = [Interval(middle[axis] - 1.5, middle[axis] + 1.5) for axis in (0, 1)]
    region = BaseRegion(sides[0], sides[1], FLAT)
    return Cell(
        task,
        (
            _arm("main", "ur10e", region, transform(down, [-0.5, 0.0, 0.15])),
            _arm("follower", "ur10e", region, transform(down, [0.5, 0.0, 0.15])),
        ),
    )
