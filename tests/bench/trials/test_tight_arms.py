"""Tasks that are only just possible: a sample of the trial, and what it calls wrong."""

from __future__ import annotations

import numpy as np

from bench.searches.own_stands import own_stands, own_task
from bench.trials.tight_arms import attempt, tight_task, verdict


def test_what_is_known_to_be_possible_is_neither_denied_nor_bounded_away() -> None:
    """A joint is at its limit in a corner of the region and within it nowhere else."""
    record = attempt(30)
    assert verdict(record) == ""
    assert record["word"] == "optimal"
    assert record["bound"] <= record["known"] * (1.0 + 1e-6)


def test_a_task_is_drawn_by_its_number_and_has_little_to_spare() -> None:
    one, again = tight_task(2), tight_task(2)
    assert one.known == again.known
    assert one.cell.arms[0].base == again.cell.arms[0].base
    assert np.isfinite(one.known)
    base = one.cell.arms[0].base.bounds
    places = np.random.default_rng(0).uniform(base[:3, 0], base[:3, 1], (50, 3))
    seen = own_stands(own_task(one.cell, 0), places)
    assert np.all(seen.objective[seen.usable] >= one.known * (1.0 - 1e-2))


def test_wrong_words_are_told() -> None:
    right = {"word": "optimal", "objective": 2.0, "known": 2.0, "bound": 1.999, "detail": ""}
    assert verdict(right) == ""
    assert verdict(right | {"word": "infeasible", "objective": None}) == "WRONG NO"
    assert verdict(right | {"bound": 2.1}) == "WRONG BOUND"
    assert verdict(right | {"word": "unknown", "objective": None}) == "nothing found"
    assert verdict(right | {"objective": 2.1}) == "dearer"
