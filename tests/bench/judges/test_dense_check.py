"""The slow judge sees what is there, agrees with the quick one, and reads the rules as the models do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.judges.dense_check import dense_check
from bench.judges.dense_path import object_steps
from bench.judges.dense_rules import coupling_excess, floor_gap, region_excess
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, SameHeight
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.cell.surroundings import Clearances, Pedestal
from duocell.models.cell.surroundings import Equipment as Brings
from duocell.models.cell.task import Task
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.shapes import Body, Capsule
from duocell.models.robot.arm import BaseRegion, Interval
from duocell.optimizer.clearance.clearance import check_clearance
from tests.support.given.arms import make_arm
from tests.support.given.cells import Scene, beam_pair, random_obstacles

ONLY_POSES = 1e3, 1e3
"""Steps that are longer than any path: nothing but the poses is looked at."""
ANYWHERE = BaseRegion(Interval(-9.0, 9.0), Interval(-9.0, 9.0), Interval(-9.0, 9.0))


def standing(scene: Scene) -> tuple[Cell, Floats]:
    """A scene as what the judge asks for: a cell whose bases may stand anywhere, and x, y, z, yaw of each base."""
    arms = tuple(replace(arm, base=ANYWHERE) for arm in scene.cell.arms)
    cell = replace(scene.cell, arms=arms, surroundings=scene.surroundings)
    return cell, np.array([[*base[:3, 3], np.arctan2(base[1, 0], base[0, 0])] for base in scene.bases])


def test_a_thin_rod_between_two_poses_is_found() -> None:
    bare = beam_pair(count=3, shift=(0.0, -0.2, 0.0), clearances=Clearances(part_obstacle=0.002))
    cell, stands = standing(bare)
    assert dense_check(cell, stands, bare.joints, *ONLY_POSES).clean
    spot = 0.5 * cell.task.poses[0, :3, 3] + 0.5 * cell.task.poses[1, :3, 3]
    rod = Body("rod", transform(np.eye(3), spot), Capsule(0.003, 0.05))
    cell = replace(cell, surroundings=replace(cell.surroundings, obstacles=(rod,)))
    assert dense_check(cell, stands, bare.joints, *ONLY_POSES).clean
    verdict = dense_check(cell, stands, bare.joints)
    assert len(verdict.faults) == 1
    assert "rod" in verdict.faults[0]
    nearest = verdict.nearest["part_obstacle"]
    assert nearest.distance < 0.0
    assert (nearest.pose, nearest.second) == (0, "rod")
    assert 0.3 < nearest.fraction < 0.9
    two_jobs = replace(cell, task=Task(cell.task.poses, starts=(0, 1)))
    apart = dense_check(two_jobs, stands, bare.joints)
    assert apart.clean  # nobody goes from the last pose of a segment to the first of the next
    assert apart.samples < verdict.samples


@pytest.mark.parametrize("seed", range(3))
def test_it_agrees_with_the_check_that_duocell_makes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    things = random_obstacles(rng, 6, (-1.0, 0.2, 0.1), (1.0, 1.4, 1.5))
    scene = beam_pair(count=4, shift=(0.15, 0.0, 0.05), obstacles=things)
    cell, stands = standing(scene)
    model = CollisionModel(cell.arms, cell.surroundings)
    at_poses = dense_check(cell, stands, scene.joints, *ONLY_POSES).nearest
    contacts = [
        model.contacts(scene.bases, [q[k] for q in scene.joints], pose) for k, pose in enumerate(cell.task.poses)
    ]
    for kind in contacts[0]:
        lowest = min(found[kind].distance for found in contacts)
        if lowest > 0.0:  # depths of penetration are good to Coal's tolerance only
            assert at_poses[str(kind)].distance == pytest.approx(lowest, abs=1e-6), kind
        else:
            assert at_poses[str(kind)].distance < 1e-6
    dense = dense_check(cell, stands, scene.joints, 2e-3, 0.01)
    found = check_clearance(cell, model, cell.surroundings.clearances, scene.bases, scene.joints)
    assert {str(entry.kind) for entry in found.classes} == set(dense.nearest)
    for entry in found.classes:
        nearest = dense.nearest[str(entry.kind)]
        assert nearest.distance >= entry.lower_bound - 1e-6
        assert nearest.distance <= max(entry.distance, 0.0) + 4e-3  # a step between samples
        if entry.certain:
            assert entry.clear == (nearest.distance >= entry.required)
    assert dense.limit_excess == pytest.approx(found.limit_excess, abs=1e-2)
    assert not dense.lost


def test_another_branch_between_two_poses_is_seen() -> None:
    scene = beam_pair(count=3, shift=(0.2, 0.0, 0.0))
    cell, stands = standing(scene)
    joints = [q.copy() for q in scene.joints]
    joints[0][2, 5] += 2.0 * np.pi  # the same posture, one turn on
    verdict = dense_check(cell, stands, joints, 0.01, 0.1)
    assert [lost.arm for lost in verdict.lost] == ["arm 0"]
    assert verdict.pose_error < 1e-6
    assert verdict.step_excess > np.pi
    assert not verdict.clean


def test_limits_poses_and_conditioning_are_held_against_the_cell() -> None:
    scene = beam_pair(count=3, shift=(0.2, 0.0, 0.0))
    cell, stands = standing(scene)
    assert dense_check(cell, stands, scene.joints, 0.05, 0.2).clean
    high = cell.arms[0].upper.copy()
    high[3] = scene.joints[0][:, 3].max() - 0.01
    narrow = replace(cell, arms=(replace(cell.arms[0], upper=high), cell.arms[1]))
    assert dense_check(narrow, stands, scene.joints, 0.05, 0.2).limit_excess == pytest.approx(0.01, abs=1e-3)
    off = stands.copy()
    off[1, 0] += 1e-3
    assert dense_check(cell, off, scene.joints, 0.05, 0.2).pose_error == pytest.approx(1e-3, rel=1e-3)
    picky = replace(cell, arms=(replace(cell.arms[0], min_conditioning=0.9), cell.arms[1]))
    assert 0.0 < dense_check(picky, stands, scene.joints, 0.05, 0.2).conditioning_violation < 0.9


def test_steps_of_the_object_are_short_and_end_at_the_poses() -> None:
    poses = np.array([transform(rotation_z(yaw), [x, 0.0, 0.0]) for yaw, x in ((0.0, 0.0), (0.4, 0.1), (0.4, 0.1))])
    steps = object_steps(poses, 0.02, 0.05)
    shifts = np.linalg.norm(np.diff(steps.poses[:, :3, 3], axis=0), axis=1)
    assert shifts.max() <= 0.02 + 1e-12
    at_poses = steps.fraction == 0.0
    assert steps.poses[at_poses] == pytest.approx(poses)
    assert list(steps.step[at_poses]) == [0, 1, 2]
    halfway = steps.poses[np.argmin(np.abs(steps.step + steps.fraction - 0.5))]
    assert halfway[:3, :3] == pytest.approx(rotation_z(0.2))


# --- rules ------------------------------------------------------------------------------------------------------------

TIES = [
    SameHeight((0, 1)),
    Distance((0, 1), 0.5, 1.0),
    Direction((0, 1), 0.7),
    Mirror((0, 1), (0.3, -0.2), 0.4),
    Rail((1, 0), 2.0),
    Rail((0, 1), -0.5, (0.1, 0.2)),
]


def obedient(tie: Coupling, rng: np.random.Generator) -> Floats:
    """Random stands that obey a coupling."""
    stands = rng.uniform(-1.0, 1.0, (2, 4))
    stands[1, 2] = stands[0, 2]
    far = rng.uniform(0.5, 1.0)
    along = np.array([np.cos(getattr(tie, "angle", 0.3)), np.sin(getattr(tie, "angle", 0.3))])
    if isinstance(tie, Rail) and tie.point is not None:
        stands[0, :2] = tie.point + rng.normal() * along
    stands[1, :2] = stands[0, :2] + far * along
    if isinstance(tie, Mirror):
        across = np.array([-along[1], along[0]])
        off = stands[0, :2] - tie.point
        stands[1, :2] = stands[0, :2] - 2.0 * (off @ across) * across
        stands[1, 3] = 2.0 * tie.angle - stands[0, 3] + 2.0 * np.pi * rng.integers(-1, 2)
    return stands


@pytest.mark.parametrize("tie", TIES, ids=lambda tie: tie.kind)
def test_couplings_are_read_as_the_models_read_them(tie: Coupling) -> None:
    rng = np.random.default_rng(5)
    for _ in range(20):
        stands = obedient(tie, rng)
        assert coupling_excess(tie, stands) < 1e-9
        for off in (*np.eye(4) * 0.6, rng.normal(0.0, 0.2, 4)):
            moved = stands.copy()
            moved[1] += off
            rows = tie.rows(list(moved))
            values = np.array([float(value) for value in rows.values])
            outside = np.max(np.maximum(np.array(rows.lower) - values, values - np.array(rows.upper)))
            assert (coupling_excess(tie, moved) > 1e-6) == (outside > 1e-6)


def test_a_base_on_the_wrong_side_breaks_its_direction() -> None:
    assert coupling_excess(Direction((0, 1), 0.0), np.array([[0.0] * 4, [-1.0, 0.0, 0.0, 0.0]])) == pytest.approx(2.0)


def test_floors_are_read_as_the_models_read_them() -> None:
    scene = beam_pair(count=2)
    room = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 0.2], [0.2, 0.2], [0.2, 1.0], [-1.0, 1.0]])
    floor = Floor(room, (np.array([[-0.5, -0.5], [0.1, -0.4], [-0.2, 0.0]]),), 0.05)
    plates = [
        Footprint.rectangle(0.3, 0.15),
        Footprint.disc(0.2),
        Footprint.polygon([[0.0, 0.0], [0.3, 0.0], [0.1, 0.2]]),
    ]
    rng = np.random.default_rng(2)
    seen = set()
    for plate in plates:
        brings = {"arm 0": Brings(pedestal=Pedestal(0.3, plate))}
        around = replace(scene.surroundings, floor=floor, equipment=brings)
        cell = replace(scene.cell, surroundings=around)
        for stand in rng.uniform(-1.1, 1.1, (60, 4)):
            theirs = floor.signed_distance(stand[None, :2], plate, stand[3])[0]
            mine = floor_gap(cell, 0, stand)
            seen.add(mine > 0.0)
            assert (mine > 0.0) == (theirs > 0.0)
            if theirs > 0.0:
                assert mine == pytest.approx(theirs, abs=1e-9)
        own = replace(around, equipment={"arm 0": Brings(footprint=plate)})
        assert floor_gap(replace(cell, surroundings=own), 0, stand) == mine
    assert seen == {True, False}
    assert floor_gap(scene.cell, 0, np.zeros(4)) == np.inf


def test_regions_are_read_as_the_arm_reads_them() -> None:
    region = BaseRegion(Interval(0.0, 1.0), Interval(-1.0, 0.0), Interval(0.3, 0.3), Interval(2.5, 4.0))
    arm = replace(make_arm("ur5e"), base=region)
    assert region_excess(arm, np.array([0.5, -0.5, 0.3, 3.0 - 4.0 * np.pi])) == pytest.approx(0.0, abs=1e-12)
    assert region_excess(arm, np.array([1.2, -0.5, 0.3, 3.0])) == pytest.approx(0.2)
    assert region_excess(arm, np.array([0.5, -0.5, 0.2, 3.0])) == pytest.approx(0.1)
    for yaw in np.linspace(-7.0, 7.0, 41):
        assert region_excess(arm, np.array([0.5, -0.5, 0.3, yaw])) == pytest.approx(region.yaw_outside(yaw), abs=1e-9)
