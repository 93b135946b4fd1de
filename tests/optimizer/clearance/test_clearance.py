"""Paths between the poses: contacts found, freedom proved, against a dense second opinion."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, PairClass, Part, Surroundings
from duocell.models.cell.task import Task
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.shapes import Body, Box, Capsule, Sphere
from duocell.models.kinematics.kinematics import flange_poses
from duocell.optimizer.clearance.clearance import ClassClearance, PathClearance, check_clearance
from duocell.optimizer.clearance.continuous_collision import Resolution
from duocell.optimizer.clearance.path_samples import ObjectPath, follow
from tests.support.given.arms import make_arm
from tests.support.given.cells import ALL, NotFollowed, Scene, beam_pair, holding, random_obstacles
from tests.support.given.solids import FLOOR
from tests.support.oracles.dense import dense_minima


def check(scene: Scene, resolution: Resolution | None = None) -> tuple[PathClearance, CollisionModel]:
    model = CollisionModel(scene.cell.arms, scene.surroundings)
    clearances = scene.surroundings.clearances
    return check_clearance(scene.cell, model, clearances, scene.bases, scene.joints, resolution), model


def by_class(found: PathClearance) -> dict[PairClass, ClassClearance]:
    return {entry.kind: entry for entry in found.classes}


def agree(found: PathClearance, dense: dict[str, float]) -> None:
    """The dense minima lie between what is promised and what was seen."""
    for entry in found.classes:
        lowest = dense[str(entry.kind)]
        assert lowest >= entry.lower_bound - 1e-6, entry.kind
        if entry.certain:
            assert entry.clear == (min(lowest, entry.distance) >= entry.required)


def test_a_free_path_is_certain_and_agrees_with_a_dense_check() -> None:
    scene = beam_pair(count=4, shift=(0.2, 0.0, 0.05))
    found, model = check(scene)
    assert found.clear
    assert found.certain
    assert found.limits_certain
    assert found.limit_excess < 0.0
    assert set(by_class(found)) == set(PairClass)
    dense = dense_minima(scene, model, 20)
    agree(found, dense)
    for entry in found.classes:
        assert entry.distance == pytest.approx(dense[str(entry.kind)], abs=0.02)


def rod_between(scene: Scene, step: int, fraction: float) -> Body:
    """A rod, 6 mm thick, upright through the place where the beam's end passes ``fraction`` of the way after a pose."""
    poses = scene.cell.task.poses
    tip = np.array([0.6, 0.0, 0.0, 1.0])
    before, after = poses[step] @ tip, poses[step + 1] @ tip
    middle = (1 - fraction) * before + fraction * after
    return Body("rod", transform(np.eye(3), middle[:3]), Capsule(0.003, 0.05))


@pytest.mark.parametrize("fraction", [0.5, 0.37])
def test_a_thin_rod_between_two_poses_is_found(fraction: float) -> None:
    bare = beam_pair(count=3, shift=(0.5, 0.0, 0.0), clearances=Clearances(part_obstacle=0.002))
    rod = rod_between(bare, 0, fraction)
    scene = replace(bare, surroundings=replace(bare.surroundings, obstacles=(rod,)))
    found, model = check(scene)
    entry = by_class(found)[PairClass.PART_OBSTACLE]
    for k, pose in enumerate(scene.cell.task.poses):
        at_pose = model.contacts(scene.bases, [q[k] for q in scene.joints], pose)[PairClass.PART_OBSTACLE]
        if k == 0:
            assert at_pose.distance > 0.01
    assert not found.clear
    assert entry.certain
    assert entry.contact.second == "rod"
    assert entry.distance < entry.required
    assert 0.0 < entry.pose + entry.fraction < 1.6


