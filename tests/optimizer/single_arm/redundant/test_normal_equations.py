"""Small systems written out over columns against LAPACK; bounded quadratics against all their active sets."""

from __future__ import annotations

from itertools import product

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.single_arm.redundant.normal_equations import backwards, bounded_step, factorised, forwards


def test_factors_solve_the_systems() -> None:
    rng = np.random.default_rng(1)
    jacobian, inverse = rng.normal(size=(7, 6, 5)), rng.uniform(0.2, 3.0, (7, 5))
    damping, rows = rng.uniform(0.01, 0.1, 5), rng.normal(size=(6, 5))
    factor, weighted = factorised(jacobian, inverse, damping)
    solved = rows.copy()
    forwards(factor, solved)
    backwards(factor, solved)
    for k in range(5):
        matrix = jacobian[:, :, k].T @ np.diag(inverse[:, k]) @ jacobian[:, :, k] + damping[k] * np.eye(6)
        assert np.allclose(solved[:, k], np.linalg.solve(matrix, rows[:, k]))
        assert np.allclose(weighted[:, :, k], inverse[:, k, None] * jacobian[:, :, k])


def best_of_all_active_sets(hessian: Floats, gradient: Floats, lower: Floats, upper: Floats) -> float:
    """The minimum over the box, by trying which coordinates are at which bound."""
    best, d = np.inf, len(gradient)
    for choice in product((-1, 0, 1), repeat=d):
        sides, x = np.array(choice), np.zeros(d)
        x[sides < 0], x[sides > 0] = lower[sides < 0], upper[sides > 0]
        free = sides == 0
        if np.any(free):
            rest = gradient[free] + hessian[np.ix_(free, ~free)] @ x[~free]
            x[free] = -np.linalg.solve(hessian[np.ix_(free, free)], rest)
        if np.all(x >= lower - 1e-12) and np.all(x <= upper + 1e-12):
            best = min(best, float(gradient @ x + 0.5 * x @ hessian @ x))
    return best


def test_bounded_steps_are_minima_of_their_boxes_whatever_stands_beside_them() -> None:
    rng = np.random.default_rng(2)
    factors = rng.normal(size=(60, 4, 4))
    hessian = factors @ np.swapaxes(factors, 1, 2) + 0.1 * np.eye(4)
    gradient = rng.normal(size=(60, 4))
    lower, upper = -rng.uniform(0.0, 0.5, (60, 4)), rng.uniform(0.0, 0.5, (60, 4))
    lower[::4], upper[::4] = -1e9, 1e9
    lower[1::4, 0] = 0.0
    steps = bounded_step(hessian, gradient, lower, upper)
    assert np.all((steps >= lower) & (steps <= upper))
    values = np.einsum("ka,ka->k", gradient, steps) + 0.5 * np.einsum("ka,kab,kb->k", steps, hessian, steps)
    wanted = [best_of_all_active_sets(*each) for each in zip(hessian, gradient, lower, upper, strict=True)]
    assert np.all(values >= np.array(wanted) - 1e-9)
    assert np.mean(values <= np.array(wanted) + 1e-9) > 0.95
