"""Drawn tasks of arms with three parallel axes whose wrist may be singular, and boxes of bases at which it is.

Axis 6 is level, or all but level, at the poses; where the base stands so that the three axes are along it, joint 5 is
in its singularity. These bases lie on lines, one for each pose and sense.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.kinematics.kinematics import reach
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.reduction.reduced import ReducedProblem, reduced_problem

RISES = (0.0, 0.0, 1e-6, 1e-4, 1e-3, 1e-2)
"""rad by which axis 6 may rise over the base plane."""


def singular_problem(name: str, rng: np.random.Generator, allow: bool, segments: int = 1) -> ReducedProblem:
    """A task of ``segments`` segments for a robot of the catalogue; with ``allow`` it may go through singularities."""
    chain = robot(name)
    paths = [Task(_poses(rng, reach(chain))) for _ in range(segments)]
    task = (
        paths[0]
        if segments == 1
        else task_sequence([TaskSegment("", path, float(rng.choice([0.0, 0.5, 3.0]))) for path in paths])
    )
    scale = reach(chain)
    lower, upper = chain.lower.copy(), chain.upper.copy()
    joint = int(rng.integers(6))
    if rng.random() < 0.5:
        first, last = np.clip([lower[joint], upper[joint]], -7.0, 7.0)
        low, high = np.sort(rng.uniform(first, last, 2))
        lower[joint], upper[joint] = low - 0.2, high + 0.2
    side = Interval(-scale, scale)
    height = Interval(-0.3 * scale, 0.3 * scale) if rng.random() < 0.4 else Interval(0.0, 0.0)
    turned = float(rng.uniform(-3.0, 3.0))
    yaw = FREE_YAW if rng.random() < 0.5 else Interval(turned, turned + float(rng.uniform(0.0, 5.0)))
    reference = chain.reference + rng.normal(size=6) * rng.choice([0.0, 0.5, 2.0])
    base, weights = BaseRegion(side, side, height, yaw), rng.uniform(0.0, 2.0, 6)
    arm = Arm(name, chain, np.eye(4), np.eye(4), base, lower, upper, reference, weights, avoid_singularities=not allow)
    problem = reduced_problem(Cell(task, (arm,), max_joint_step=float(rng.choice([0.6, 0.5 * np.pi, np.pi]))), arm)
    if problem is None:
        raise ValueError(f"{name} has no reduced problem")
    return replace(problem, rotations=_level(problem, rng))


def _poses(rng: np.random.Generator, scale: float) -> Floats:
    """(m, 4, 4) on a line of a tenth to nine tenths of the reach; orientations come later."""
    way = np.linspace(-0.5, 0.5, int(rng.integers(1, 9)))
    direction = rng.normal(size=3) * [1.0, 1.0, 0.4]
    places = np.outer(way, direction / np.linalg.norm(direction) * rng.uniform(0.1, 0.9) * scale)
    places[:, 2] += rng.uniform(-0.2, 0.5) * scale
    poses: Floats = transform(np.broadcast_to(np.eye(3), (len(way), 3, 3)), places)
    return poses


def _level(problem: ReducedProblem, rng: np.random.Generator) -> Floats:
    """(m, 3, 3) flange orientations with axis 6 about level, turning a little from pose to pose."""
    axis = problem.form.home_rotation.T @ problem.form.axes[5]  # in the flange
    heading, turn = rng.uniform(-np.pi, np.pi), rng.choice([0.0, 0.05, 0.4])
    rotations = []
    for k in range(len(problem.positions)):
        rise, bearing = float(rng.choice(RISES) * rng.choice([-1.0, 1.0])), heading + turn * k
        wanted = np.array([np.cos(bearing) * np.cos(rise), np.sin(bearing) * np.cos(rise), np.sin(rise)])
        across = np.cross(axis, wanted)
        onto = rotation_about(across, float(np.arctan2(np.linalg.norm(across), axis @ wanted)))
        rotations.append(rotation_about(wanted, 0.1 * k) @ onto)
    return np.array(rotations)


def singular_places(problem: ReducedProblem, rng: np.random.Generator, count: int, farthest: float = -1.5) -> Floats:
    """(count, 3) m, bases on lines where the wrist is singular at a pose, or up to 10^farthest m beside them."""
    form = problem.form
    wrist = problem.positions + problem.rotations @ form.wrist_in_flange - form.origin
    last = problem.rotations @ form.home_rotation.T @ form.axes[5]
    pose = rng.integers(len(wrist), size=count)
    n = last[pose, :2] / np.linalg.norm(last[pose, :2], axis=1, keepdims=True) * rng.choice([-1.0, 1.0], (count, 1))
    ahead = n @ rotation_z(0.5 * np.pi)[:2, :2]
    place: Floats = wrist[pose]
    place[:, :2] -= (
        form.offset * n + rng.uniform(-0.9, 0.9, (count, 1)) * (form.planar.upper + form.planar.fore) * ahead
    )
    place[:, :2] += n * (rng.choice([-1.0, 1.0], count) * 10.0 ** rng.uniform(-6.0, farthest, count))[:, None]
    bounds = problem.arm.base.bounds[:3]
    place[:, 2] = rng.uniform(bounds[2, 0], bounds[2, 1], count)
    return np.clip(place, bounds[:, 0], bounds[:, 1])


def singular_boxes(problem: ReducedProblem, rng: np.random.Generator, count: int) -> Boxes:
    """Boxes from a tenth of a millimetre to some decimetres that hold such places, in any posture."""
    places, bounds = singular_places(problem, rng, count), problem.arm.base.bounds[:3]
    half = 10.0 ** rng.uniform(-4.0, -0.5, (count, 1)) * np.ones(3)
    low = np.maximum(places - half * rng.uniform(0.0, 2.0, (count, 3)), bounds[:, 0])
    low, high = np.minimum(low, places), np.maximum(np.minimum(low + 2.0 * half, bounds[:, 1]), places)
    return Boxes(0.5 * (low + high), 0.5 * (high - low), rng.integers(len(ALL_SIGNS), size=count))


def members_near_curves(problem: ReducedProblem, boxes: Boxes, rng: np.random.Generator, near: bool) -> Floats:
    """(N, 3) m, a place in every box; with ``near`` one beside a singular line where one of a few is in the box."""
    anywhere: Floats = boxes.centre + boxes.half * rng.uniform(-1.0, 1.0, boxes.half.shape)
    if not near:
        return anywhere
    some = singular_places(problem, rng, 8 * len(boxes)).reshape(8, len(boxes), 3)
    inside = np.all(np.abs(some - boxes.centre) <= boxes.half, axis=2)
    found = some[np.argmax(inside, axis=0), np.arange(len(boxes))]
    return np.where(np.any(inside, axis=0)[:, None], found, anywhere)
