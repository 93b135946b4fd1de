"""Given layouts: the score is the optimizer's, the faults are those that stand there, told with place and amount."""

from __future__ import annotations

import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, SameHeight
from duocell.models.cell.coupling.direction import APART
from duocell.models.cell.floor import Floor, Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, PairClass, Surroundings
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import BaseRegion, Interval
from duocell.models.robot.posture import Posture
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate
from tests.support.given.cells import Scene, beam_pair, holding, random_obstacles
from tests.support.given.tasks import possible
from tests.support.oracles.answers import assert_placed
from tests.support.oracles.dense import dense_minima
from tests.support.present import present

EXAMPLES = Path(__file__).parents[3] / "examples"


def at(cell: Cell, places: list[tuple[float, float, float, float]]) -> Cell:
    """The cell with its bases fixed at (x, y, z, yaw)."""
    arms = []
    for arm, place in zip(cell.arms, places, strict=True):
        intervals = [Interval(float(value), float(value)) for value in place]
        arms.append(replace(arm, base=BaseRegion(*intervals)))
    return replace(cell, arms=tuple(arms))


def as_laid_out(cell: Cell, layout: Layout) -> Cell:
    return at(cell, [(*p.position, p.yaw) for p in layout.placements])


def of_scene(scene: Scene) -> Cell:
    """The cell of a scene, everything in it, its bases fixed."""
    places = [(*base[:3, 3], np.arctan2(base[1, 0], base[0, 0])) for base in scene.bases]
    return at(replace(scene.cell, surroundings=scene.surroundings), places)


def kinds(layout: Layout) -> list[str]:
    return [reason.kind for reason in layout.reasons]


# --- the score --------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["line", "arc", "beam_ur10e"])
def test_a_solved_layout_is_worth_what_the_optimizer_says(name: str) -> None:
    cell = cell_of(validate(LayoutRequest, json.loads((EXAMPLES / f"{name}.json").read_text())))
    best = optimize(cell)
    fixed = as_laid_out(cell, best)
    for joints in (None, [p.joints for p in best.placements]):
        found = evaluate_layout(fixed, joints)
        assert found.outcome is Outcome.FEASIBLE
        assert found.reasons == ()
        assert found.objective == pytest.approx(best.objective, rel=1e-9)
        assert present(found.verification).limits_respected
        for mine, theirs in zip(found.placements, best.placements, strict=True):
            assert mine.joints == pytest.approx(theirs.joints, abs=1e-6)
            assert mine.posture == theirs.posture
            assert mine.minimum_margin == pytest.approx(theirs.minimum_margin, abs=1e-6)
            assert mine.geometry == theirs.geometry


@pytest.mark.parametrize("robot", ["puma560", "ur10e", "kr6_r900", "yumi_left", "iiwa14"])
def test_a_place_where_the_task_is_possible_is_feasible_and_no_worse_than_the_witness(robot: str) -> None:
    task = possible(robot, np.random.default_rng(3), poses=4, step=0.08)
    cell = at(task.cell, [(*task.position, task.yaw)])
    found = evaluate_layout(cell)
    assert found.outcome is Outcome.FEASIBLE, [reason.detail for reason in found.reasons]
    (placement,) = found.placements
    assert_placed(cell, cell.arms[0], placement)
    witness = float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2))
    if task.arm.dof == 6:  # a redundant arm's way is a local optimum
        assert present(found.objective) <= witness * (1.0 + 1e-9)
    given = evaluate_layout(cell, [task.joints])
    assert given.outcome is Outcome.FEASIBLE
    assert given.objective == pytest.approx(witness)


def test_a_redundant_arm_is_searched_where_the_samples_of_its_freedom_lead_nowhere() -> None:
    task = possible("iiwa14", np.random.default_rng(5), poses=16, step=0.05)
    found = evaluate_layout(at(task.cell, [(*task.position, task.yaw)]))
    assert found.outcome is Outcome.FEASIBLE
    assert found.search.candidates > 2
    far = evaluate_layout(at(task.cell, [(9.0, 9.0, 9.0, 0.0)]))
    assert kinds(far) == ["out_of_reach"]


@pytest.mark.parametrize("robot", ["puma560", "ur5e"])
@pytest.mark.parametrize("roll", [0.7, np.pi])
def test_a_leaning_or_hanging_arm(robot: str, roll: float) -> None:
    tilt = np.array([[1, 0, 0], [0, np.cos(roll), -np.sin(roll)], [0, np.sin(roll), np.cos(roll)]])
    task = possible(robot, np.random.default_rng(5), poses=4, step=0.08, mount=tilt)
    found = evaluate_layout(at(task.cell, [(*task.position, task.yaw)]))
    assert found.outcome is Outcome.FEASIBLE
    assert_placed(task.cell, task.arm, found.placements[0])
    assert np.array_equal(found.placements[0].mount, tilt)


