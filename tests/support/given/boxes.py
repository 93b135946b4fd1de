"""Random reduced problems and boxes around places that work, for the tests of the bounds."""

from __future__ import annotations

from math import pi

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from duocell.models.base.arrays import Floats
from duocell.models.catalogue.catalogue import robot
from duocell.models.catalogue.dh import robot_from_dh
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.kinematics.kinematics import reach
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.robot import Robot
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate, reduced_problem
from tests.support.given.arms import oblique_wrist, skew_rows

SPHERICAL = ("puma560", "irb6700", "kr210_r2700", "j2s6s300")
PARALLEL = ("ur10e", "z1", "nova5", "cr5")
SPECIAL = ("oblique", "skew")
MOUNTS = (
    np.eye(3),
    Rotation.from_euler("x", pi).as_matrix(),
    Rotation.from_euler("x", pi / 2).as_matrix(),
    Rotation.from_euler("y", -pi / 2).as_matrix(),
    Rotation.from_euler("zyx", [0.4, 0.5, -0.3]).as_matrix(),
)


def robot_called(name: str) -> Robot:
    """A catalogue robot, or one with an oblique wrist, or one whose axes 1 and 2 are not at right angles."""
    if name == "oblique":
        return oblique_wrist()
    return robot_from_dh("skew", skew_rows(-1.2)) if name == "skew" else robot(name)


def random_problem(
    name: str, rng: np.random.Generator, mounted: bool = False, level: bool = False, segments: int = 1
) -> ReducedProblem:
    """A straight or turning path of 1 to 8 poses with all sorts of limits, weights, yaws and steps.

    Args:
        name: see `robot_called`. rng: source of chance.
        mounted: the base may hang or stand on a wall. level: its z is fixed; else sometimes.
        segments: how many such paths, all with the same grasp; from 2 on with weights, the last one sometimes at rest.
    """
    chain = robot_called(name)
    paths = [_path(chain, rng) for _ in range(segments)]
    if segments > 1 and rng.random() < 0.3:
        paths[-1] = Task(np.repeat(paths[-1].poses[:1], 3, axis=0))
    task = (
        paths[0]
        if segments == 1
        else task_sequence([TaskSegment("", path, float(rng.choice([0.0, 0.5, 1.0, 3.0]))) for path in paths])
    )
    arm = _arm(name, chain, rng, mounted, level)
    problem = reduced_problem(Cell(task, (arm,), max_joint_step=float(rng.choice([0.6, pi / 2, pi]))), arm)
    assert problem is not None
    return problem


def _path(chain: Robot, rng: np.random.Generator) -> Task:
    scale, count = reach(chain), int(rng.integers(1, 9))
    start = Rotation.random(rng=rng) if rng.random() < 0.6 else Rotation.from_euler("x", pi)
    turns = Rotation.concatenate(
        [start, start * Rotation.from_rotvec(rng.normal(size=3) * rng.choice([0.0, 0.3, 1.0]))]
    )
    way = np.linspace(0.0, 1.0, count)
    direction = rng.normal(size=3) * [1.0, 1.0, 0.4]
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Slerp([0, 1], turns)(way).as_matrix()
    poses[:, :3, 3] = np.outer(way - 0.5, direction / np.linalg.norm(direction) * rng.uniform(0.1, 0.9) * scale)
    poses[:, 2, 3] += rng.uniform(-0.2, 0.5) * scale
    return Task(poses)


def _arm(name: str, chain: Robot, rng: np.random.Generator, mounted: bool, level: bool) -> Arm:
    scale = reach(chain)
    lower, upper = _limits(chain, rng)
    weights = range_weights(lower, upper) if rng.random() < 0.5 else rng.uniform(0.0, 2.0, 6)
    if rng.random() < 0.3:
        weights[rng.integers(6)] = 0.0
    side = Interval(-scale, scale)
    height = Interval(-0.3 * scale, 0.3 * scale) if not level and rng.random() < 0.4 else Interval(0.0, 0.0)
    return Arm(
        name,
        chain,
        np.eye(4),
        np.eye(4),
        BaseRegion(side, side, height, _yaw(rng)),
        lower,
        upper,
        chain.reference + rng.normal(size=6) * rng.choice([0.0, 0.5, 2.0]),
        weights,
        mount=MOUNTS[rng.integers(len(MOUNTS)) if mounted else 0],
    )


def _limits(chain: Robot, rng: np.random.Generator) -> tuple[Floats, Floats]:
    lower, upper = chain.lower.copy(), chain.upper.copy()
    joint, chance = rng.integers(6), rng.random()
    if chance < 0.4:
        ends = np.where(np.isfinite(lower[joint]), [lower[joint], upper[joint]], [-7.0, 7.0])
        low, high = np.sort(rng.uniform(ends[0], ends[1], 2))
        lower[joint], upper[joint] = low - 0.2, high + 0.2
    elif chance < 0.55:
        lower[joint], upper[joint] = -np.inf, np.inf
    elif chance < 0.65:
        lower[joint], upper[joint] = -20.0, 21.0
    return lower, upper


def _yaw(rng: np.random.Generator) -> Interval:
    low, kind = rng.uniform(-3.0, 3.0), rng.integers(4)
    return (Interval(-pi, pi), Interval(-pi, pi), Interval(low, low), Interval(low, low + rng.uniform(0.0, 5.0)))[kind]


def boxes_around(problem: ReducedProblem, count: int, rng: np.random.Generator) -> Boxes | None:
    """Boxes from 0.1 mm to the whole area, each around a place that works; None if no such place is found."""
    bounds = problem.arm.base.bounds[:3]
    scale, free = bounds[0, 1], bounds[:, 1] > bounds[:, 0]
    places = rng.uniform(bounds[:, 0], bounds[:, 1], (1200, 3))
    postures, rows = np.nonzero(evaluate(problem, places).violation == 0.0)
    if not len(rows):
        return None
    pick = rng.integers(0, len(rows), count)
    half = scale * 10.0 ** rng.uniform(-4.0, 0.0, (count, 1)) * rng.uniform(0.0, 1.0, (count, 3)) * free
    return Boxes(places[rows[pick]] + half * rng.uniform(-1.0, 1.0, (count, 3)), half, postures[pick])


def members(boxes: Boxes, rng: np.random.Generator, number: int) -> Floats:
    """(N, 3) one member of each box: now at random, now a corner or the middle of an edge or side."""
    share = rng.uniform(-1.0, 1.0, boxes.half.shape) if number % 2 else rng.choice([-1.0, 0.0, 1.0], boxes.half.shape)
    return boxes.centre + boxes.half * share
