"""Cells for the trial of exclusions: arms on any mount, task sequences, all shapes of obstacles, floors."""

from __future__ import annotations

from math import pi

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

from bench.draws.cells import CELLS, real_cell
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, Part, Pedestal, Surroundings
from duocell.models.cell.task import Task
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from duocell.models.kinematics.kinematics import reach
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights

ROBOTS = ("puma560", "ur5e", "kr6_r900", "lrmate200id", "irb6700", "nova5")
MOUNTS = (
    np.eye(3),
    np.eye(3),
    Rotation.from_euler("x", pi).as_matrix(),
    Rotation.from_euler("x", pi / 2).as_matrix(),
    Rotation.from_euler("zyx", [0.4, 0.5, -0.3]).as_matrix(),
)


def soundness_cell(number: int, rng: np.random.Generator) -> Cell:
    """Even numbers: a cell of the hundred; odd ones: a drawn one with one or two arms."""
    return real_cell(number // 2 % CELLS).cell if number % 2 == 0 else drawn_cell(rng)


def drawn_cell(rng: np.random.Generator) -> Cell:
    """One or two arms with 1 to 3 segments among up to 6 obstacles."""
    names = rng.choice(ROBOTS, int(rng.integers(1, 3)))
    scale = min(reach(robot(str(name))) for name in names)
    paths = [_path(scale, rng) for _ in range(int(rng.choice([1, 1, 2, 3])))]
    task = paths[0]
    if len(paths) > 1:
        task = task_sequence([TaskSegment("", path, float(rng.choice([0.5, 1.0, 3.0]))) for path in paths])
    arms = tuple(_arm(str(name), number, rng) for number, name in enumerate(names))
    clearances = Clearances(
        arm_arm=float(rng.choice([0.0, 0.02])),
        arm_part=float(rng.choice([0.0, 0.01])),
        arm_obstacle=float(rng.choice([0.0, 0.02])),
        self_collision=float(rng.choice([0.0, 0.01])),
    )
    if rng.random() < 0.2:
        clearances = Clearances()
    part = Part((Body("part", np.eye(4), Box(scale * rng.uniform(0.05, 0.3, 3))),), float(rng.uniform(0.0, 0.1)))
    surroundings = Surroundings(
        obstacles=tuple(_obstacle(k, scale, rng) for k in range(int(rng.choice([0, 1, 2, 4, 6])))),
        part=part,
        floor=_floor(scale, rng) if rng.random() < 0.5 else None,
        clearances=clearances,
        equipment={arm.name: _equipment(scale, rng) for arm in arms},
    )
    return Cell(task, arms, surroundings=surroundings)


def _path(scale: float, rng: np.random.Generator) -> Task:
    count = int(rng.integers(2, 9))
    start = Rotation.from_euler("xyz", [pi + rng.normal() * 0.3, rng.normal() * 0.3, rng.uniform(-pi, pi)])
    end = start * Rotation.from_rotvec(rng.normal(size=3) * rng.choice([0.0, 0.3, 0.6]))
    way = np.linspace(0.0, 1.0, count)
    direction = rng.normal(size=3) * [1.0, 1.0, 0.3]
    poses = np.tile(np.eye(4), (count, 1, 1))
    poses[:, :3, :3] = Slerp([0, 1], Rotation.concatenate([start, end]))(way).as_matrix()
    poses[:, :3, 3] = np.outer(way - 0.5, direction / np.linalg.norm(direction) * rng.uniform(0.1, 0.6) * scale)
    poses[:, 2, 3] += rng.uniform(0.1, 0.5) * scale
    return Task(poses)


def _arm(name: str, number: int, rng: np.random.Generator) -> Arm:
    chain = robot(name)
    far, low = reach(chain), float(rng.uniform(-3.0, 3.0))
    side = Interval(-far, far)
    height = Interval(-0.2 * far, 0.2 * far) if rng.random() < 0.5 else Interval(0.0, 0.0)
    yaw = FREE_YAW if rng.random() < 0.6 else Interval(low, low + float(rng.choice([0.0, 0.5, 3.0])))
    conditioning = float(rng.uniform(0.02, 0.12)) if rng.random() < 0.4 else None
    return Arm(
        f"{name} {number}",
        chain,
        transform(np.eye(3), [0.0, 0.0, 0.1]),
        transform(np.eye(3), rng.uniform(-0.05, 0.05, 3) * far),
        BaseRegion(side, side, height, yaw),
        chain.lower,
        chain.upper,
        chain.reference,
        range_weights(chain.lower, chain.upper),
        min_conditioning=conditioning,
        mount=MOUNTS[int(rng.integers(len(MOUNTS)))],
    )


def _obstacle(number: int, scale: float, rng: np.random.Generator) -> Body:
    size = scale * rng.uniform(0.05, 0.6, 3)
    shapes: tuple[Shape, ...] = (
        Box(size),
        Cylinder(float(size[0]), float(size[1])),
        Sphere(float(size[0])),
        Capsule(float(size[0]), float(size[1])),
        ConvexHull(rng.normal(size=(12, 3)) * 0.5 * size),
        HalfSpace(),
    )
    shape = shapes[int(rng.integers(len(shapes)))]
    turn = Rotation.random(rng=rng).as_matrix()
    if isinstance(shape, HalfSpace):
        turn = np.eye(3)
    place = scale * rng.uniform(-1.0, 1.0, 3)
    if isinstance(shape, HalfSpace):
        place[2] = -scale * rng.uniform(0.0, 0.3)
    return Body(f"obstacle {number}", transform(turn, place), shape)


def _equipment(scale: float, rng: np.random.Generator) -> Equipment:
    footprint = Footprint.rectangle(*(scale * rng.uniform(0.1, 0.5, 2))) if rng.random() < 0.6 else Footprint.disc(0.1)
    if rng.random() < 0.5:
        return Equipment(pedestal=Pedestal(float(scale * rng.uniform(0.1, 0.5)), footprint))
    return Equipment(footprint=footprint)


def _floor(scale: float, rng: np.random.Generator) -> Floor:
    corners: Floats = scale * rng.uniform(0.6, 1.2) * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    middle = scale * rng.uniform(-0.5, 0.5, 2)
    hole = middle + scale * np.array([[0.0, 0.0], [0.2, 0.0], [0.0, 0.2]])
    return Floor(corners, (hole,), float(rng.choice([0.0, 0.05])))