def test_bases_that_are_not_fixed_are_refused() -> None:
    task = possible("ur5e", np.random.default_rng(0))
    with pytest.raises(ValueError, match="fixed"):
        evaluate_layout(task.cell)


# --- what an arm breaks -----------------------------------------------------------------------------------------------


def test_out_of_reach_says_how_much_is_missing() -> None:
    task = possible("ur5e", np.random.default_rng(0), poses=4)
    away = np.array([5.0, 0.0, 0.0])
    found = evaluate_layout(at(task.cell, [(*(task.position + away), task.yaw)]))
    assert found.outcome is Outcome.INFEASIBLE
    assert found.placements == ()
    assert found.objective is None
    (reason,) = found.reasons
    assert reason.kind == "out_of_reach"
    assert reason.poses == (0, 1, 2, 3)
    assert 3.0 < present(reason.amount) < 5.0


@pytest.mark.parametrize("robot", ["ur5e", "yumi_left"])
def test_a_limit_that_is_broken_is_named_with_its_amount(robot: str) -> None:
    task = possible(robot, np.random.default_rng(1), poses=4, step=0.08)
    upper = task.arm.upper.copy()
    upper[2] = task.joints[:, 2].max() - 0.05
    arm = replace(task.arm, upper=upper, posture=task.arm.posture)
    cell = at(replace(task.cell, arms=(arm,)), [(*task.position, task.yaw)])
    found = evaluate_layout(cell, [task.joints])
    assert found.outcome is Outcome.INFEASIBLE
    (reason,) = found.reasons
    assert reason.kind == "joint_limit"
    assert reason.joint == arm.robot.joint_names[2]
    assert reason.amount == pytest.approx(0.05)
    assert found.placements[0].minimum_margin == pytest.approx(-0.05)


def test_joints_that_miss_their_poses_leap_or_change_posture_are_told() -> None:
    task = possible("ur5e", np.random.default_rng(2), poses=4, step=0.05)
    cell = at(task.cell, [(*task.position, task.yaw)])
    off = task.joints + 1e-3
    found = evaluate_layout(cell, [off])
    assert set(kinds(found)) == {"pose_error"}
    assert {reason.unit for reason in found.reasons} == {"m", "rad"}
    assert present(found.verification).max_position_error == max(
        present(r.amount) for r in found.reasons if r.unit == "m"
    )
    leap = task.joints.copy()
    leap[2:, 5] += 2.0 * np.pi * (1.0 if leap[2, 5] < 0.0 else -1.0)
    (reason,) = evaluate_layout(cell, [leap]).reasons
    assert (reason.kind, reason.poses) == ("joint_step", (2,))
    kept = present(evaluate_layout(cell).placements[0].posture)
    other = Posture(elbow=-1 if kept["elbow"] == "down" else 1)
    wrong = replace(cell, arms=(replace(cell.arms[0], posture=other),))
    assert "posture" in kinds(evaluate_layout(wrong, [evaluate_layout(cell).placements[0].joints]))


def test_conditioning_is_asked_of_every_posture_before_it_is_a_fault() -> None:
    task = possible("ur5e", np.random.default_rng(4), poses=4, step=0.08)
    cell = at(task.cell, [(*task.position, task.yaw)])
    best = evaluate_layout(cell).placements[0].minimum_conditioning
    asked = replace(cell, arms=(replace(cell.arms[0], min_conditioning=0.9 * best),))
    assert evaluate_layout(asked).outcome is Outcome.FEASIBLE
    asked = replace(cell, arms=(replace(cell.arms[0], min_conditioning=0.9),))
    found = evaluate_layout(asked)
    assert kinds(found) == ["conditioning"]
    assert found.reasons[0].amount == pytest.approx(0.9 - found.placements[0].minimum_conditioning, abs=1e-9)


# --- floor and couplings ----------------------------------------------------------------------------------------------


