"""The base of a drawn posture is the best there is: no random base of the region misses the target by less."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.single_arm.redundant.draws import draw_seeds, drawn_postures, fit_to_bases
from duocell.optimizer.single_arm.redundant.unreduced_problem import (
    Seeds,
    UnreducedProblem,
    seen_from_bases,
    unreduced_problem,
)
from tests.support.given.tasks import possible


def turned_by(problem: UnreducedProblem, q: Floats, bases: Floats, pose: int) -> Floats:
    """(K,) rad between flange and target."""
    one = problem.only(np.array([pose]), np.ones(1))
    columns, _ = problem.chain.forward(q)
    wanted, _ = seen_from_bases(one, bases)
    angles: Floats = np.arccos(np.clip(0.5 * (np.sum(columns * wanted, axis=(0, 1)) - 1.0), -1.0, 1.0))
    return angles


@pytest.mark.parametrize("mount", [np.eye(3), rotation_about((1.0, 0.5, 0.2), 1.0)], ids=["upright", "tilted"])
@pytest.mark.parametrize("yaw", [np.pi, 0.4], ids=["free", "some"])
def test_yaws_are_the_best_of_the_region(mount: Floats, yaw: float) -> None:
    task = possible("iiwa14", np.random.default_rng(3), poses=3, mount=mount, half=(0.3, 0.3, 0.1, yaw))
    problem = unreduced_problem(task.cell, task.arm, search_box(task.cell, task.arm))
    q, bases = draw_seeds(problem, 1, 40, 200, 0)
    assert np.all(bases >= problem.base_lower)
    assert np.all(bases <= problem.base_upper)
    own, rng = turned_by(problem, q, bases, 1), np.random.default_rng(4)
    low, high = (-np.pi, np.pi) if yaw > 3.0 else task.arm.base.bounds[3]
    for _ in range(50):
        other = bases.copy()
        other[:, 3] = rng.uniform(low, high, len(bases))
        assert np.all(own <= turned_by(problem, q, other, 1) + 1e-9)


def test_the_postures_that_fit_a_base_are_the_nearest_ones() -> None:
    task = possible("franka_panda", np.random.default_rng(5), poses=3)
    problem = unreduced_problem(task.cell, task.arm, search_box(task.cell, task.arm))
    base = np.array([[*(task.position - problem.origin), task.yaw]])
    draws = np.column_stack([drawn_postures(problem, 300, 1), task.joints[1]])
    best = fit_to_bases(problem, 1, base, draws, 1)[:, 0, 0]
    assert np.array_equal(best, task.joints[1])
    assert Seeds(best[:, None, None], base).bases is base
