"""Parts of a cell."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.draws.cells import real_cell
from duocell.optimizer.infeasibility.requirements import Kind, Requirement, everything, restricted


def test_a_selection_keeps_what_is_in_it() -> None:
    cell = real_cell(4).cell
    whole = everything(cell)
    same = restricted(cell, whole)
    assert len(same.arms) == len(cell.arms)
    assert same.max_joint_step == cell.max_joint_step
    assert same.surroundings.obstacles == cell.surroundings.obstacles
    assert np.array_equal(same.task.poses, cell.task.poses)
    less = restricted(cell, replace(whole.without(Requirement(Kind.LIMITS, 1, 2)), first=2, last=2))
    assert len(less.task) == 2
    assert np.array_equal(less.task.poses[0], cell.task.poses[2])
    assert np.isinf(less.arms[1].lower[2])
    assert np.array_equal(less.arms[0].lower, cell.arms[0].lower)
