"""A planted conflict is broken by the known layout for that reason alone, and explained by it."""

from __future__ import annotations

from bench.conflicts.planted_conflicts import amount_of, attempt, needed, planted, remedy_of
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.verification.scene import Scene
from tests.support.present import present

REGION = 2


def test_the_known_layout_is_clean_once_the_planted_constraint_is_loosened() -> None:
    made = planted(REGION)
    remedy = present(remedy_of(made))
    least = present(needed(made, remedy))
    assert not clean(Scene.of(made.cell), made.known)
    assert clean(Scene.of(remedy.change(least)), made.known)
    assert abs(amount_of(remedy.words(0.25), remedy) - 0.25) < 1e-9


def test_a_region_out_of_reach_is_named_and_moved_no_farther_than_needed() -> None:
    record = attempt(REGION)
    assert record["word"] == "infeasible"
    assert [record[name] for name in ("named", "works", "near")] == [True, True, True]
