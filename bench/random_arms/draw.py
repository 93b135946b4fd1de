"""Random tasks of one arm, of the kinds that searches find hard. All are possible by construction.

A base and joint values are drawn, a way of the part is laid through them, and the draw counts if the arm follows it
inside its limits in one posture. What was drawn is then forgotten: the search sees task, limits and a region of bases.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from bench.random_arms.ways import dwelling, way_of
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_about, rotation_x, rotation_y, transform
from duocell.models.catalogue import catalogue
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.kinematics import characteristic_length, flange_poses
from duocell.models.robot.arm import FREE_YAW, TURN, Arm, BaseRegion, Interval, equal_weights, range_weights
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem

STREAM = 61209
"""First number of every seed."""
LIMITS_MARGIN = 0.02, 0.35
"""rad between a planted path and narrow limits."""


@dataclass(frozen=True, eq=False, slots=True)
class Planted:
    """A task with the placement that it was drawn from.

    Attributes:
        arm: with its base fixed. task: of the arm. step: rad, allowed joint step. joints: (m, 6) rad, the path.
    """

    arm: Arm
    task: Task
    step: float
    joints: Floats


@cache
def closed_form_robots() -> tuple[str, ...]:
    """Names of the catalogue's arms that have a reduced problem."""
    robots = ((name, catalogue.robot(name)) for name in catalogue.names())
    return tuple(name for name, robot in robots if closed_form(robot) is not None and chain_of(robot).vertical_sign)


def draw(kind: str, seed: int) -> Cell:
    """Task ``seed`` of a kind (`KINDS`).

    Returns:
        A cell of one arm.
    """
    rng = np.random.default_rng([STREAM, list(KINDS).index(kind), seed])
    cell = KINDS[kind](rng)
    return replace(cell, name=f"{kind} {seed}")


def _planted(rng: np.random.Generator, mount: Floats | None = None, dwell: bool = False, segments: int = 1) -> Planted:
    """A path that an arm can follow inside the robot's own limits."""
    while True:
        arm = _fixed_arm(rng, np.eye(3) if mount is None else mount)
        step = float(rng.choice([0.6, np.pi / 2, np.pi]))
        poses, starts = _task_sequence(rng, arm, segments)
        if dwell:
            poses = dwelling(poses, rng)
        planted = _planted_on(Cell(Task(poses, starts), (arm,), step), arm)
        if planted is not None:
            return planted


def _path(cell: Cell, arm: Arm) -> Floats | None:
    """(m, 6) rad, the best path from the arm's base, fixed; None if there is none."""
    problem = reduced_problem(cell, arm)
    if problem is None:
        raise AssertionError("arms of these tasks have a reduced problem")
    paths = evaluate(problem, arm.base.bounds[None, :3, 0])
    if not np.any(paths.violation[:, 0] == 0.0):
        return None
    best = int(np.argmin(np.where(paths.violation[:, 0] == 0.0, paths.objective[:, 0], np.inf)))
    joints: Floats = paths.joints[:, best, 0].T.copy()
    return joints


def _fixed_arm(rng: np.random.Generator, mount: Floats, name: str | None = None) -> Arm:
    """An arm at a fixed base, with a tool and a grasp."""
    robot = catalogue.robot(name or str(rng.choice(closed_form_robots())))
    place, yaw = np.array([*rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.2, 0.6)]), float(rng.uniform(-np.pi, np.pi))
    x, y, z = (Interval(float(v), float(v)) for v in place)
    reference = robot.reference
    if rng.random() < 0.4:
        low, high = _ends(robot.lower, robot.upper)
        reference = low + (high - low) * rng.uniform(0.25, 0.75, robot.dof)
    weights = [range_weights, equal_weights][int(rng.integers(2))](robot.lower, robot.upper)
    if rng.random() < 0.15:
        weights = rng.permutation([0.0, 0.0, 0.1, 1.0, 1.0, 10.0])
    tool, grasp = (_frame(rng) if rng.random() < 0.6 else np.eye(4) for _ in range(2))
    base = BaseRegion(x, y, z, Interval(yaw, yaw))
    return Arm("arm", robot, tool, grasp, base, robot.lower, robot.upper, reference, weights, mount=mount)


