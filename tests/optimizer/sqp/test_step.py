"""The quadratic program of a step, against answers known in closed form and against a general minimiser."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import NonlinearConstraint, minimize

from duocell.models.base.arrays import Floats
from duocell.optimizer.sqp.linear_rows import LinearRows
from duocell.optimizer.sqp.quadratic import Quadratic
from duocell.optimizer.sqp.step import best_step
from tests.support.present import present

NO_ROWS = LinearRows(np.zeros((0, 3)), np.zeros(0), np.zeros(0), np.zeros(0))
FAR = np.full(3, 10.0)


def test_without_rows_it_is_newtons_step() -> None:
    curvature = np.diag([2.0, 4.0, 8.0])
    gradient = np.array([2.0, -4.0, 4.0])
    step = present(best_step(Quadratic(gradient, curvature), NO_ROWS, -FAR, FAR, 100.0))
    assert np.allclose(step.step, [-1.0, 1.0, -0.5], atol=1e-6)
    assert step.slack == pytest.approx(0.0, abs=1e-6)


def test_bounds_hold_exactly() -> None:
    step = present(best_step(Quadratic(np.ones(3), np.eye(3)), NO_ROWS, np.array([-0.1, -0.2, 0.0]), FAR, 100.0))
    assert np.allclose(step.step, [-0.1, -0.2, 0.0], atol=1e-7)
    assert np.all(step.step >= [-0.1, -0.2, 0.0])


def test_what_rows_cannot_keep_is_in_the_slack() -> None:
    rows = LinearRows(np.array([[1.0, 0, 0], [-1.0, 0, 0]]), np.zeros(2), np.array([0.3, 0.1]), np.zeros(2))
    step = present(best_step(Quadratic(np.zeros(3), 1e-6 * np.eye(3)), rows, -FAR, FAR, 100.0))
    assert step.step[0] == pytest.approx(0.1, abs=1e-5)
    assert step.slack == pytest.approx(0.2, abs=1e-5)


@pytest.mark.parametrize("seed", range(6))
def test_random_programs_agree_with_a_general_minimiser(seed: int) -> None:
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(3, 3))
    model = Quadratic(rng.normal(size=3), root @ root.T + 0.1 * np.eye(3))
    rows = LinearRows(rng.normal(size=(7, 3)), rng.normal(size=7), rng.normal(size=7), np.zeros(7))
    step = present(best_step(model, rows, -FAR, FAR, 5.0))

    def cost(x: Floats) -> float:
        return float(model.change(x[:3]) + 5.0 * x[3])

    kept = NonlinearConstraint(lambda x: rows.gradients @ x[:3] + x[3] + rows.values - rows.required, 0.0, np.inf)
    found = minimize(cost, np.array([0, 0, 0, 10.0]), constraints=[kept], bounds=[(-10, 10)] * 3 + [(0, None)])
    assert found.success
    assert model.change(step.step) + 5.0 * step.slack == pytest.approx(found.fun, abs=1e-5)
