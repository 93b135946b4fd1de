from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from itertools import count, pairwise
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_y, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task, line
from duocell.models.kinematics.kinematics import characteristic_length, conditioning
from duocell.models.robot.arm import Arm, BaseRegion, Interval
from duocell.models.robot.posture import ALL_SIGNS, Posture
from duocell.optimizer.certificate.certify import BranchAndBound, certify
from duocell.optimizer.reduction.reduced import (
    ReducedProblem,
    conditioning_shortfall,
    evaluate,
    evaluate_signed,
    reduced_problem,
)
from duocell.optimizer.results.proof import Incumbent
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.verification.verify import LIMITS
from tests.support.given.arms import make_arm, only_at, region
from tests.support.given.boxes import MOUNTS, random_problem
from tests.support.given.fields import ArmFields, BaseSides
from tests.support.given.thesis import BEST_KNOWN, CELLS, LOWER_BOUNDS
from tests.support.present import present

CASES = [(name, index) for name in CELLS for index in (0, 1)]


def problem_of(name: str, index: int, **base: Unpack[BaseSides]) -> ReducedProblem:
    cell = CELLS[name]
    arm = cell.arms[index]
    return present(reduced_problem(cell, replace(arm, base=replace(arm.base, **base))))


def line_problem(
    robot: str = "puma560",
    height: float = 0.1,
    tilt: Floats | None = None,
    base: BaseRegion | None = None,
    **given: Unpack[ArmFields],
) -> ReducedProblem:
    """Eight poses along y, the tool pointing down unless told otherwise."""
    turned = rotation_x(np.pi) if tilt is None else tilt
    ends = [transform(turned, np.array([0.0, side, height])) for side in (-0.2, 0.2)]
    arm = make_arm(robot, base=base or region((-1.0, 1.0), (-1.0, 1.0)), **given)
    return present(reduced_problem(Cell(line(ends[0], ends[1], 8), (arm,)), arm))


def rounds(most: int) -> Callable[[], bool]:
    """A stop after some rounds: the same on every machine, unlike a time limit."""
    asked = count()
    return lambda: next(asked) >= most


def refined(problem: ReducedProblem, rng: np.random.Generator) -> float:
    """Best objective by random sampling and repeated narrowing; inf if nothing usable is met."""
    bounds = problem.arm.base.bounds[:3]
    width = bounds[:, 1] - bounds[:, 0]
    places = rng.uniform(bounds[:, 0], bounds[:, 1], (1500, 3))
    paths = evaluate(problem, places)
    costs = np.where(paths.violation == 0.0, paths.objective, np.inf)
    order = np.argsort(costs, axis=None)[:4]
    postures, rows = np.unravel_index(order, costs.shape)
    best, places = costs[postures, rows], places[rows]
    signs = np.repeat(np.array(ALL_SIGNS)[postures], 25, axis=0)
    for size in 0.1 * 0.6 ** np.arange(16):
        tried = places[:, None] + rng.normal(size=(4, 25, 3)) * size * width
        tried = np.clip(tried, bounds[:, 0], bounds[:, 1])
        found = evaluate_signed(problem, tried.reshape(-1, 3), signs)
        costs = np.where(found.violation[0] == 0.0, found.objective[0], np.inf).reshape(4, 25)
        pick = (np.arange(4), np.argmin(costs, axis=1))
        better = costs[pick] < best
        best, places = np.where(better, costs[pick], best), np.where(better[:, None], tried[pick], places)
    return float(best.min())


