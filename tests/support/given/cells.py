"""Cells with things in them, whose arms hold the object by construction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Unpack

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_x, rotation_z, transform
from duocell.models.catalogue.links import link_bodies
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, Part, Pedestal, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box, Capsule
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm
from duocell.models.robot.robot import Robot
from duocell.optimizer.clearance.path_samples import follow
from tests.support.given.arms import make_arm
from tests.support.given.fields import SurroundingsFields
from tests.support.given.solids import FLOOR, KINDS, random_shape

ALL = Clearances(0.03, 0.03, 0.03, 0.03, 0.0)
GRIPPER = Body("gripper", transform(np.eye(3), [0.0, 0.0, 0.06]), Capsule(0.04, 0.06))


class NotFollowed(Exception):
    """An arm cannot follow the path asked for."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A cell with a layout: base of each arm in the world (A, 4, 4), joints per arm (m, n)."""

    cell: Cell
    surroundings: Surroundings
    bases: Floats
    joints: list[Floats]


def holding(
    robots: Sequence[str | Robot],
    bases: Sequence[Floats] | Floats,
    postures: Sequence[Floats],
    poses: Floats,
    **surroundings: Unpack[SurroundingsFields],
) -> Scene:
    """Arms that hold the object at the first pose in given postures, and follow it to the others in small steps."""
    arms: list[Arm] = []
    for index, (robot, base, q) in enumerate(zip(robots, bases, postures, strict=True)):
        arm = make_arm(robot, f"arm {index}", tool=transform(np.eye(3), [0.0, 0.0, 0.12]))
        hand = base @ flange_poses(arm.robot, q)[0] @ arm.tool
        arms.append(replace(arm, grasp=inverse(poses[0]) @ hand))
    cell = Cell(Task(poses), tuple(arms))
    joints = []
    for arm, base, q in zip(arms, bases, postures, strict=True):
        rows = [np.asarray(q, dtype=float)]
        flanges = poses @ arm.grasp @ inverse(arm.tool)
        for before, after in pairwise(flanges):
            rows.append(_followed(arm, base, before, after, rows[-1]))
        joints.append(np.array(rows))
    return Scene(cell, Surroundings(**surroundings), np.array(bases), joints)


def _followed(arm: Arm, base: Floats, before: Floats, after: Floats, q: Floats) -> Floats:
    turn = Rotation.from_matrix(before[:3, :3].T @ after[:3, :3]).as_rotvec()
    for share in np.linspace(0.1, 1.0, 10):
        pose = transform(
            before[:3, :3] @ Rotation.from_rotvec(share * turn).as_matrix(),
            before[:3, 3] + share * (after[:3, 3] - before[:3, 3]),
        )
        found, good = follow(arm.robot, base, pose[None], q[None], q[None])
        if not good[0]:
            raise NotFollowed
        q = found[0]
    return q


def beam_pair(
    robot: str = "ur10e",
    count: int = 5,
    obstacles: Sequence[Body] = (),
    clearances: Clearances = ALL,
    shift: Sequence[float] = (0.4, 0.0, 0.1),
) -> Scene:
    """Two arms with pedestals and grippers, side by side, that move a beam."""
    start = transform(np.eye(3), [0.0, 0.75, 0.9])
    shares = np.linspace(0.0, 1.0, count)[:, None]
    poses = start @ transform(rotation_z(0.3 * shares[:, 0]), shares * np.array(shift))
    reference = make_arm(robot).robot.reference
    grasps = [transform(rotation_x(np.pi), [x, 0.0, 0.05]) for x in (-0.5, 0.5)]
    bases = [transform(rotation_z(np.pi / 2), [x, 0.0, 0.3]) for x in (-0.6, 0.6)]
    return holding_at(robot, bases, grasps, poses, reference, obstacles, clearances)


def holding_at(
    robot: str | Robot,
    bases: Sequence[Floats],
    grasps: Sequence[Floats],
    poses: Floats,
    seed: Floats,
    obstacles: Sequence[Body],
    clearances: Clearances,
) -> Scene:
    """Arms with given grasps; the joints come from Newton's method from one seed."""
    tool = transform(np.eye(3), [0.0, 0.0, 0.12])
    arms = tuple(make_arm(robot, f"arm {i}", grasp=grasp, tool=tool) for i, grasp in enumerate(grasps))
    cell = Cell(Task(poses), arms)
    joints = []
    for arm, base in zip(arms, bases, strict=True):
        flanges = poses @ arm.grasp @ inverse(tool)
        home = base @ flange_poses(arm.robot, seed)[0]
        q = _followed(arm, base, home, flanges[0], np.array(seed))
        rows = [q]
        for before, after in pairwise(flanges):
            rows.append(_followed(arm, base, before, after, rows[-1]))
        joints.append(np.array(rows))
    pedestal = Pedestal(0.3, Footprint.rectangle(0.3, 0.3))
    surroundings = Surroundings(
        obstacles=(FLOOR, *obstacles),
        part=Part((Body("beam", np.eye(4), Box(np.array([1.2, 0.08, 0.08]))),), 0.15),
        clearances=clearances,
        equipment={arm.name: Equipment((GRIPPER,), pedestal, link_bodies(arm.robot)) for arm in arms},
    )
    return Scene(cell, surroundings, np.array(bases), joints)


def random_obstacles(rng: np.random.Generator, count: int, low: ArrayLike, high: ArrayLike) -> tuple[Body, ...]:
    """Solids of every kind in a box of the world."""
    bodies = []
    for index in range(count):
        pose = transform(Rotation.random(rng=rng).as_matrix(), rng.uniform(np.asarray(low), np.asarray(high)))
        bodies.append(Body(f"obstacle {index}", pose, random_shape(KINDS[index % len(KINDS)], rng)))
    return tuple(bodies)
