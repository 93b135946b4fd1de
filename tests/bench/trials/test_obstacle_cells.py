"""Cells have the layout they were drawn around, and the long search among obstacles finds clean better ones."""

from __future__ import annotations

import numpy as np
import pytest

from bench.comparison.real_cells import energy
from bench.judges.dense_check import dense_check
from bench.judges.dense_rules import coupling_excess
from bench.searches.obstructed_search import obstructed_search
from bench.searches.own_ties import FreeBases, free_bases
from bench.trials.obstacle_cells import obstacle_cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, SameHeight


def test_a_cell_is_always_the_same_and_its_layout_works() -> None:
    one, again = obstacle_cell(0), obstacle_cell.__wrapped__(0)
    assert (one.known.stands == again.known.stands).all()
    assert 2 <= len(one.cell.surroundings.obstacles) <= 8
    assert dense_check(one.cell, one.known.stands, one.known.joints, 0.01, 0.05).faults == []


def test_a_descent_from_the_drawn_layout() -> None:
    task = obstacle_cell(0)
    found = obstructed_search(task.cell, task.scale, 1.0, np.random.default_rng(0), [task.known.stands])
    assert found.layout is not None
    assert found.objective is not None
    assert found.objective < energy(task.cell, task.known)
    assert found.objective == pytest.approx(energy(task.cell, found.layout))
    assert dense_check(task.cell, found.layout.stands, found.layout.joints, 0.01, 0.05).faults == []


@pytest.mark.parametrize(
    ("tie", "count"),
    [
        (None, 6),
        (SameHeight((0, 1)), 5),
        (Distance((0, 1), 0.1, 0.5), 6),
        (Direction((0, 1), 0.3), 5),
        (Rail((0, 1), 0.4), 4),
        (Mirror((0, 1), (0.1, 0.2), 0.7), 4),
    ],
)
def test_free_numbers_are_those_of_the_bases(tie: Coupling | None, count: int) -> None:
    cell = obstacle_cell(0).cell
    free = free_bases(cell)
    free = FreeBases(free.cell, tie, np.tile([-4.0, 4.0], (count, 1)))
    numbers = np.full((1, count), 0.25)
    places, yaws, _ = free.places(numbers)
    stands = np.column_stack([places[:, 0], np.zeros(2) if yaws is None else yaws[:, 0]])
    assert tie is None or coupling_excess(tie, stands) < 1e-9
    np.testing.assert_allclose(free.numbers_of(stands), numbers[0], atol=1e-12)