@pytest.mark.parametrize("footprint", [None, Footprint.rectangle(0.4, 0.2)])
def test_floor_that_is_not_free(footprint: Footprint | None) -> None:
    task = possible("ur5e", np.random.default_rng(0), poses=3)
    x, y, z = task.position
    pit = np.array([[x + 0.1, y - 1.0], [x + 1.0, y - 1.0], [x + 1.0, y + 1.0], [x + 0.1, y + 1.0]])
    around = Surroundings(
        floor=Floor(forbidden=(pit,), margin=0.15), equipment={task.arm.name: Equipment(footprint=footprint)}
    )
    found = evaluate_layout(at(replace(task.cell, surroundings=around), [(x, y, z, task.yaw)]))
    (reason,) = found.reasons
    assert (reason.kind, reason.arm, reason.unit) == ("floor", task.arm.name, "m")
    reach = 0.0 if footprint is None else 0.2 * abs(np.cos(task.yaw)) + 0.1 * abs(np.sin(task.yaw))
    assert reason.amount == pytest.approx(0.15 + reach - 0.1)
    moved = at(replace(task.cell, surroundings=around), [(x - reason.amount - 1e-9, y, z, task.yaw)])
    assert "floor" not in kinds(evaluate_layout(moved))


@pytest.mark.parametrize(
    ("coupling", "amount", "unit"),
    [
        (SameHeight((0, 1)), 0.1, "m"),
        (Distance((0, 1), minimum=1.5), 0.3, "m"),
        (Distance((0, 1), maximum=1.0), 0.2, "m"),
        (Direction((0, 1), angle=np.pi), 1.2 + APART, "m"),
        (Rail((0, 1), angle=np.pi / 2), 1.2, "m"),
        (Mirror((0, 1), (0.0, 0.0), np.pi / 2), 2.0 * np.sin(0.15), "rad"),
    ],
)
def test_couplings_that_are_not_kept(coupling: Coupling, amount: float, unit: str) -> None:
    cell = replace(beam_pair().cell, couplings=(coupling,))
    found = evaluate_layout(at(cell, [(-0.6, 0.0, 0.3, np.pi / 2 + 0.3), (0.6, 0.0, 0.4, np.pi / 2)]))
    told = [r for r in found.reasons if r.kind == "coupling" and r.unit == unit]
    assert max(present(reason.amount) for reason in told) == pytest.approx(amount, abs=1e-6)
    assert "arm 0 and arm 1" in told[0].detail
    kept = evaluate_layout(
        at(replace(cell, couplings=(Distance((0, 1), 1.0, 2.0),)), [(-0.6, 0, 0.3, 1.5), (0.6, 0, 0.3, 1.5)])
    )
    assert "coupling" not in kinds(kept)


# --- clearances -------------------------------------------------------------------------------------------------------


def test_a_known_collision_is_told_with_pair_pose_and_depth() -> None:
    """A post where the beam's end passes at pose 2, and nothing else in the way."""
    bare = beam_pair(count=4, shift=(0.3, 0.0, 0.0), clearances=Clearances(part_obstacle=0.01))
    tip = (bare.cell.task.poses[2] @ [0.55, 0.0, 0.0, 1.0])[:3]
    post = Body("post", transform(np.eye(3), tip), Box(np.array([0.02, 0.02, 0.5])))
    scene = replace(bare, surroundings=replace(bare.surroundings, obstacles=(post,)))
    cell = of_scene(scene)
    found = evaluate_layout(cell)
    (reason,) = found.reasons
    assert (reason.kind, reason.arm, reason.unit) == ("collision", "", "m")
    (clearance,) = found.clearances
    assert (clearance.first, clearance.second) == ("beam", "post")
    by_coal = [
        separation(present(scene.surroundings.part).bodies[0].shape, pose, post.shape, post.pose).distance
        for pose in cell.task.poses
    ]
    assert int(np.argmin(by_coal)) == 2
    assert clearance.distance <= min(by_coal) + 1e-9
    assert clearance.distance == pytest.approx(min(by_coal), abs=5e-3)  # deeper between the poses, by a little
    assert reason.amount == pytest.approx(0.01 - clearance.distance)
    assert 2 in reason.poses
    assert "beam and post penetrate" in reason.detail


def test_clearances_are_those_of_a_direct_and_of_a_dense_check() -> None:
    scene = beam_pair(count=5, obstacles=random_obstacles(np.random.default_rng(1), 5, [-2, -2, 0.2], [2, -1, 1.5]))
    cell = of_scene(scene)
    found = evaluate_layout(cell, scene.joints)
    assert {c.kind for c in found.clearances} == {str(kind) for kind in PairClass}
    dense = dense_minima(scene, CollisionModel(cell.arms, cell.surroundings), 20)
    for clearance in found.clearances:
        assert present(clearance.lower_bound) - 1e-6 <= dense[clearance.kind] <= clearance.distance + 0.02
    blocked = [c.kind for c in found.clearances if c.distance < c.required]
    assert [r.kind for r in found.reasons] == ["collision"] * len(blocked)


