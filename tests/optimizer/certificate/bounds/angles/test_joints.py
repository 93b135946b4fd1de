from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Bools, Floats
from duocell.models.kinematics.branches import solve_signed
from duocell.optimizer.certificate.bounds.angles.expansion import enclose, expand
from duocell.optimizer.certificate.bounds.angles.joints import Kinematics
from duocell.optimizer.certificate.bounds.angles.targets import Targets
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.twist import twist_of
from duocell.optimizer.reduction.reduced import ReducedProblem, seen_from
from tests.support.given.boxes import PARALLEL, SPECIAL, SPHERICAL, members, random_problem

TURN = 2.0 * np.pi
SAMPLES = 14


def wrapped(angle: Floats) -> Floats:
    return angle - TURN * np.round(angle / TURN)


def random_boxes(problem: ReducedProblem, count: int, rng: np.random.Generator) -> Boxes:
    """Anywhere in the region, many of them through the first axis, of every size."""
    bounds = problem.arm.base.bounds[:3]
    centre = rng.uniform(bounds[:, 0], bounds[:, 1], (count, 3))
    above = problem.positions[rng.integers(len(problem.positions), size=count)]
    on_axis = rng.random(count) < 0.15
    centre[on_axis, :2] = above[on_axis, :2] + rng.normal(size=(on_axis.sum(), 2)) * 0.05
    half = bounds[0, 1] * 10.0 ** rng.uniform(-4.0, 0.0, (count, 1)) * rng.random((count, 3))
    half[:, bounds[:, 0] == bounds[:, 1]] = 0.0
    return Boxes(centre, half, rng.integers(0, 8, count))


def exact(problem: ReducedProblem, boxes: Boxes, places: Floats) -> tuple[Floats, Bools]:
    """(6, N, m) joints modulo 2π, and (N, m) whether the pose is reached."""
    branches = solve_signed(problem.form, problem.rotations, seen_from(problem, places), boxes.signs)
    return branches.joints[:, 0], branches.missing[0] == 0.0


@pytest.mark.parametrize("name", SPHERICAL + PARALLEL + SPECIAL)
def test_every_member_of_a_box_is_enclosed_and_expanded(name: str) -> None:
    rng = np.random.default_rng(sum(map(ord, name)))
    tightest, seen, regular = 0.0, 0, 0
    for trial in range(8):
        problem = random_problem(name, rng, mounted=trial % 2 == 1)
        kinematics = Kinematics.of(Targets.of(problem))
        mount = kinematics.targets.mount
        boxes = random_boxes(problem, 150, rng)
        local = kinematics.targets.local(boxes)
        angles = kinematics.angles(local)
        found = enclose(kinematics, local, angles)
        expansion = expand(kinematics, found).in_world(mount)
        twist = twist_of(kinematics, angles) if kinematics.twists else None
        for number in range(SAMPLES):
            places = members(boxes, rng, number)
            joints, reached = exact(problem, boxes, places)
            assert np.all(angles.short[reached] <= 1e-9)
            away = np.abs(wrapped(joints - found.values.centre)) - found.values.radius
            assert np.max(away, where=reached, initial=-1.0) <= 1e-12
            step = np.einsum("iwNm,Nw->iNm", expansion.slopes, places - boxes.centre)
            rest = np.abs(wrapped(joints - found.exact - step))
            known = found.regular & reached
            assert np.max(rest - expansion.rest, where=known, initial=-1.0) <= 1e-9
            # where there are slopes, members are enclosed on the turn of the value at the centre, not only modulo 2π
            onward = found.exact + step + wrapped(joints - found.exact - step)
            same_turn = known & (expansion.rest < 3.0)
            away = np.abs(onward - found.values.centre) - found.values.radius
            assert np.max(away, where=same_turn, initial=-1.0) <= 1e-9
            telling = known & (expansion.rest < 0.5) & (expansion.rest > 1e-6)
            tightest = max(tightest, np.max(rest / np.maximum(expansion.rest, 1e-9), where=telling, initial=0.0))
            if twist is not None:
                total = joints[3] + twist.sense * joints[5]
                away = np.abs(wrapped(total - twist.value.centre)) - twist.value.radius
                assert np.max(away, where=reached, initial=-1.0) <= 1e-9
            seen, regular = seen + int(reached.sum()), regular + int(known[0].sum())
    assert seen > 5000
    assert regular > 3000
    assert tightest > 0.7  # the remainder is not only sound, it is nearly attained


@pytest.mark.parametrize("name", ["puma560", "ur10e"])
def test_the_remainder_is_of_second_order(name: str) -> None:
    rng = np.random.default_rng(11)
    problem = random_problem(name, rng)
    kinematics = Kinematics.of(Targets.of(problem))
    boxes = random_boxes(problem, 400, rng)

    def rest(size: float) -> tuple[Floats, Bools]:
        small = Boxes(boxes.centre, np.tile([size, size, 0.0], (len(boxes), 1)), boxes.posture)
        found = enclose(kinematics, small, kinematics.angles(small))
        return expand(kinematics, found).rest, found.regular

    (wide, regular), (narrow, _) = rest(1e-3), rest(1e-4)
    ratio = (wide / narrow)[regular & (wide < 1e-2)]
    assert len(ratio) > 1000
    assert np.median(ratio) == pytest.approx(100.0, rel=0.1)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "oblique"])
def test_boxes_of_no_size_give_the_exact_joints(name: str) -> None:
    rng = np.random.default_rng(12)
    problem = random_problem(name, rng)
    kinematics = Kinematics.of(Targets.of(problem))
    boxes = random_boxes(problem, 500, rng)
    points = Boxes(boxes.centre, np.zeros_like(boxes.half), boxes.posture)
    values = kinematics.joint_values(kinematics.angles(points))
    joints, reached = exact(problem, points, points.centre)
    # a direction may be anything within rounding of a pole, nowhere else
    certain = reached & (values.radius < 1.0)
    assert certain[0].sum() > 100
    assert np.max(np.abs(wrapped(joints - values.centre)), where=certain, initial=0.0) < 1e-6


@pytest.mark.parametrize("name", ["irb6700", "ur10e"])
def test_a_box_out_of_reach_is_known_to_be(name: str) -> None:
    rng = np.random.default_rng(13)
    problem = random_problem(name, rng)
    kinematics = Kinematics.of(Targets.of(problem))
    far = problem.positions[0] + np.array([5.0, 0.0, 0.0])
    boxes = Boxes(far[None], np.array([[0.1, 0.1, 0.0]]), np.array([0]))
    assert kinematics.angles(boxes).short[0, 0] > 1.0
