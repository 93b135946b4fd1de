"""The numbers of the search: every one is explained, and those that are handed in are the ones that count."""

from __future__ import annotations

import re
from dataclasses import FrozenInstanceError, fields, replace
from time import perf_counter

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.optimizer.parameters.coupled import CoupledParameters, Pairing
from duocell.optimizer.parameters.local import LocalParameters
from duocell.optimizer.parameters.refinement import RefinementParameters
from duocell.optimizer.parameters.screening import ScreeningParameters
from duocell.optimizer.parameters.search import SEARCH, SearchParameters
from duocell.optimizer.parameters.unreduced import UnreducedParameters
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.sqp.descent import Terms, descend
from duocell.optimizer.verification.scene import Scene
from tests.support.given.tasks import possible

STAGES = (
    ScreeningParameters,
    LocalParameters,
    UnreducedParameters,
    Pairing,
    CoupledParameters,
    RefinementParameters,
    SearchParameters,
)


@pytest.mark.parametrize("stage", STAGES)
def test_every_number_is_explained(stage: type) -> None:
    explained = re.split(r"Attributes:", stage.__doc__ or "")[1]
    assert [one.name for one in fields(stage) if not re.search(rf"\b{one.name}\b", explained)] == []


def test_numbers_stay_what_they_are() -> None:
    with pytest.raises(FrozenInstanceError):
        SEARCH.local.starts = 9  # type: ignore[misc]
    assert Settings().parameters == SearchParameters()


def small_cell() -> Cell:
    return possible("ur5e", np.random.default_rng(1), poses=4, step=0.08).cell


def test_a_search_looks_at_as_many_bases_as_it_is_told() -> None:
    cell = small_cell()
    looked_at = []
    for points in (64, 128):
        own = replace(SEARCH, screening=replace(SEARCH.screening, points=(1, points, points, points)))
        settings = Settings(certificate=None, parameters=own)
        looked_at.append(search_arm(cell, cell.arms[0], settings, perf_counter() + 60.0).candidates)
    assert looked_at[1] == 2 * looked_at[0]


def test_a_search_solves_no_more_often_than_it_is_told() -> None:
    cell = small_cell()
    none = replace(SEARCH, local=replace(SEARCH.local, starts=0, deeper=0.0, decide_worth=0.0, early_worth=0.0))
    usual = search_arm(cell, cell.arms[0], Settings(certificate=None), perf_counter() + 60.0)
    without = search_arm(cell, cell.arms[0], Settings(certificate=None, parameters=none), perf_counter() + 60.0)
    assert usual.starts > without.starts


def test_a_descent_solves_no_more_programs_than_it_is_told() -> None:
    task = possible("ur5e", np.random.default_rng(1), poses=4, step=0.08)
    found = search_arm(task.cell, task.arm, Settings(certificate=None), perf_counter() + 60.0)
    assert found.best is not None
    scene = Scene.of(task.cell)
    rounds = []
    for most in (1, 3):
        own = replace(SEARCH.refinement, rounds=most)
        terms = Terms(scene, {}, 1.0, -np.inf, perf_counter() + 60.0, (), np.inf, own)
        rounds.append(descend(terms, terms.seen((found.best,)))[1])
    assert rounds == [1, 3]
