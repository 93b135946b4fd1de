"""Task sequences: one base and one posture for several segments, weighed against each other; nothing else ties the
segments.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_x, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task, line
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Interval
from duocell.optimizer.baselines.gradient import PostureFunction
from duocell.optimizer.baselines.penalty import minimise_from, nearest_posture
from duocell.optimizer.baselines.penalty_rows import ConstrainedPosture, exterior
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import CertificateSettings, Settings
from tests.support.given.arms import make_arm, region
from tests.support.given.task_sequences import possible_task_sequence
from tests.support.given.tasks import possible
from tests.support.given.thesis import CELLS, MAIN_GRASP, UP_LEFT
from tests.support.oracles.answers import assert_sound
from tests.support.oracles.brute import brute_force, cost_at
from tests.support.present import present

LINE = CELLS["line"]
HERE = np.eye(3)


def solved(cell: Cell, settings: Settings | None = None) -> Layout:
    layout = optimize(cell, settings)
    assert_sound(cell, layout)
    return layout


def lines(*weights: float) -> Cell:
    """A PUMA that carries a part along two lines which want its base in different places."""
    ways = [
        line(transform(rotation_z(turn), start), transform(rotation_z(turn), end), 3)
        for turn, start, end in ((-0.8, [0.7, 0.3, 0.1], [1.0, 0.6, 0.1]), (-0.3, [0.7, 0.7, 0.0], [0.5, 0.6, 0.3]))
    ]
    arm = make_arm("puma560", base=region((-0.4, 1.4), (-0.4, 1.4)), grasp=MAIN_GRASP, reference=UP_LEFT)
    task = task_sequence(
        [TaskSegment(f"line {k}", way, weight) for k, (way, weight) in enumerate(zip(ways, weights, strict=True))]
    )
    return Cell(task, (arm,))


def moved(cell: Cell, shift: list[float] | float, turn: Floats = HERE) -> Cell:
    """The second segment shifted, its part turned."""
    poses = cell.task.poses.copy()
    poses[3:, :3, 3] += shift
    poses[3:, :3, :3] = poses[3:, :3, :3] @ turn
    return replace(cell, task=replace(cell.task, poses=poses))


# --- what task sequences have to do with plain tasks ------------------------------------------------------------------


def test_a_task_sequence_of_one_segment_is_the_plain_task() -> None:
    proof = Settings(certificate=CertificateSettings(0.01, 60.0))
    plain = solved(LINE, proof)
    one = solved(replace(LINE, task=task_sequence([TaskSegment("", LINE.task)])), proof)
    assert one.objective == plain.objective
    for have, want in zip(one.placements, plain.placements, strict=True):
        assert np.array_equal(have.joints, want.joints)
        assert np.array_equal(have.position, want.position)
    assert present(one.certificate).lower_bound == present(plain.certificate).lower_bound
    assert present(one.certificate).boxes == present(plain.certificate).boxes


def test_a_segment_done_twice_doubles_the_cost_and_keeps_the_base() -> None:
    proof = Settings(certificate=CertificateSettings(1e-3, 60.0))
    plain = solved(LINE, proof)
    twice = solved(replace(LINE, task=task_sequence([TaskSegment("a", LINE.task), TaskSegment("b", LINE.task)])), proof)
    assert twice.objective == pytest.approx(2.0 * present(plain.objective), rel=1e-7)
    assert [segment.objective for segment in twice.segments] == pytest.approx([plain.objective] * 2, rel=1e-7)
    for have, want in zip(twice.placements, plain.placements, strict=True):
        assert have.position == pytest.approx(want.position, abs=1e-5)
        assert have.yaw == pytest.approx(want.yaw, abs=1e-5)
        assert have.joints == pytest.approx(np.tile(want.joints, (2, 1)), abs=1e-5)
    assert present(twice.certificate).proved
    assert present(twice.certificate).lower_bound == pytest.approx(
        2.0 * present(present(plain.certificate).lower_bound), rel=2e-3
    )


def test_weights_scale_the_objective() -> None:
    light, heavy = solved(lines(1.0, 0.5)), solved(lines(1000.0, 500.0))
    assert heavy.objective == pytest.approx(1000.0 * present(light.objective), rel=1e-6)
    assert heavy.placements[0].position == pytest.approx(light.placements[0].position, abs=1e-5)


# --- what the weights do ----------------------------------------------------------------------------------------------


def test_weights_draw_the_base_to_the_segment_that_counts_and_nothing_is_better() -> None:
    """Against a grid of bases whose branches, turns and yaws are tried one by one."""
    found = {}
    for weights in ((1.0, 1.0), (20.0, 1.0), (1.0, 20.0)):
        cell = lines(*weights)
        layout = solved(cell, Settings(certificate=CertificateSettings(0.01, 60.0)))
        assert present(layout.certificate).proved
        best = brute_force(cell, cell.arms[0], (11, 11, 1))
        assert layout.objective == pytest.approx(best, rel=1e-4)
        assert present(present(layout.certificate).lower_bound) <= best * (1.0 + 1e-9)
        found[weights] = layout
    shares = {
        weights: [present(segment.objective) / segment.weight for segment in layout.segments]
        for weights, layout in found.items()
    }
    for k, weights in enumerate(((20.0, 1.0), (1.0, 20.0))):
        assert shares[weights][k] < 0.98 * shares[1.0, 1.0][k]
        assert shares[weights][1 - k] > 1.02 * shares[1.0, 1.0][1 - k]


def test_a_segment_that_counts_for_nothing_still_has_to_be_possible() -> None:
    cell = lines(1.0, 0.0)
    alone = optimize(cell.alone(0))
    both = solved(cell)
    assert both.segments[1].objective == 0.0
    assert present(both.objective) >= present(alone.objective) * (1.0 - 1e-9)
    assert optimize(moved(cell, [9.0, 0.0, 0.0])).outcome is Outcome.INFEASIBLE


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900"])
def test_the_reduced_problem_is_the_best_of_all_turns_and_yaws(name: str) -> None:
    """Limits, weights and yaws of all sorts; several places around the witness."""
    for seed in range(6):
        rng = np.random.default_rng(seed)
        yaw = (np.pi, 0.4, 0.0)[seed % 3]
        task = possible_task_sequence(
            name, rng, (1.0, 0.3, 2.0)[: 2 + seed % 2], poses=3, half=(0.3, 0.3, 0.0, yaw), tight=(None, 1.5)[seed % 2]
        )
        places = np.concatenate([task.position[None], task.position + rng.uniform(-0.1, 0.1, (5, 3)) * [1, 1, 0]])
        problem = present(reduced_problem(task.cell, task.arm))
        paths = evaluate(problem, places)
        best = np.min(np.where(paths.violation == 0.0, paths.objective, np.inf), axis=0)
        for place, have in zip(places, best, strict=True):
            want = cost_at(task.cell, task.arm, place)
            assert have == pytest.approx(want, rel=1e-6) or (np.isinf(have) and want > 1e8)
        assert np.isfinite(best[0])


# --- what may differ between segments, and what may not ---------------------------------------------------------------


def test_segments_may_lie_on_different_turns() -> None:
    """Both ways are the same but for a whole turn of joint 6, which the limits force upon the second segment's
    grasp.
    """
    task = possible("ur10e", np.random.default_rng(4), poses=4, half=(0.2, 0.2, 0.0, np.pi))
    arm = replace(task.arm, reference=task.joints.mean(axis=0))
    turned = task.cell.task.poses.copy()
    turned[:, :3, :3] = turned[:, :3, :3] @ rotation_z(3.0)
    cell = replace(
        task.cell, task=task_sequence([TaskSegment("a", task.cell.task), TaskSegment("b", Task(turned))]), arms=(arm,)
    )
    layout = solved(cell)
    jump = layout.placements[0].joints[4] - layout.placements[0].joints[3]
    assert np.abs(jump).max() > cell.max_joint_step  # which no step within a segment may be


def test_a_long_way_from_segment_to_segment_is_no_step() -> None:
    task = possible_task_sequence("puma560", np.random.default_rng(3), half=(0.05, 0.05, 0.0, np.pi))
    joints = solved(task.cell).placements[0].joints
    inside = max(np.abs(np.diff(joints[segment], axis=0)).max() for segment in task.cell.task.segments)
    between = np.abs(joints[4] - joints[3]).max()
    assert inside < between
    tight = replace(task.cell, max_joint_step=0.98 * inside)
    layout = optimize(tight)
    if layout.usable:
        assert_sound(tight, layout)
    plain = replace(task.cell, task=Task(task.cell.task.poses), max_joint_step=1.02 * inside)
    assert not optimize(plain).usable or between <= 1.02 * inside


def test_an_arm_keeps_its_posture_in_all_segments() -> None:
    """Each segment is possible in one posture only, by the limits of joint 5, and not in the same one."""
    arm = make_arm("puma560", base=region(0.0, 0.0, 0.0, 0.0))
    up = np.array([0.1, -0.6, 2.4, 0.3, 0.5, 0.1])
    down = np.array([0.1, -0.6, 2.4, 0.3, -0.5, 0.1])
    tasks = [Task(flange_poses(arm.robot, np.array([q, q + 0.02]))) for q in (up, down)]
    narrow = replace(arm, lower=np.minimum(up, down) - 0.1, upper=np.maximum(up, down) + 0.1)
    narrow = replace(narrow, reference=0.5 * (narrow.lower + narrow.upper))
    for task in tasks:
        assert optimize(Cell(task, (narrow,))).outcome is Outcome.OPTIMAL
    layout = optimize(Cell(task_sequence([TaskSegment("up", tasks[0]), TaskSegment("down", tasks[1])]), (narrow,)))
    assert layout.outcome is Outcome.INFEASIBLE
    assert {reason.kind for reason in layout.reasons} >= {"jobs"}


def test_grasps_of_segments_are_where_the_hand_goes() -> None:
    """A part that is turned about, gripped where it was before, is the same to the arm."""
    cell = lines(1.0, 2.0)
    turn = transform(rotation_x(0.7) @ rotation_z(1.0), [0.1, -0.2, 0.05])
    poses = cell.task.poses.copy()
    poses[3:] = poses[3:] @ turn
    arm = cell.arms[0]
    own = replace(arm, grasps=np.array([arm.grasp, inverse(turn) @ arm.grasp]))
    regripped = replace(cell, task=replace(cell.task, poses=poses), arms=(own,))
    assert np.allclose(regripped.flange_targets(own), cell.flange_targets(arm), rtol=0.0, atol=1e-12)
    one, other = solved(cell), solved(regripped)
    assert other.objective == pytest.approx(one.objective, rel=1e-9)
    assert other.placements[0].position == pytest.approx(one.placements[0].position, abs=1e-6)
    wrong = replace(cell, task=replace(cell.task, poses=poses))
    assert optimize(wrong).objective != pytest.approx(one.objective, rel=1e-3)


# --- arms without a reduced problem, baselines ------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["iiwa14", "fanuc_crx10ia", "yumi_left"])
def test_arms_without_a_reduced_problem_do_several_segments(name: str) -> None:
    task = possible_task_sequence(name, np.random.default_rng(1), (1.0, 2.0), half=(0.1, 0.1, 0.0, 0.5))
    layout = solved(task.cell)
    witness = task.cell.task.weights @ (task.arm.weights * (task.joints - task.arm.reference) ** 2)
    assert present(layout.objective) <= 1.05 * float(np.sum(witness))


def test_a_tilted_arm_with_postures_keeps_one_in_all_segments() -> None:
    mount = rotation_x(0.4)
    task = possible_task_sequence("ur5e", np.random.default_rng(2), half=(0.05, 0.05, 0.0, 0.3), mount=mount)
    solved(task.cell)


def test_penalty_methods_know_segments_and_weights() -> None:
    cell = lines(1.0, 3.0)
    problem = present(reduced_problem(cell, cell.arms[0]))
    best = solved(cell).placements[0]
    start = np.array([*(best.position + 0.02 * np.array([1.0, -1.0, 0.0])), best.yaw + 0.05])
    run = minimise_from(problem, start, None, "interior-penalty")
    assert run.feasible
    assert run.objective == pytest.approx(best.objective, rel=1e-3)
    assert present(run.objective) >= best.objective * (1.0 - 1e-6)


def test_gradients_of_penalty_methods_know_segments_and_weights() -> None:
    cell = lines(0.5, 3.0)
    problem = present(reduced_problem(cell, cell.arms[0]))
    best = solved(cell).placements[0]
    start = np.array([*best.position, best.yaw])
    constrained = ConstrainedPosture(PostureFunction(problem, present(nearest_posture(problem, start))))
    path = present(constrained.function.begin(start))
    penalty = exterior(3.0, 0.5)  # with a margin that all limits and steps break
    point = present(constrained.at(path, penalty))
    assert len(constrained.rows(path)) == 2 * 6 * 6 + 2 * 4 * 6 + 3 * 6 + 4  # no step from segment to segment
    for i, unit in enumerate(np.eye(len(point.x))):
        ahead, behind = (
            present(constrained.step(point.x + sign * 1e-6 * unit, path, penalty)).value for sign in (1.0, -1.0)
        )
        assert point.gradient[i] == pytest.approx((ahead - behind) / 2e-6, rel=1e-5, abs=1e-4)


# --- impossible task sequences ----------------------------------------------------------------------------------------


def test_the_segment_that_is_out_of_reach_is_named() -> None:
    layout = optimize(moved(lines(1.0, 1.0), [9.0, 0.0, 0.0]))
    assert layout.outcome is Outcome.INFEASIBLE
    assert layout.proved
    assert [segment.objective for segment in layout.segments] == [None, None]
    for reason in layout.reasons:
        assert reason.kind == "out_of_reach"
        assert set(reason.poses) <= {3, 4, 5}
        assert "line 1" in reason.detail
        assert "line 0" not in reason.detail


def test_the_segment_that_breaks_a_joint_limit_is_named() -> None:
    """Half a metre above the shoulder a tool can point up but not down: joint 5 would have to fold back too far."""
    cell = lines(1.0, 1.0)
    poses = transform(np.eye(3), cell.task.poses[:, :3, 3] + [0.0, 0.0, 0.4])
    cell = replace(cell, task=replace(cell.task, poses=poses), arms=(replace(cell.arms[0], grasp=np.eye(4)),))
    assert optimize(cell).usable
    down = moved(cell, 0.0, rotation_x(np.pi))
    assert [optimize(down.alone(k)).usable for k in (0, 1)] == [True, False]
    layout = optimize(down)
    assert layout.outcome is Outcome.INFEASIBLE
    first = layout.reasons[0]
    assert first.kind == "joint_limit"
    assert first.poses
    assert set(first.poses) <= {3, 4, 5}
    assert first.detail.endswith("[job line 1]")


def test_segments_too_far_apart_for_one_base_say_so() -> None:
    cell = lines(1.0, 1.0)
    wide = Interval(-3.0, 4.0)
    arm = replace(cell.arms[0], base=replace(cell.arms[0].base, x=wide, y=wide))
    apart = moved(replace(cell, arms=(arm,)), [1.45, 0.75, 0.0])
    assert all(optimize(apart.alone(k)).outcome is Outcome.OPTIMAL for k in (0, 1))
    layout = optimize(apart)
    assert layout.outcome is Outcome.INFEASIBLE
    assert layout.reasons[0].kind == "jobs"
    assert "by itself" in layout.reasons[0].detail