def _frame(rng: np.random.Generator) -> Floats:
    return transform(rotation_about(rng.normal(size=3), rng.uniform(0.0, np.pi)), rng.uniform(-0.2, 0.2, 3))


def _ends(lower: Floats, upper: Floats) -> tuple[Floats, Floats]:
    """Limits with half a turn to each side for joints without end."""
    return np.where(np.isfinite(lower), lower, -np.pi), np.where(np.isfinite(upper), upper, np.pi)


def _task_sequence(rng: np.random.Generator, arm: Arm, segments: int) -> tuple[Floats, tuple[int, ...]]:
    """Poses (m, 4, 4) of the part in one or more segments, and where these start."""
    parts = []
    for _ in range(segments):
        low, high = _ends(arm.lower, arm.upper)
        joints = low + (high - low) * rng.uniform(0.1, 0.9, arm.dof)
        if rng.random() < 0.3:
            form = closed_form(arm.robot)
            if form is not None:
                joints[4] = form.wrist_zero + rng.uniform(-0.2, 0.2)
        base = arm.base.bounds[:, 0]
        flange = arm.base_in_world(base[:3], base[3]) @ flange_poses(arm.robot, joints)[0]
        parts.append(way_of(flange @ arm.tool @ inverse(arm.grasp), characteristic_length(arm.robot), rng))
    counts = np.cumsum([0, *(len(part) for part in parts)])
    return np.concatenate(parts), tuple(int(start) for start in counts[:-1])


def _region(rng: np.random.Generator, planted: Planted, shapes: tuple[str, ...], *, deep: bool = False) -> BaseRegion:
    """A region about the planted base: a slit, a sliver, a small or a wide field; narrow, wide or free in yaw."""
    fixed = planted.arm.base.bounds[:, 0]
    shape = str(rng.choice(shapes))
    sizes = {"slit": (0.04, 2.4), "sliver": (0.004, 0.6), "mid": (1.0, 1.0), "wide": (3.2, 3.2), "spot": (0.0, 0.0)}
    width = np.array([*rng.permutation(sizes[shape]), rng.uniform(0.1, 1.0) if deep else 0.0])
    low = fixed[:3] - width * rng.uniform(0.05, 0.95, 3)
    x, y, z = (Interval(float(a), float(a + w)) for a, w in zip(low, width, strict=True))
    across = float(rng.choice([0.1, 1.5, 3.1, TURN]))
    start = float(fixed[3] - across * rng.uniform(0.05, 0.95))
    return BaseRegion(x, y, z, FREE_YAW if across == TURN else Interval(start, start + across))


def _cell(planted: Planted, **given: object) -> Cell:
    return Cell(planted.task, (replace(planted.arm, **given),), planted.step)  # type: ignore[arg-type]


def _random(rng: np.random.Generator) -> Cell:
    planted = _planted(rng)
    return _cell(planted, base=_region(rng, planted, ("slit", "mid", "wide", "wide")))


def _narrow(planted: Planted, rng: np.random.Generator) -> dict[str, Floats]:
    """Limits close to the planted path, with weights and a reference that go with them."""
    arm, joints = planted.arm, planted.joints
    narrowed = rng.random(arm.dof) < 0.6
    margins = rng.uniform(*LIMITS_MARGIN, (2, arm.dof))
    lower = np.where(narrowed, np.maximum(arm.lower, joints.min(axis=0) - margins[0]), arm.lower)
    upper = np.where(narrowed, np.minimum(arm.upper, joints.max(axis=0) + margins[1]), arm.upper)
    return {"lower": lower, "upper": upper, "weights": range_weights(lower, upper)}


