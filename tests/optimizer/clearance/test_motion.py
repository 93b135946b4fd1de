"""Bounds of motion hold for every pair and are not wasteful."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_vector
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel, Configurations
from duocell.optimizer.clearance.motion import Motion
from tests.support.given.cells import beam_pair, random_obstacles

SCENE = beam_pair(count=6, obstacles=random_obstacles(np.random.default_rng(2), 5, [-1.5, -1.0, 0.2], [1.5, 1.5, 1.5]))
MODEL = CollisionModel(SCENE.cell.arms, SCENE.surroundings)


def held(start: int, end: int) -> tuple[Configurations, list[Floats], Floats, Floats]:
    """The beam's own path from one pose to another, its samples and what joints and object travel."""
    poses, joints = SCENE.cell.task.poses, SCENE.joints
    places = MODEL.configure(SCENE.bases, [q[start : end + 1] for q in joints], poses[start : end + 1])
    steps = [np.sum(np.abs(np.diff(q[start : end + 1], axis=0)), axis=0)[None] for q in joints]
    shift = np.sum(np.linalg.norm(np.diff(poses[start : end + 1, :3, 3], axis=0), axis=1))[None]
    turns = rotation_vector(poses[start:end, :3, :3].swapaxes(1, 2) @ poses[start + 1 : end + 1, :3, :3])
    return places, steps, shift, np.sum(np.linalg.norm(turns, axis=1))[None]


@pytest.mark.parametrize(("start", "end"), [(0, 1), (1, 3), (0, 5)])
def test_distances_change_by_no_more_than_the_bound(start: int, end: int) -> None:
    places, steps, shift, turn = held(start, end)
    motion = Motion(MODEL)
    levers = motion.levers(places)
    bound = motion.between([x[:1] for x in levers], [x[-1:] for x in levers], steps, shift, turn)[0]
    distances = np.array(
        [
            [MODEL.contact(places, k, int(p)).distance for p in np.flatnonzero(places.counted)]
            for k in range(len(places))
        ]
    )
    change = np.max(distances, axis=0) - np.min(distances, axis=0)
    assert np.all(change <= bound[places.counted] + 1e-6)


def test_levers_are_the_farthest_points_from_the_axes() -> None:
    places, *_ = held(0, 1)
    levers = Motion(MODEL).levers(places)[1]
    b = MODEL.bodies
    own = [i for i, owner in enumerate(b.owners) if owner.arm == 1]
    start = MODEL.offsets[1] + 1
    for place, body in enumerate(own):
        for joint in range(6):
            frame = places.frames[0, start + joint]
            axis = frame[:3, :3] @ SCENE.cell.arms[1].robot.joint_axes[joint]
            shares = np.linspace(0.0, 1.0, 50)[:, None]
            points = (1 - shares) * places.ends[0, body, 0] + shares * places.ends[0, body, 1] - frame[:3, 3]
            aside = np.linalg.norm(points - np.outer(points @ axis, axis), axis=1)
            assert levers[0, place, joint] == pytest.approx(aside.max() + b.radius[body], abs=1e-9)


def test_what_the_hands_hold_does_not_move_against_them() -> None:
    places, steps, shift, turn = held(0, 2)
    motion = Motion(MODEL)
    levers = motion.levers(places)
    bound = motion.between([x[:1] for x in levers], [x[-1:] for x in levers], steps, shift, turn)[0]
    b = MODEL.bodies
    for pair, (i, j) in enumerate(zip(b.first, b.second, strict=True)):
        if b.kinds[pair] is PairClass.ARM_ARM and b.names[i] == "arm 0 gripper" and b.names[j] == "arm 1 gripper":
            assert bound[pair] < 1e-9
        if b.kinds[pair] is PairClass.PART_OBSTACLE:
            assert bound[pair] <= shift[0] + turn[0] * 0.66


def test_a_longer_way_has_a_larger_bound() -> None:
    places, steps, shift, turn = held(0, 1)
    motion = Motion(MODEL)
    levers = [x[:1] for x in motion.levers(places)]
    short = motion.between(levers, levers, steps, shift, turn)
    long = motion.between(levers, levers, [2.0 * q for q in steps], 2.0 * shift, 2.0 * turn)
    assert np.all(long >= short - 1e-12)
    none = motion.between(levers, levers, [0.0 * q for q in steps], 0.0 * shift, 0.0 * turn)
    assert np.all(none == 0.0)
