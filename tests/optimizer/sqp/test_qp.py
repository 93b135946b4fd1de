"""Quadratic programs by PIQP and by another method, and what becomes of solvers that fail."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import Bounds, LinearConstraint, minimize

from duocell.models.base.arrays import Floats
from duocell.optimizer.sqp.linear_rows import LinearRows
from duocell.optimizer.sqp.qp import QuadraticProgram, minimum
from duocell.optimizer.sqp.quadratic import Quadratic
from duocell.optimizer.sqp.step import best_step


def random_program(seed: int) -> QuadraticProgram:
    """Four unknowns, six rows, all of which some point keeps."""
    rng = np.random.default_rng(seed)
    root, rows = rng.normal(size=(4, 4)), rng.normal(size=(6, 4))
    kept = rng.uniform(-1.0, 1.0, 4)
    least = rows @ kept - rng.uniform(0.0, 0.5, 6)
    return QuadraticProgram(root @ root.T + 0.05 * np.eye(4), rng.normal(size=4), rows, least, kept - 1.0, kept + 1.0)


def slsqp(program: QuadraticProgram) -> Floats | None:
    """The same program by Kraft's method, which takes it for any nonlinear one."""

    def value(x: Floats) -> float:
        return float(0.5 * x @ program.curvature @ x + program.gradient @ x)

    def slope(x: Floats) -> Floats:
        return np.asarray(program.curvature @ x + program.gradient)

    found = minimize(
        value,
        0.5 * (program.lower + np.minimum(program.upper, program.lower + 2.0)),
        method="SLSQP",
        jac=slope,
        constraints=LinearConstraint(program.rows, program.least, np.inf),
        bounds=Bounds(program.lower, program.upper),
        tol=1e-12,
        options={"maxiter": 500},
    )
    return np.asarray(found.x) if found.success else None


@pytest.mark.parametrize("seed", range(12))
def test_both_methods_find_the_same_minimum(seed: int) -> None:
    program = random_program(seed)
    one, other = minimum(program), minimum(program, slsqp)
    assert one is not None
    assert other is not None
    assert np.allclose(one, other, atol=1e-5)
    assert np.all(program.rows @ one >= program.least - 1e-7)
    assert np.all((one >= program.lower) & (one <= program.upper))


def test_a_program_that_nothing_keeps_has_no_minimum() -> None:
    program = random_program(0)
    impossible = replace(program, rows=np.vstack([np.eye(4), -np.eye(4)]), least=np.ones(8))
    assert minimum(impossible) is None


@pytest.mark.parametrize("answer", [None, np.full(3, np.nan), np.array([0.0, np.inf, 0.0])])
def test_a_solver_that_fails_gives_no_step(answer: Floats | None) -> None:
    rows = LinearRows(np.zeros((0, 2)), np.zeros(0), np.zeros(0), np.zeros(0))
    model = Quadratic(np.ones(2), np.eye(2))
    assert best_step(model, rows, -np.ones(2), np.ones(2), 1.0, lambda _: answer) is None


def test_another_solver_takes_the_place_of_piqp() -> None:
    rows = LinearRows(np.array([[1.0, 1.0]]), np.array([-0.5]), np.zeros(1), np.zeros(1))
    model = Quadratic(np.array([1.0, -1.0]), np.diag([2.0, 3.0]))
    ours, theirs = (best_step(model, rows, -np.ones(2), np.ones(2), 50.0, *other) for other in ((), (slsqp,)))
    assert ours is not None
    assert theirs is not None
    assert np.allclose(ours.step, theirs.step, atol=1e-5)