@pytest.mark.parametrize("missed", [9e-7, 1e-4])
def test_what_misses_a_limit_by_so_little_that_it_counts_as_kept_is_not_proved_impossible(missed: float) -> None:
    place = np.array([0.45, 0.0, 0.0])
    paths = evaluate(line_problem(), place[None])
    best = int(np.flatnonzero(paths.violation[:, 0] == 0.0)[0])
    joints = paths.joints[:, best, 0]
    arm = line_problem().arm
    upper = np.where(np.arange(6) == 2, np.max(joints, axis=1) - missed, arm.upper)
    base = only_at(place, paths.yaw[best, 0])
    problem = line_problem(base=base, upper=upper, posture=Posture(*ALL_SIGNS[best]), reference=arm.reference)
    assert (np.max(joints - problem.arm.upper[:, None]) <= LIMITS) == (missed < LIMITS)
    proof = certify(problem, None, CertificateSettings(1e-3, 30.0))
    assert proof.infeasible == (missed > LIMITS)


@pytest.mark.parametrize(("name", "index"), CASES)
@pytest.mark.parametrize("gap", [5e-3, 1e-4])
def test_the_acceptance_cases_are_proved_without_help(name: str, index: int, gap: float) -> None:
    proof = certify(problem_of(name, index), None, CertificateSettings(gap, 30.0))
    assert proof.proved
    assert present(proof.gap) <= gap
    known = LOWER_BOUNDS[name][index] / 0.995  # published with a gap of 0.5 %
    assert proof.objective == pytest.approx(known, rel=max(gap, 1e-5))
    assert (1.0 - gap) * known * (1 - 1e-6) <= present(proof.lower_bound) <= known * (1 + 1e-6)
    assert proof.boxes < 6000
    assert not proof.infeasible
    found = present(proof.found)
    paths = evaluate_signed(problem_of(name, index), found.position[None], np.array([found.signs]))
    assert paths.violation[0, 0] <= 1e-9
    assert paths.objective[0, 0] == pytest.approx(found.objective) == pytest.approx(proof.objective)
    assert paths.yaw[0, 0] == pytest.approx(found.yaw)


def test_both_arms_of_a_case_together_have_the_published_value() -> None:
    for name, best in BEST_KNOWN.items():
        proofs = [certify(problem_of(name, k), None, CertificateSettings(1e-4, 30.0)) for k in (0, 1)]
        assert sum(present(p.lower_bound) for p in proofs) <= best * (1 + 1e-9)
        assert sum(present(p.objective) for p in proofs) == pytest.approx(best, rel=1e-4)


@pytest.mark.parametrize(("name", "index"), [("line", 1), ("arc", 0)])
def test_with_height_free_too(name: str, index: int) -> None:
    problem = problem_of(name, index, z=Interval(-0.3, 0.5))
    proof = certify(problem, None, CertificateSettings(0.03, 60.0))
    assert proof.proved
    fixed = LOWER_BOUNDS[name][index] / 0.995
    assert present(proof.lower_bound) <= fixed  # more freedom never costs more
    assert present(proof.objective) <= fixed * 1.04
    assert present(proof.found).position[2] != 0.0


def test_an_incumbent_that_cannot_be_beaten_is_kept_and_a_poor_one_is_replaced() -> None:
    problem, best = problem_of("line", 0), LOWER_BOUNDS["line"][0] / 0.995
    proof = certify(problem, best, CertificateSettings(1e-3, 30.0))
    assert present(proof.objective) <= best
    assert proof.found is None or proof.found.objective < best
    poor = certify(problem, 2.0 * best, CertificateSettings(1e-3, 30.0))
    assert poor.objective == present(poor.found).objective < 1.001 * best
    assert poor.proved


def test_a_proof_goes_on_where_another_stopped_but_not_to_a_smaller_gap() -> None:
    problem, best = problem_of("line", 0), LOWER_BOUNDS["line"][0] / 0.995
    whole = certify(problem, best, CertificateSettings(1e-3, 30.0))
    tree = BranchAndBound(problem, best, CertificateSettings(1e-3, 30.0))
    cut = certify(problem, best, CertificateSettings(1e-3, 30.0, 200), tree=tree)
    assert cut.boxes == 200 < whole.boxes
    assert not cut.proved
    resumed = certify(problem, cut.objective, CertificateSettings(1e-3, 30.0), tree=tree)
    assert resumed.proved
    assert present(cut.lower_bound) <= present(resumed.lower_bound) <= best
    assert resumed.boxes < whole.boxes + 200
    spent = certify(problem, resumed.objective, CertificateSettings(1e-3, 30.0, 300), tree=tree)
    assert (spent.boxes, spent.proved) == (resumed.boxes, True)
    with pytest.raises(ValueError, match="gap"):
        tree.go_on(best, CertificateSettings(1e-4, 30.0))