def test_a_rod_is_passed_by_half_a_millimetre_more_than_required() -> None:
    """The rod stands beside the ball's way, 1.6 mm off it: enough for 1 mm, not for 1.7 mm."""
    poses = np.tile(np.eye(4), (2, 1, 1))
    poses[:, :3, 3] = [[0.0, 0.6, 0.8], [0.02, 0.6, 0.8]]
    arm = make_arm("ur10e")
    base = transform(rotation_z(np.pi / 2), [0.0, 0.0, 0.3])
    for required, clear in ((0.001, True), (0.0017, False)):
        scene = holding(
            ["ur10e"],
            [base],
            [arm.robot.reference],
            poses,
            part=Part((Body("ball", np.eye(4), Sphere(0.05)),)),
            clearances=Clearances(part_obstacle=required),
        )
        rod = Body("rod", transform(np.eye(3), [0.01, 0.6 + 0.05 + 0.003 + 0.0016, 0.8]), Capsule(0.003, 0.2))
        scene = replace(scene, surroundings=replace(scene.surroundings, obstacles=(rod,)))
        found, _ = check(scene)
        (entry,) = found.classes
        assert entry.clear is clear
        assert entry.certain
        if clear:
            assert entry.distance == pytest.approx(0.0016, abs=2e-4)
            assert 0.001 <= entry.lower_bound <= 0.0016 + 1e-9
            assert found.samples > 5


BENT = {  # far from singular, so that short paths can be followed from anywhere near
    "puma560": [0.2, -0.6, 2.2, 0.3, 0.9, 0.0],
    "ur10e": [0.0, -1.4, 1.5, -1.6, -1.5, 0.0],
    "ur5e": [0.3, -1.6, 1.7, -1.4, -1.5, 0.5],
    "lrmate200id": [0.0, 0.3, 0.2, 0.3, 0.9, 0.0],
    "kr6_r900": [0.2, -1.2, 1.3, 0.3, 0.9, 0.0],
    "iiwa14": [0.0, 0.5, 0.2, -1.5, 0.1, 1.0, 0.0],
}


def random_scene(robots: tuple[str, str], rng: np.random.Generator) -> Scene:
    """Two arms at random places, somewhere near bent postures, that can follow a short path among obstacles."""
    for _ in range(50):
        bases = [transform(rotation_z(rng.uniform(-3, 3)), [x, rng.uniform(-0.3, 0.3), 0.4]) for x in (-0.7, 0.7)]
        postures = [np.array(BENT[name]) + rng.uniform(-0.3, 0.3, len(BENT[name])) for name in robots]
        start = transform(rotation_z(rng.uniform(-3, 3)), [*rng.uniform(-0.2, 0.2, 2), rng.uniform(0.5, 1.0)])
        steps = np.cumsum(rng.uniform(-0.06, 0.06, (3, 3)), axis=0)
        poses = transform(start[:3, :3] @ rotation_z([0.0, 0.08, 0.1]), start[:3, 3] + steps - steps[0])
        part = Part((Body("part", np.eye(4), Box(np.array([0.3, 0.1, 0.1]))),))
        obstacles = (FLOOR, *random_obstacles(rng, 4, [-1.5, -1.5, 0.2], [1.5, 1.5, 1.5]))
        try:
            return holding(robots, bases, postures, poses, obstacles=obstacles, part=part, clearances=ALL)
        except NotFollowed:
            continue
    raise AssertionError("no scene in 50 tries")


@pytest.mark.parametrize("seed", range(8))
@pytest.mark.parametrize("robots", [("puma560", "ur10e"), ("lrmate200id", "kr6_r900"), ("iiwa14", "ur5e")])
def test_random_cells_agree_with_a_dense_check(robots: tuple[str, str], seed: int) -> None:
    scene = random_scene(robots, np.random.default_rng(seed))
    found, model = check(scene)
    assert not found.breaks
    dense = dense_minima(scene, model, 12)
    agree(found, dense)
    assert found.clear <= all(dense[str(e.kind)] >= e.required - 1e-6 for e in found.classes)