def _thin(rng: np.random.Generator) -> Cell:
    planted = _planted(rng)
    limits = _narrow(planted, rng) if rng.random() < 0.7 else {}
    shapes = ("mid", "wide", "slit") if limits else ("sliver", "spot", "slit")
    return _cell(planted, base=_region(rng, planted, shapes), **limits)


def _features(rng: np.random.Generator) -> Cell:
    """Mounts, free heights, task sequences, limits of several turns, by turns."""
    what = str(rng.choice(["wall", "ceiling", "tilted", "height", "family", "turns"]))
    tilted = rotation_x(rng.uniform(-0.6, 0.6)) @ rotation_y(rng.uniform(-0.6, 0.6))
    mounts = {"wall": rotation_y(np.pi / 2), "ceiling": rotation_x(np.pi), "tilted": tilted}
    planted = _planted(rng, mounts.get(what), segments=int(rng.integers(2, 4)) if what == "family" else 1)
    limits = {}
    if what == "turns":
        more = TURN * rng.integers(0, 2, planted.arm.dof)
        limits = {"lower": planted.arm.lower - more, "upper": planted.arm.upper + more}
    return _cell(planted, base=_region(rng, planted, ("mid", "wide", "slit"), deep=what == "height"), **limits)


def _dwell(rng: np.random.Generator) -> Cell:
    planted = _planted(rng, dwell=True)
    limits = _narrow(planted, rng) if rng.random() < 0.3 else {}
    return _cell(planted, base=_region(rng, planted, ("mid", "wide", "slit")), **limits)


def _conditioned(rng: np.random.Generator) -> Cell:
    """A conditioning that the planted path has, with little to spare."""
    while True:
        planted = _planted(rng)
        least = _least_conditioning(planted)
        if least > 0.01:
            wanted = least * float(rng.choice([0.6, 0.9, 0.99]))
            return _cell(planted, base=_region(rng, planted, ("mid", "wide", "slit")), min_conditioning=wanted)


def _way_points(rng: np.random.Generator) -> Cell:
    """A UR10e with few poses some centimetres apart, a close conditioning and close joint steps."""
    while True:
        arm = replace(_fixed_arm(rng, np.eye(3), "ur10e"), tool=np.eye(4), grasp=np.eye(4))
        joints = rng.uniform(-np.pi, np.pi, 6)
        base = arm.base.bounds[:, 0]
        first = (arm.base_in_world(base[:3], base[3]) @ flange_poses(arm.robot, joints))[0]
        count = int(rng.choice([4, 16, 32]))
        turned = rotation_about(rng.normal(size=3), np.cumsum(rng.normal(0.0, 0.04, count)))
        poses = transform(first[:3, :3] @ turned, first[:3, 3] + np.cumsum(rng.normal(0.0, 0.015, (count, 3)), axis=0))
        planted = _planted_on(Cell(Task(poses), (arm,), 0.2), arm)
        wanted = float(rng.choice([0.05, 0.1]))
        if planted is not None and _least_conditioning(planted) >= wanted:
            place = planted.arm.base.z
            region = BaseRegion(Interval(-3.0, 3.0), Interval(-3.0, 3.0), place, Interval(-3.14, 3.14))
            return _cell(planted, base=region, min_conditioning=wanted)


def _planted_on(cell: Cell, arm: Arm) -> Planted | None:
    path = _path(cell, arm)
    return None if path is None else Planted(arm, cell.task, cell.max_joint_step, path)


def _least_conditioning(planted: Planted) -> float:
    """The least σmin/σmax along the planted path."""
    arm = planted.arm
    length = characteristic_length(arm.robot)
    return float(np.min(conditioning_of(chain_of(arm.robot), arm.tool, planted.joints, length)))


KINDS: dict[str, Callable[[np.random.Generator], Cell]] = {
    "random": _random,
    "thin": _thin,
    "features": _features,
    "dwell": _dwell,
    "conditioning": _conditioned,
    "way-points": _way_points,
}
"""Kinds of tasks and how they are drawn; every kind has its own seeds."""