@pytest.mark.parametrize("name", ["puma560", "ur10e", "irb6700"])
def test_random_tasks_are_bounded_below_everything_a_search_finds(name: str) -> None:
    rng = np.random.default_rng(sum(map(ord, name)) + 2)
    solved = impossible = 0
    for trial in range(8):
        problem = random_problem(name, rng, mounted=trial % 3 == 2, level=trial > 1)
        proof = certify(problem, None, CertificateSettings(0.01, 60.0), rounds(16))
        best = refined(problem, rng)
        if proof.infeasible:
            impossible += 1
            assert np.isinf(best)
            assert proof.lower_bound is None
            assert proof.causes
        else:
            assert present(proof.lower_bound) <= best * (1.0 + 1e-9)
        if proof.proved and not proof.infeasible:
            solved += 1
            assert present(proof.objective) <= best * 1.011
            assert present(proof.gap) <= 0.01
    assert solved >= 2
    assert solved + impossible >= 4


def test_fixed_coordinates_stay_fixed_and_a_fixed_base_costs_what_it_costs() -> None:
    problem = problem_of("line", 0)
    best = present(certify(problem, None, CertificateSettings(1e-3, 30.0)).found)
    x, y, z = (Interval(float(v), float(v)) for v in best.position)
    along = certify(problem_of("line", 0, x=x, z=z), None, CertificateSettings(1e-3, 30.0))
    assert along.proved
    assert present(along.found).position[0] == best.position[0]
    assert along.objective == pytest.approx(best.objective, rel=2e-3)
    here = certify(problem_of("line", 0, x=x, y=y, z=z), None, CertificateSettings(1e-5, 30.0))
    assert here.proved
    assert here.boxes <= 16  # postures, and once more as soon as a path is known
    assert here.objective == pytest.approx(best.objective, rel=1e-9)


@pytest.mark.parametrize("yaw", [Interval(0.4, 0.4), Interval(-2.0, -1.5)])
def test_yaws_that_are_fixed_or_bounded_are_inside_the_bound(yaw: Interval) -> None:
    free, problem = problem_of("line", 0), problem_of("line", 0, yaw=yaw)
    proof = certify(problem, None, CertificateSettings(1e-3, 30.0))
    assert proof.proved
    assert yaw.low - 1e-9 <= present(proof.found).yaw <= yaw.high + 1e-9
    assert present(proof.objective) <= refined(problem, np.random.default_rng(0)) * 1.0011
    assert (
        present(proof.lower_bound) >= present(certify(free, None, CertificateSettings(1e-3, 30.0)).lower_bound) * 0.999
    )


def test_only_admitted_postures_are_searched() -> None:
    problem = problem_of("line", 0)
    best = certify(problem, None, CertificateSettings(1e-3, 30.0))
    other = replace(problem, postures=np.array([s != present(best.found).signs for s in ALL_SIGNS]))
    second = certify(other, None, CertificateSettings(2e-2, 30.0))
    assert present(second.found).signs != present(best.found).signs
    assert present(second.lower_bound) > present(best.objective)
    one = present(reduced_problem(CELLS["line"], replace(CELLS["line"].arms[0], posture=Posture(1, -1, -1))))
    assert certify(one, None, CertificateSettings(1e-3, 30.0)).objective == pytest.approx(best.objective, rel=1e-3)


