from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.optimizer.certificate.bounds.box_bounds import LIMIT, PATH, REACH, BoxBounder, BoxBounds
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed
from tests.support.given.boxes import PARALLEL, SPECIAL, SPHERICAL, boxes_around, members, random_problem

TRIALS, BOXES, SAMPLES = 14, 120, 12


def attained(problem: ReducedProblem, boxes: Boxes, places: Floats) -> Floats:
    """(N,) cost of the best path from each place in the box's posture; inf where it is not usable."""
    paths = evaluate_signed(problem, places, boxes.signs)
    return np.where(paths.violation[0] == 0.0, paths.objective[0], np.inf)


def best_of_samples(problem: ReducedProblem, boxes: Boxes, found: BoxBounds, rng: np.random.Generator) -> Floats:
    """(N,) the best that is met in every box; nothing that is met is below its bound."""
    best = np.full(len(boxes), np.inf)
    for number in range(SAMPLES):
        places = found.promising if number == 0 else members(boxes, rng, number)
        best = np.minimum(best, attained(problem, boxes, places))
        assert np.all(found.lower <= best * (1.0 + 1e-9) + 1e-9)
    return best


@pytest.mark.parametrize("name", SPHERICAL + PARALLEL + SPECIAL)
def test_no_sample_of_a_box_scores_below_its_bound(name: str) -> None:
    rng = np.random.default_rng(sum(map(ord, name)) + 1)
    pairs, good = 0, 0
    for trial in range(TRIALS):
        problem = random_problem(name, rng, mounted=trial % 3 == 2)
        boxes = boxes_around(problem, BOXES, rng)
        if boxes is None:
            continue
        cutoff = np.inf if trial % 4 else float(rng.uniform(1.0, 100.0))
        found = BoxBounder.of(problem).bounds(boxes, cutoff)
        assert np.all(found.lower[np.any(found.causes > 0, axis=0)] == np.inf)
        assert np.all(np.abs(found.promising - boxes.centre) <= boxes.half + 1e-12)
        best = best_of_samples(problem, boxes, found, rng)
        usable = np.isfinite(best)
        pairs += int(usable.sum())
        good += int(np.sum(found.lower[usable] > 0.9 * best[usable]))
    assert pairs > 300
    assert good > 0.4 * pairs  # sound and not vacuous


@pytest.mark.parametrize("name", ["puma560", "irb6700", "ur10e", "cr5"])
def test_no_sample_of_a_box_scores_below_the_bound_of_a_task_sequence(name: str) -> None:
    """Two or three segments with weights (0 too), some of one pose, some with a part at rest; one yaw for all of
    them.
    """
    rng = np.random.default_rng(sum(map(ord, name)) + 2)
    pairs, good, trial = 0, 0, 0
    while pairs < 400:
        trial += 1
        problem = random_problem(name, rng, mounted=trial % 3 == 2, segments=2 + trial % 2)
        boxes = boxes_around(problem, BOXES, rng)
        if boxes is None:
            continue
        found = BoxBounder.of(problem).bounds(boxes, np.inf)
        best = best_of_samples(problem, boxes, found, rng)
        usable = np.isfinite(best)
        pairs += int(usable.sum())
        good += int(np.sum(found.lower[usable] > 0.9 * best[usable]))
    assert good > 0.4 * pairs


@pytest.mark.parametrize(("name", "segments"), [("puma560", 1), ("ur5e", 1), ("puma560", 3), ("ur5e", 2)])
def test_bounds_close_as_boxes_shrink(name: str, segments: int) -> None:
    rng = np.random.default_rng(4)
    problem = random_problem(name, rng, segments=segments)
    while (boxes := boxes_around(problem, 40, rng)) is None or (
        problem.weights is not None and not problem.weights.all()
    ):
        problem = random_problem(name, rng, segments=segments)
    tiny = Boxes(boxes.centre, np.minimum(boxes.half, 1e-7), boxes.posture)
    found = BoxBounder.of(problem).bounds(tiny, np.inf)
    cost = attained(problem, tiny, tiny.centre)
    usable = np.isfinite(cost)
    assert usable.sum() > 10
    gap = (cost[usable] - found.lower[usable]) / cost[usable]
    assert np.median(gap) < 1e-5


def test_a_long_task_is_bounded_by_all_its_poses() -> None:
    rng = np.random.default_rng(8)
    short = random_problem("puma560", rng)
    while len(short.positions) < 4 or (boxes := boxes_around(short, 60, rng)) is None:
        short = random_problem("puma560", rng)
    index = np.repeat(np.arange(len(short.positions)), 12)
    problem = replace(short, rotations=short.rotations[index], positions=short.positions[index])
    bounder = BoxBounder.of(problem)
    assert bounder.probe is not None
    found, once = bounder.bounds(boxes, np.inf), BoxBounder.of(short).bounds(boxes, np.inf)
    cost = attained(problem, boxes, boxes.centre)
    assert np.all(found.lower <= cost * (1.0 + 1e-9))
    both = np.isfinite(once.lower) & np.isfinite(found.lower)
    assert both.sum() > 20
    assert np.all(found.lower[both] >= 11.0 * once.lower[both])


def test_causes_name_reach_limits_and_paths() -> None:
    rng = np.random.default_rng(5)
    problem = random_problem("puma560", rng)
    while (boxes := boxes_around(problem, 20, rng)) is None or len(problem.positions) < 3:
        problem = random_problem("puma560", rng)
    boxes = Boxes(boxes.centre, np.minimum(boxes.half, 1e-3), boxes.posture)
    usable = boxes[np.isfinite(BoxBounder.of(problem).bounds(boxes, np.inf).lower)]
    assert len(usable) > 5
    away = Boxes(usable.centre + np.array([3.0, 0.0, 0.0]), usable.half, usable.posture)
    far = BoxBounder.of(problem).bounds(away, np.inf)
    assert np.all(far.causes[0] == REACH)
    assert np.all(np.any(far.poses[0], axis=1))
    lower, upper = problem.arm.lower.copy(), problem.arm.upper.copy()
    lower[4], upper[4] = -1.745, -1.744  # joint 5 is left no room
    narrow = replace(problem, arm=replace(problem.arm, lower=lower, upper=upper))
    cut = BoxBounder.of(narrow).bounds(usable, np.inf)
    assert np.sum(cut.causes[5] == LIMIT) > 0.8 * len(usable)
    assert np.all(cut.lower[cut.causes[5] > 0] == np.inf)
    still = BoxBounder.of(replace(problem, max_step=1e-4)).bounds(usable, np.inf)
    assert np.all(np.any(still.causes == PATH, axis=0))
    assert np.all(np.isinf(still.lower))