def test_arms_that_hit_each_other_at_a_pose_are_told_by_their_links() -> None:
    """Both hold the part at the same place."""
    q = np.array([0.0, -1.4, 1.5, -1.6, -1.5, 0.0])
    bases = [transform(rotation_z(0.0), [0.0, y, 0.4]) for y in (0.0, 0.05)]
    hand = np.eye(4)
    scene = holding(["ur5e"] * 2, bases, [q, q], np.array([hand, hand]), clearances=Clearances(arm_arm=0.02))
    found = evaluate_layout(of_scene(scene), scene.joints)
    (reason,) = found.reasons
    assert reason.kind == "collision"
    assert reason.arm == "arm 0"
    (clearance,) = found.clearances
    model = CollisionModel(scene.cell.arms, scene.surroundings)
    direct = model.contacts(scene.bases, [joints[0] for joints in scene.joints], hand)[PairClass.ARM_ARM]
    assert clearance.distance == pytest.approx(direct.distance, abs=1e-9)
    assert (clearance.first, clearance.second) == (direct.first, direct.second)
    assert clearance.first.startswith("arm 0 ")


def test_the_way_between_the_poses_must_be_possible_too() -> None:
    """From one side of the base to the other: the straight way leads through the arm itself."""
    q = np.array([0.0, -1.4, 1.5, -1.6, -1.5, 0.0])
    task = possible("ur5e", np.random.default_rng(0), poses=2)
    arm, base = task.arm, task.arm.base_in_world(np.zeros(3), 0.0)
    joints = np.stack([q, q + 3.0 * np.eye(6)[0]])
    poses = base @ flange_poses(arm.robot, joints) @ arm.tool @ np.linalg.inv(arm.grasp)
    cell = replace(
        task.cell,
        task=replace(task.cell.task, poses=poses),
        max_joint_step=np.pi,
        surroundings=Surroundings(clearances=Clearances(self_collision=0.0)),
    )
    found = evaluate_layout(at(cell, [(0.0, 0.0, 0.0, 0.0)]), [joints])
    assert "joint_step" in kinds(found)
    assert any("cannot follow the part between poses 0 and 1" in reason.detail for reason in found.reasons)


def test_without_clearances_nothing_is_looked_at() -> None:
    scene = beam_pair(clearances=Clearances())
    found = evaluate_layout(of_scene(scene), scene.joints)
    assert found.outcome is Outcome.FEASIBLE
    assert found.clearances == ()


def test_an_arm_without_a_path_leaves_the_others_and_the_floor_to_be_judged() -> None:
    scene = beam_pair()
    around = replace(scene.surroundings, floor=Floor(forbidden=(np.array([[-9, -9], [9, -9], [9, 9], [-9, 9.0]]),)))
    cell = at(replace(scene.cell, surroundings=around), [(-0.6, 0.0, 0.3, np.pi / 2), (9.0, 0.0, 0.3, 0.0)])
    found = evaluate_layout(cell)
    assert [p.arm for p in found.placements] == ["arm 0"]
    assert "arm_arm" not in {entry.kind for entry in found.clearances}
    assert kinds(found) == ["out_of_reach", "floor", "floor"]
    box = Body("box", transform(np.eye(3), [-0.6, 0.0, 0.6]), Box(np.array([0.5, 0.5, 0.4])))
    hit = evaluate_layout(replace(cell, surroundings=replace(around, obstacles=(*around.obstacles, box))))
    assert kinds(hit) == ["out_of_reach", "floor", "floor", "collision"]
    assert "box" in hit.reasons[-1].detail


def test_the_time_is_that_of_a_page_that_follows_a_drag() -> None:
    """Two arms, 16 poses, a beam, four boxes: below 50 ms on an idle machine; the tenfold is allowed on a busy one."""
    boxes = tuple(
        Body(f"box {i}", transform(np.eye(3), place), Box(np.array(size)))
        for i, (place, size) in enumerate(
            [
                ([0.0, 1.3, 0.3], [0.6, 0.4, 0.6]),
                ([0.9, 1.3, 0.3], [0.4, 0.4, 0.6]),
                ([0.0, -0.6, 0.4], [1.5, 0.2, 0.8]),
                ([-1.2, 0.5, 0.3], [0.3, 0.6, 0.6]),
            ]
        )
    )
    cell = of_scene(beam_pair(count=16, obstacles=boxes))
    times = []
    for _ in range(5):
        started = time.process_time()
        evaluate_layout(cell)
        times.append(time.process_time() - started)
    assert min(times) < 0.5