@pytest.mark.parametrize("mount", MOUNTS[1:4])
def test_turning_the_whole_cell_changes_nothing(mount: Floats) -> None:
    """A hanging arm or one on a wall is an upright one in a turned world."""
    upright = line_problem(base=region((-1.0, 1.0), (-0.9, 0.7), (-0.1, 0.2)))
    poses = np.tile(np.eye(4), (8, 1, 1))
    poses[:, :3, :3] = mount @ upright.rotations
    poses[:, :3, 3] = upright.positions @ mount.T
    sides = np.sort((mount @ upright.arm.base.bounds[:3]), axis=1)
    base = BaseRegion(*(Interval(float(a), float(b)) for a, b in sides))
    arm = replace(upright.arm, base=base, mount=mount)
    turned = present(reduced_problem(Cell(Task(poses), (arm,)), arm))
    one, other = (certify(p, None, CertificateSettings(0.01, 30.0)) for p in (upright, turned))
    assert one.proved
    assert other.proved
    assert other.objective == pytest.approx(one.objective, rel=0.011)
    assert present(other.lower_bound) <= present(one.objective)
    assert present(one.lower_bound) <= present(other.objective)


def test_out_of_reach_is_proved_with_the_poses_to_blame() -> None:
    task = line_problem().positions + np.array([0.0, 0.0, 2.0])
    lifted = replace(line_problem(), positions=task)
    high = certify(lifted, None, CertificateSettings(0.01, 5.0))
    assert high.infeasible
    assert high.proved
    assert high.lower_bound is high.objective is high.gap is None
    assert {o.kind for o in high.causes} == {"out_of_reach"}
    assert high.causes[0].share == pytest.approx(1.0)
    one_far = line_problem().positions.copy()
    one_far[5] += [0.0, 0.0, 0.95]  # within reach of some bases for itself, not together with the others
    stray = certify(replace(line_problem(), positions=one_far), None, CertificateSettings(0.01, 20.0))
    assert stray.infeasible
    reach = next(o for o in stray.causes if o.kind == "out_of_reach")
    assert 5 in reach.poses


def test_a_joint_limit_that_makes_a_task_impossible_is_named() -> None:
    robot = make_arm().robot
    lower, upper = robot.lower.copy(), robot.upper.copy()
    lower[4], upper[4] = -0.1, 0.1  # joint 5 nearly straight: the tool cannot point down with a bent arm
    reference = np.clip(robot.reference, lower, upper)
    free = certify(line_problem(tilt=rotation_y(np.pi / 2)), None, CertificateSettings(0.02, 30.0))
    assert free.proved
    assert not free.infeasible
    tilt = rotation_y(np.pi / 2)
    stiff = line_problem(tilt=tilt, height=0.5, lower=lower, upper=upper, reference=reference)
    proof = certify(stiff, None, CertificateSettings(0.02, 30.0))
    assert proof.infeasible
    limits = [o for o in proof.causes if o.kind == "joint_limit"]
    assert limits[0].joint == 4
    shares = [o.share for o in proof.causes]
    assert all(a >= b for a, b in pairwise(shares))


def test_a_wrong_orientation_is_a_matter_of_joint_limits_not_of_reach() -> None:
    # Half a metre above the shoulder a tool can point up but not down: joint 5 would have to fold back too far.
    up, down = (
        certify(line_problem(height=0.5, tilt=tilt), None, CertificateSettings(0.02, 30.0))
        for tilt in (rotation_x(0.0), rotation_x(np.pi))
    )
    assert up.proved
    assert not up.infeasible
    assert down.proved
    assert down.infeasible
    assert (down.causes[0].kind, down.causes[0].joint) == ("joint_limit", 4)
    reach = [o.share for o in down.causes if o.kind == "out_of_reach"]
    assert sum(reach) < 0.9


