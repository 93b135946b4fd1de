"""Layouts of tied arms brought downhill: on their couplings, and never for the worse."""

from __future__ import annotations

import numpy as np

from bench.trials.coupled_tasks import coupled_task
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.coupled.candidates.layouts import sample_layouts
from duocell.optimizer.coupled.candidates.polish import TAKEN, polished
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.verification.scene import Scene

MIRRORED = 43
"""A task whose cheapest samples lead to places where turning the bases onto the mirror costs more than it seemed."""


def test_none_of_the_layouts_gets_worse_and_all_keep_their_couplings() -> None:
    cell = coupled_task(MIRRORED).cell
    problems = [problem for arm in cell.arms if (problem := reduced_problem(cell, arm)) is not None]
    followed = Followed.of(Scene.of(cell), problems)
    layouts, _ = sample_layouts(followed, 0.15, 0)
    found = polished(followed, layouts)
    assert np.all(np.diff(found.objective) >= 0.0)
    assert np.all(found.objective <= np.sort(layouts.objective)[:TAKEN] + 1e-12)
    for row in range(len(found)):
        assert followed.scene.tie_violation([own.point(row) for own in found.placements]) <= 1e-6
