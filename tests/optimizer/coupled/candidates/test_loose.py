"""Ties that samples do not keep by themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from duocell.models.cell.coupling import Distance
from duocell.models.cell.surroundings import Surroundings
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.coupled.candidates.layouts import boxes_of
from duocell.optimizer.coupled.candidates.loose import LooseTies
from duocell.optimizer.coupled.candidates.unknowns import TiedUnknowns
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.verification.scene import Scene
from tests.support.given.cells import beam_pair
from tests.support.present import present


def test_no_layouts_are_moved_to_none() -> None:
    made = beam_pair(count=2)
    cell = replace(made.cell, surroundings=Surroundings(), couplings=(Distance((0, 1), 1.2, 1.2),))
    scene = Scene.of(cell)
    followed = Followed.of(scene, [present(reduced_problem(cell, arm)) for arm in cell.arms])
    ties = LooseTies.of(cell.couplings, followed.problems, TiedUnknowns.of(cell, boxes_of(followed)), 0.1)
    positions, good = ties.projected(np.zeros((0, 2, 3)))
    assert positions.shape == (0, 2, 3)
    assert good.shape == (0,)
