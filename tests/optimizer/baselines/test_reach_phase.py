from dataclasses import replace

import numpy as np
import pytest

from duocell.models.robot.arm import Interval
from duocell.optimizer.baselines.gradient import PostureFunction
from duocell.optimizer.baselines.reach_phase import MARGIN, approach
from duocell.optimizer.reduction.reduced import reduced_problem
from tests.support.given.thesis import CELLS
from tests.support.present import present


def _function(**base: Interval) -> PostureFunction:
    cell = CELLS["line"]
    arm = replace(cell.arms[0], base=replace(cell.arms[0].base, **base))
    return PostureFunction(present(reduced_problem(cell, arm)), (1, -1, -1))


@pytest.mark.parametrize("start", [[2.1, 1.7, 0.0, 0.5], [0.9, 0.5, 0.0, 0.5], [-0.2, -0.6, 0.0, 0.5]])
def test_bases_too_far_and_too_near_are_brought_into_reach(start: list[float]) -> None:
    function = _function()
    assert function.begin(np.array(start)) is None
    end = approach(function, np.array(start))
    assert end.worst <= -0.5 * MARGIN
    assert end.descent.evaluations > 0
    assert end.placement[3] == 0.5
    assert end.placement[2] == 0.0
    assert function.begin(end.placement) is not None


def test_a_base_that_may_not_move_sideways_ends_where_it_comes_nearest() -> None:
    function = _function(y=Interval(2.5, 2.5))
    end = approach(function, np.array([1.8, 2.5, 0.0, 0.0]))
    assert end.worst > 0.5
    assert end.placement[1] == 2.5
    assert 0.6 < end.placement[0] < 1.3  # beside the path


def test_a_start_in_reach_stays() -> None:
    function = _function()
    start = np.array([0.4914, 0.9678, 0.0, -0.8088])
    end = approach(function, start)
    assert (end.placement == start).all()
    assert end.descent.evaluations == 0