def test_it_stops_when_told_and_says_how_far_it_got() -> None:
    problem, calls, told = problem_of("line", 0), [], []

    def stop() -> bool:
        calls.append(1)
        return len(calls) > 3

    proof = certify(problem, 68.5, CertificateSettings(1e-6, 60.0), stop, lambda *state: told.append(state))
    assert not proof.proved
    assert len(told) == 3
    assert 0.0 < present(proof.lower_bound) <= LOWER_BOUNDS["line"][0] / 0.995
    assert proof.gap == pytest.approx(
        (present(proof.objective) - present(proof.lower_bound)) / present(proof.objective)
    )
    bounds, _, boxes = zip(*told, strict=True)
    assert all(a <= b for a, b in pairwise(bounds))
    assert boxes[-1] == proof.boxes
    out_of_time = certify(problem, None, CertificateSettings(1e-6, 0.0))
    assert not out_of_time.proved
    assert out_of_time.lower_bound == 0.0
    assert out_of_time.gap is None


def test_incumbents_keep_the_limit_on_conditioning() -> None:
    arm: Arm = CELLS["line"].arms[0]
    plain = certify(problem_of("line", 0), None, CertificateSettings(1e-3, 30.0))
    paths = evaluate_signed(
        problem_of("line", 0), present(plain.found).position[None], np.array([present(plain.found).signs])
    )
    length = characteristic_length(arm.robot)
    worst = float(np.min(conditioning(arm.robot, arm.tool, paths.joints[:, 0, 0].T, length)))
    wanted = replace(arm, min_conditioning=1.2 * worst)
    problem = present(reduced_problem(CELLS["line"], wanted))
    best = _best_near(problem, present(plain.found))
    proof = certify(problem, best, CertificateSettings(1e-3, 100.0))
    assert proof.proved
    assert present(plain.objective) < present(proof.lower_bound) <= best
    proof = certify(problem, None, CertificateSettings(0.05, 60.0), rounds(12))
    joints = evaluate_signed(
        problem, present(proof.found).position[None], np.array([present(proof.found).signs])
    ).joints[:, 0, 0]
    assert np.min(conditioning(arm.robot, arm.tool, joints.T, length)) >= 1.2 * worst - 1e-12


def _best_near(problem: ReducedProblem, found: Incumbent) -> float:
    """Best of random bases around a place, in its posture, that keep everything, the limit on conditioning included."""
    places = found.position + np.random.default_rng(0).uniform(-0.02, 0.02, (4000, 3)) * [1.0, 1.0, 0.0]
    free = replace(problem, arm=replace(problem.arm, min_conditioning=None))
    paths = evaluate_signed(free, places, np.tile(found.signs, (4000, 1)))
    kept = (paths.violation[0] == 0.0) & (conditioning_shortfall(problem, paths.joints[:, 0]) == 0.0)
    return float(np.min(paths.objective[0, kept]))


def test_a_conditioning_that_no_base_keeps_is_proved_impossible() -> None:
    problem = present(reduced_problem(CELLS["line"], replace(CELLS["line"].arms[0], min_conditioning=0.6)))
    proof = certify(problem, None, CertificateSettings(0.01, 100.0))
    assert proof.infeasible
    kinds = {obstacle.kind: obstacle.share for obstacle in proof.causes}
    assert 0.0 < kinds["conditioning"] <= 1.0


def test_a_single_base_is_decided() -> None:
    best = present(certify(problem_of("line", 0), None, CertificateSettings(1e-3, 30.0)).found)
    x, y, z = (Interval(float(v), float(v)) for v in best.position)
    problem = problem_of("line", 0, x=x, y=y, z=z)
    impossible = replace(problem, arm=replace(problem.arm, min_conditioning=0.9))
    proof = certify(impossible, None, CertificateSettings(1e-3, np.inf))
    assert (proof.found, proof.objective) == (None, None)
    assert proof.infeasible


def test_the_same_request_gets_the_same_proof() -> None:
    one, other = (certify(problem_of("arc", 1), None, CertificateSettings(1e-3, 30.0)) for _ in range(2))
    assert (one.lower_bound, one.objective, one.boxes) == (other.lower_bound, other.objective, other.boxes)
