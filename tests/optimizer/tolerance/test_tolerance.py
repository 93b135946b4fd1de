"""What installation errors leave: against numbers known by construction and against a dense second opinion."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, PairClass, Pedestal, Surroundings
from duocell.models.cell.task import Task, line
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.shapes import Body, Capsule, Sphere
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.link_frames import link_frames
from duocell.optimizer.clearance.clearance import check_clearance, found_clearances
from duocell.optimizer.clearance.path_samples import ObjectPath
from duocell.optimizer.nlp.measure import placed as place
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.findings import Clearance
from duocell.optimizer.results.placement import Placement
from duocell.optimizer.settings import Settings, ToleranceSettings
from duocell.optimizer.tolerance.tolerance import LARGEST, tolerance_of
from tests.support.given.arms import make_arm, region
from tests.support.given.cells import Scene, beam_pair
from tests.support.given.fields import ArmFields
from tests.support.given.solids import FLOOR
from tests.support.oracles.dense import _newton as newton
from tests.support.present import present

BENT = {
    "puma560": [0.2, -0.6, 2.2, 0.3, 0.9, 0.0],
    "ur10e": [0.0, -1.4, 1.5, -1.6, -1.5, 0.0],
    "kr6_r900": [0.2, -1.2, 1.3, 0.3, 0.9, 0.0],
    "iiwa14": [0.0, 0.5, 0.2, -1.5, 0.1, 1.0, 0.0],
}


def at_rest(robot: str, q: list[float] | None = None, **given: Unpack[ArmFields]) -> tuple[Cell, list[Placement]]:
    """An arm that holds a part still, its base at the origin of the world."""
    arm = make_arm(robot, **given)
    joints = np.array(BENT[robot] if q is None else q, dtype=float)
    hand = flange_poses(arm.robot, joints)[0] @ arm.tool
    cell = Cell(Task(np.tile(np.eye(4), (2, 1, 1))), (replace(arm, grasp=hand),))
    point = ArmSolution(np.zeros(3), 0.0, np.tile(joints, (2, 1)), None)
    return cell, [place(cell, cell.arms[0], point)]


def pair() -> tuple[Cell, list[Placement]]:
    """Two arms with a beam, grippers and pedestals on the floor, and a layout of them."""
    scene = beam_pair(count=4, shift=(0.2, 0.0, 0.05), clearances=Clearances(0.01, 0.01, 0.01, 0.01, None))
    cell = replace(scene.cell, surroundings=scene.surroundings)
    return cell, placed(cell, scene.bases, scene.joints)


def placed(cell: Cell, bases: Floats, joints: list[Floats]) -> list[Placement]:
    placements = []
    for arm, base, q in zip(cell.arms, bases, joints, strict=True):
        yaw = float(np.arctan2(base[1, 0], base[0, 0]))
        placements.append(place(cell, arm, ArmSolution(base[:3, 3], yaw, q, None)))
    return placements


@pytest.mark.parametrize("robot", list(BENT))
def test_tiny_errors_cost_what_the_sensitivity_says(robot: str) -> None:
    cell, placements = at_rest(robot)
    found = tolerance_of(cell, placements, (), ToleranceSettings(1e-5, 1e-5))
    before = placements[0].minimum_margin
    assert before - found.margin_by_sensitivity > 1e-6
    assert before - found.margin == pytest.approx(before - found.margin_by_sensitivity, rel=2e-3)
    assert found.feasible == 1.0
    assert found.clearances == {}


def test_a_yaw_error_is_taken_up_by_joint_1_alone() -> None:
    """Joint 1 turns about the vertical, so its margin shrinks by the angle, and the angle may grow to the margin."""
    q = np.array(BENT["puma560"])
    lower = make_arm("puma560").lower.copy()
    lower[0] = q[0] - 0.012
    cell, placements = at_rest("puma560", lower=lower)
    found = tolerance_of(cell, placements, (), ToleranceSettings(0.0, 0.004))
    assert found.margin == pytest.approx(0.008, abs=1e-9)
    assert found.margin_by_sensitivity == pytest.approx(0.008, abs=1e-6)
    assert found.largest == pytest.approx(3.0, rel=0.02)
    assert found.feasible == 1.0
    assert f"{cell.arms[0].robot.joint_names[0]} reaches its limit at pose" in found.note


@pytest.mark.parametrize(("direction", "worst"), [(0.0, 1.0), (np.pi / 4, np.sqrt(2.0))])
def test_a_pedestal_comes_nearer_to_a_post_by_the_error_towards_it(direction: float, worst: float) -> None:
    """Round pedestal, round post: their distance is that of the axes less the radii, whatever the yaw."""
    apart = 0.1 + 0.05 + 0.04
    post = Body(
        "post", transform(np.eye(3), [apart * np.cos(direction), apart * np.sin(direction), -0.35]), Capsule(0.05, 0.2)
    )
    around = Surroundings(
        obstacles=(post,),
        clearances=Clearances(arm_obstacle=0.01),
        equipment={"arm": Equipment(pedestal=Pedestal(0.6, Footprint.disc(0.1)))},
    )
    cell, placements = at_rest("ur10e")
    cell = replace(cell, surroundings=around)
    found = tolerance_of(cell, placements, (), ToleranceSettings(0.002, 0.0))
    assert found.clearances["arm_obstacle"] == pytest.approx(0.04 - 0.002 * worst, abs=1e-6)
    assert found.largest == pytest.approx(min(LARGEST, 0.03 / (0.002 * worst)), rel=0.02)
    much = tolerance_of(cell, placements, (), ToleranceSettings(0.02, 0.0))
    assert much.clearances["arm_obstacle"] == pytest.approx(0.04 - 0.02 * worst, abs=1e-6)
    assert much.largest == pytest.approx(0.03 / (0.02 * worst), rel=0.02)
    assert "pedestal" in much.note
    assert "post come nearer than 10 mm" in much.note


def test_the_floor_that_an_arm_is_bolted_to_is_never_in_its_way() -> None:
    cell, placements = pair()
    found = tolerance_of(cell, placements, (), ToleranceSettings(0.002, 0.0))
    assert FLOOR in cell.surroundings.obstacles
    assert found.feasible == 1.0
    assert found.largest > 3.0  # at which pedestals stick 6 mm into the floor, more than what counts as standing on it


def test_an_arm_that_is_all_but_stretched_cannot_follow_a_base_that_is_too_far_away() -> None:
    cell, placements = at_rest("ur10e", [0.0, -0.4, 0.05, 0.3, -1.2, 0.0])
    found = tolerance_of(cell, placements, (), ToleranceSettings(0.002, 0.0))
    assert 0.0 < found.feasible < 1.0
    assert 0.0 < found.largest < 1.0
    assert "cannot follow in its posture" in found.note


def test_conditioning_that_is_asked_for_counts() -> None:
    cell, placements = at_rest("ur10e")
    strict = replace(cell.arms[0], min_conditioning=placements[0].minimum_conditioning - 1e-5)
    found = tolerance_of(replace(cell, arms=(strict,)), placements, (), ToleranceSettings(0.002, 0.0))
    assert found.largest < 0.2
    assert "min_conditioning" in found.note


def test_a_joint_step_that_is_all_but_too_long_counts() -> None:
    cell, placements = pair()
    longest = max(float(np.max(np.abs(np.diff(p.joints, axis=0)))) for p in placements)
    tight = replace(cell, max_joint_step=longest + 1e-4)
    found = tolerance_of(tight, placements, (), ToleranceSettings(0.002, 0.0))
    assert found.largest < 0.5
    assert "too long a step" in found.note


def test_from_one_segment_to_the_next_a_joint_may_take_another_turn() -> None:
    cell, placements = at_rest("ur10e", [0.0, -1.4, 1.5, -1.6, -1.5, 0.5])
    turned = placements[0].joints + 2.0 * np.pi * np.array([[0, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, -1]])
    segments = replace(cell, task=Task(cell.task.poses, (0, 1)), max_joint_step=0.3)
    asked = ToleranceSettings(0.002, 0.0)
    found = tolerance_of(segments, [replace(placements[0], joints=turned)], (), asked)
    assert found.feasible == 1.0
    one_segment = replace(cell, max_joint_step=0.3)
    assert tolerance_of(one_segment, [replace(placements[0], joints=turned)], (), asked).feasible == 0.0


def least_margin(cell: Cell, placements: list[Placement], error: Floats) -> float:
    """What a layout with errors (A, 4) keeps of limits, steps and distances, by Pinocchio and Coal."""
    model = CollisionModel(cell.arms, cell.surroundings).bolted(
        np.stack([arm.base_in_world(p.position, p.yaw) for arm, p in zip(cell.arms, placements, strict=True)])
    )
    least, joints, bases = np.inf, [], []
    for arm, p, e in zip(cell.arms, placements, error, strict=True):
        bases.append(arm.base_in_world(p.position + e[:3], p.yaw + e[3]))
        targets = inverse(bases[-1]) @ cell.flange_targets(arm)
        q = np.array([newton(arm, target, start) for target, start in zip(targets, p.joints, strict=True)])
        assert np.max(np.abs(q - p.joints)) < 0.6
        joints.append(q)
        least = min(least, float(np.min(np.minimum(q - arm.lower, arm.upper - q))))
        least = min(least, cell.max_joint_step - float(np.max(np.abs(np.diff(q, axis=0)))))
    for k, pose in enumerate(cell.task.poses):
        for kind, contact in model.contacts(np.stack(bases), [q[k] for q in joints], pose).items():
            least = min(least, contact.distance - present(cell.surroundings.clearances.required(kind)))
    return least


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=4, deadline=None)
def test_no_error_inside_the_largest_tolerance_breaks_anything(seed: int) -> None:
    """Errors that nobody aimed, corners among them; a ball is 2 to 15 mm farther from an arm than it has to be."""
    rng = np.random.default_rng(seed)
    cell, placements = pair()
    frames = link_frames(cell.arms[0].robot, placements[0].joints[:1])[0]
    joint = (cell.arms[0].base_in_world(placements[0].position, placements[0].yaw) @ frames[rng.integers(2, 5)])[:3, 3]
    out = rng.normal(size=3)
    out /= np.linalg.norm(out)
    gap = nearest_ball(with_ball(cell, joint + 0.4 * out), placements)
    cell = with_ball(cell, joint + (0.4 - gap + 0.01 + rng.uniform(0.002, 0.015)) * out)
    assume(least_margin(cell, placements, np.zeros((2, 4))) > 1e-3)  # it may have come near to another link
    size = ToleranceSettings(rng.uniform(1e-3, 4e-3), rng.uniform(1e-3, 4e-3))
    found = tolerance_of(cell, placements, (), size)
    assert found.largest > 0.0
    largest = np.array([size.position] * 3 + [size.angle]) * found.largest
    for k in range(16):
        error = rng.uniform(-1.0, 1.0, (2, 4))
        error = np.sign(error) if k % 2 else error
        assert least_margin(cell, placements, error * largest) > -1e-6


def nearest_ball(cell: Cell, placements: list[Placement]) -> float:
    """Distance of the ball from the arms at the poses."""
    model = CollisionModel(cell.arms, cell.surroundings)
    bases = np.stack([arm.base_in_world(p.position, p.yaw) for arm, p in zip(cell.arms, placements, strict=True)])
    near = [
        contact.distance
        for k, pose in enumerate(cell.task.poses)
        for contact in model.near(bases, [p.joints[k] for p in placements], pose, {PairClass.ARM_OBSTACLE: 1.0})
        if contact.second == "ball"
    ]
    return min(near)


def test_between_the_poses_distances_count_too() -> None:
    """A ball where an elbow passes between two poses: it comes nearer there than at them."""
    scene = beam_pair(count=2, shift=(0.5, 0.0, 0.0), clearances=Clearances(arm_obstacle=0.006))
    middle, at_poses = elbows(scene)
    out = (middle - at_poses.mean(axis=0)) / np.linalg.norm(middle - at_poses.mean(axis=0))
    cell, placements = (
        replace(scene.cell, surroundings=scene.surroundings),
        placed(scene.cell, scene.bases, scene.joints),
    )
    far = with_ball(cell, middle + 0.3 * out)
    gap = gap_halfway(far, scene)
    cell = with_ball(cell, middle + (0.3 - gap + 0.005) * out)
    seen = optimum_clearances(cell, scene)
    assert seen[0].fraction not in (0.0, 1.0)
    assert least_margin(cell, placements, np.zeros((2, 4))) > 0.0035  # beyond what is required, at the poses
    found = tolerance_of(cell, placements, seen, ToleranceSettings(1e-3, 0.0))
    assert found.clearances["arm_obstacle"] < seen[0].distance < 0.0085
    assert 0.0 < found.largest < 3.0
    assert "link" in found.note
    assert "after pose 0" in found.note


def elbows(scene: Scene) -> tuple[Floats, Floats]:
    """Where the first arm's joint 3 is halfway between the two poses (3,), and at them (2, 3)."""
    arm, base = scene.cell.arms[0], scene.bases[0]
    q = np.vstack([scene.joints[0], halfway(scene)[0]])
    at = (base @ link_frames(arm.robot, q)[:, 3])[:, :3, 3]
    return at[2], at[:2]


