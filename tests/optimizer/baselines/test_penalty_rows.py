from dataclasses import replace

import numpy as np
import pytest

from duocell.models.robot.arm import Interval
from duocell.optimizer.baselines.gradient import PostureFunction
from duocell.optimizer.baselines.penalty_rows import INVERSE_BARRIER, LOG_BARRIER, Barrier, ConstrainedPosture, exterior
from duocell.optimizer.reduction.reduced import reduced_problem
from tests.support.given.problems import STEP
from tests.support.given.thesis import CELLS
from tests.support.present import present

ROWS = np.array([-0.5, -0.1, -2.0])


def test_gradient_of_every_penalised_function_is_that_of_finite_differences() -> None:
    cell = CELLS["arc"]
    bounded = replace(cell.arms[0], base=replace(cell.arms[0].base, z=Interval(-0.2, 0.2), yaw=Interval(-2.0, 1.0)))
    problem = present(reduced_problem(cell, bounded))
    constrained = ConstrainedPosture(PostureFunction(problem, (1, -1, -1)))
    path = present(constrained.function.begin(np.array([-0.43, 0.71, 0.0, -0.68])))  # a little inside its limits
    assert constrained.rows(path).max() < 0.0
    for penalty in (INVERSE_BARRIER.penalty(0.3), LOG_BARRIER.penalty(0.3), exterior(50.0, 0.3)):
        point = present(constrained.at(path, penalty))
        numeric = [
            (
                present(constrained.step(point.x + STEP * e, path, penalty)).value
                - present(constrained.step(point.x - STEP * e, path, penalty)).value
            )
            / (2.0 * STEP)
            for e in np.eye(4)
        ]
        assert point.gradient == pytest.approx(numeric, rel=1e-4, abs=1e-3)


def test_penalties_are_those_of_the_source() -> None:
    assert present(INVERSE_BARRIER.penalty(0.3)(ROWS))[0] == pytest.approx(-0.3 * sum(1.0 / ROWS))  # (8.27)
    assert present(LOG_BARRIER.penalty(0.3)(ROWS))[0] == pytest.approx(-0.3 * sum(np.log(-ROWS)))  # (8.28)
    assert present(exterior(7.0, 0.0)(ROWS + 0.3))[0] == pytest.approx(7.0 * 0.2**2)  # (8.25)
    assert present(exterior(7.0, 0.2)(ROWS))[0] == pytest.approx(7.0 * 0.1**2)


@pytest.mark.parametrize("barrier", [INVERSE_BARRIER, LOG_BARRIER])
@pytest.mark.parametrize("row", [0.0, 0.1])
def test_barriers_do_not_exist_on_or_beyond_a_limit(barrier: Barrier, row: float) -> None:
    assert barrier.penalty(1.0)(np.array([-1.0, row])) is None


def test_rows_are_negative_exactly_inside() -> None:
    cell = CELLS["line"]
    problem = present(reduced_problem(cell, cell.arms[0]))
    constrained = ConstrainedPosture(PostureFunction(problem, (1, -1, -1)))
    path = constrained.function.begin(np.array([0.1561, 0.9551, 0.0, -0.8767]))
    assert path is not None
    rows = constrained.rows(path)
    m = len(path.joints)
    assert len(rows) == 2 * 6 * m + 2 * 6 * (m - 1) + 3 * m + 2 * 2  # limits, steps, reach, x and y
    assert rows[: 6 * m] == pytest.approx((path.joints - cell.arms[0].upper).ravel())
    assert (rows < 0.0).all()
    turned = constrained.function.follow(path.placement + np.array([0.0, 0.0, 0.0, 4.0]), path)
    assert turned is not None
    above = (constrained.rows(turned) >= 0.0).nonzero()[0]
    assert len(above) == m
    assert set(above % 6) == {0}  # joint 1 alone
    outside = constrained.function.follow(np.array([0.1561, 1.73, 0.0, -0.8767]), path)
    assert outside is None or constrained.rows(outside).max() > 0.0


def test_endless_joints_have_no_rows_and_a_free_yaw_no_box() -> None:
    cell = CELLS["line"]
    arm = cell.arms[0]
    lower, upper = arm.lower.copy(), arm.upper.copy()
    lower[5], upper[5] = -np.inf, np.inf
    problem = present(reduced_problem(cell, replace(arm, lower=lower, upper=upper)))
    constrained = ConstrainedPosture(PostureFunction(problem, (1, -1, -1)))
    path = present(constrained.function.begin(np.array([0.1561, 0.9551, 0.0, -0.8767])))
    m = len(path.joints)
    assert len(constrained.rows(path)) == 2 * 5 * m + 2 * 6 * (m - 1) + 3 * m + 2 * 2