def test_a_coarser_resolution_or_fewer_samples_say_that_they_are_not_certain() -> None:
    bare = beam_pair(count=2, shift=(0.3, 0.0, 0.0), clearances=Clearances(part_obstacle=0.002))
    pillar = Body("pillar", transform(np.eye(3), [0.9, 0.75 + 0.04 + 0.02 + 0.0021, 0.9]), Capsule(0.02, 0.5))
    poses = np.array([bare.cell.task.poses[0]] * 2)
    poses[1, 0, 3] += 0.3
    scene = holding(
        ["ur10e"],
        bare.bases[:1],
        [bare.joints[0][0]],
        poses,
        part=bare.surroundings.part,
        obstacles=(pillar,),
        clearances=Clearances(part_obstacle=0.002),
    )
    for resolution in (Resolution(length=0.05, angle=0.1), Resolution(most_samples=10)):
        found, _ = check(scene, resolution)
        assert found.clear
        assert not found.certain
    assert found.samples <= 10


def test_an_arm_that_cannot_follow_is_a_break_and_never_clear() -> None:
    """From one side of the base to the other: the straight way leads through the arm itself."""
    arm = make_arm("ur10e", "lone")
    q = arm.robot.reference
    far = q + 3.0 * np.eye(6)[0]
    poses = flange_poses(arm.robot, np.stack([q, far]))
    cell = Cell(Task(poses), (arm,))
    scene = Scene(
        cell, Surroundings((FLOOR,), clearances=Clearances(arm_obstacle=0.0)), np.eye(4)[None], [np.stack([q, far])]
    )
    found, _ = check(scene)
    assert found.breaks
    assert not found.clear
    assert found.breaks[0].arm == "lone"
    assert 0.0 < found.breaks[0].fraction < 1.0
    assert all(entry.lower_bound == -np.inf for entry in found.classes)


def test_limits_exceeded_between_the_poses_are_seen() -> None:
    """The elbow is most bent halfway; a limit just beyond its values at the poses is broken there."""
    scene = beam_pair(count=2, shift=(0.5, 0.0, 0.0))
    found, _ = check(scene)
    assert found.limit_excess < 0.0
    q = scene.joints[0]
    arm = scene.cell.arms[0]
    objects = ObjectPath(scene.cell.task.poses).at(np.zeros(21, dtype=int), np.linspace(0.0, 1.0, 21))
    between, good = follow(
        arm.robot,
        scene.bases[0],
        objects @ arm.grasp @ np.linalg.inv(arm.tool),
        np.linspace(q[0], q[1], 21),
        np.linspace(q[0], q[1], 21),
    )
    assert np.all(good)
    beyond = between.max(axis=0) - q.max(axis=0)
    joint = int(np.argmax(beyond))
    middle_only = beyond[joint]
    assert middle_only > 1e-3
    upper = arm.upper.copy()
    upper[joint] = q[:, joint].max() + 0.5 * middle_only
    tight = replace(scene, cell=replace(scene.cell, arms=(replace(arm, upper=upper), scene.cell.arms[1])))
    found, _ = check(tight)
    assert found.limit_excess == pytest.approx(0.5 * middle_only, abs=0.1 * middle_only)


def test_the_time_of_a_check_is_that_of_a_page_that_follows_a_drag() -> None:
    """Two arms, 16 poses, no meshes: well below 50 ms on an idle machine; the tenfold is allowed on a busy one."""
    scene = beam_pair(count=16, obstacles=random_obstacles(np.random.default_rng(1), 7, [-2, -2, 0.2], [2, -1, 1.5]))
    model = CollisionModel(scene.cell.arms, scene.surroundings)
    times = []
    for _ in range(5):
        started = time.perf_counter()
        check_clearance(scene.cell, model, scene.surroundings.clearances, scene.bases, scene.joints)
        times.append(time.perf_counter() - started)
    assert min(times) < 0.5