def halfway(scene: Scene) -> list[Floats]:
    """Joints of all arms halfway between the two poses, by Newton's method."""
    pose = ObjectPath(scene.cell.task.poses).at(np.array([0]), np.array([0.5]))[0]
    found = []
    for arm, base, q in zip(scene.cell.arms, scene.bases, scene.joints, strict=True):
        found.append(newton(arm, inverse(base) @ pose @ arm.grasp @ inverse(arm.tool), q.mean(axis=0)))
    return found


def with_ball(cell: Cell, centre: Floats) -> Cell:
    ball = Body("ball", transform(np.eye(3), centre), Sphere(0.02))
    return replace(cell, surroundings=replace(cell.surroundings, obstacles=(FLOOR, ball)))


def gap_halfway(cell: Cell, scene: Scene) -> float:
    """Distance of the ball from the arms halfway."""
    pose = ObjectPath(cell.task.poses).at(np.array([0]), np.array([0.5]))[0]
    near = CollisionModel(cell.arms, cell.surroundings).near(
        scene.bases, halfway(scene), pose, {PairClass.ARM_OBSTACLE: 1.0}
    )
    return min(contact.distance for contact in near if contact.second == "ball")


def optimum_clearances(cell: Cell, scene: Scene) -> tuple[Clearance, ...]:
    model = CollisionModel(cell.arms, cell.surroundings)
    return found_clearances(check_clearance(cell, model, cell.surroundings.clearances, scene.bases, scene.joints))


def test_an_uncoupled_layout_gets_its_tolerance() -> None:
    start, end = (transform(np.eye(3), [x, 0.55, 0.2]) for x in (-0.15, 0.15))
    arm = make_arm("puma560", base=region((-0.5, 0.5), (-0.5, 0.5)))
    cell = Cell(line(start, end, 6), (arm,))
    layout = optimize(cell, Settings(tolerance=ToleranceSettings()))
    found = layout.tolerance
    assert found is not None
    assert found.samples > 40
    assert layout.placements[0].minimum_margin - 0.1 < found.margin < layout.placements[0].minimum_margin
    assert optimize(cell).tolerance is None


def test_it_is_quick() -> None:
    cell, placements = pair()
    cell = replace(cell, task=Task(np.repeat(cell.task.poses, 4, axis=0)))
    placements = [replace(p, joints=np.repeat(p.joints, 4, axis=0)) for p in placements]
    began = time.process_time()
    tolerance_of(cell, placements, (), ToleranceSettings())
    assert time.process_time() - began < 2.0
