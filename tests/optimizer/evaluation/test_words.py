"""The word of an evaluation: "infeasible" only where nothing else can be done from these bases, else "unknown"."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import SameHeight
from duocell.models.cell.surroundings import PairClass
from duocell.models.cell.task import Task
from duocell.models.collision.collision import Contact
from duocell.models.collision.collision_bodies import Owner
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.clearance import ClassClearance, LimitExcess, PathClearance
from duocell.optimizer.evaluation import evaluate
from duocell.optimizer.evaluation.evaluate import NOT_FOUND, evaluate_layout
from duocell.optimizer.evaluation.standing import Choice, Standing
from duocell.optimizer.evaluation.together import Together
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.layout import Outcome, Reason
from duocell.optimizer.verification.verify import ArmCheck
from tests.support.given.arms import make_arm, only_at

CELL = Cell(
    Task(np.tile(np.eye(4), (2, 1, 1))),
    tuple(make_arm("ur5e", name, only_at(np.array([x, 0.0, 0.0]), 0.0)) for name, x in (("one", 0.0), ("two", 1.0))),
)
BROKEN = Reason("one", "joint_limit", (1,), "one: beyond a limit", "elbow", 0.1, "rad")
KEPT = ArmCheck(0.0, 0.0, 0.0, -1.0, -1.0, -1.0, 0.0, 1.0)


def choice_of(arm: Arm, reasons: tuple[Reason, ...] = (), complete: bool = True, there: bool = True) -> Choice:
    """An arm with one path, or with none."""
    point = ArmSolution(np.array([arm.base.x.low, 0.0, 0.0]), 0.0, np.tile(arm.robot.reference, (2, 1)), (1, -1, 1))
    standing = Standing(arm, point, KEPT, 1.0, reasons, 3) if there else Standing(arm, None, None, np.inf, reasons, 3)
    return Choice((standing,), complete)


def path_of(owner: Owner, distance: float) -> PathClearance:
    """The check of a path: one pair of bodies, 10 mm asked for."""
    world = Owner(None, None, False)
    kind = PairClass.PART_OBSTACLE if owner.arm is None else PairClass.ARM_OBSTACLE
    up = np.array([0.0, 0.0, 1.0])
    contact = Contact(kind, distance, "a", "b", owner, world, np.zeros(3), np.zeros(3), up, 0)
    found = ClassClearance(kind, 0.01, distance, contact, 0, 0.0, distance)
    return PathClearance((found,), (), LimitExcess("one", "joint", 0, 0.0, -1.0), True, 1)


HAND, PART = Owner(0, 6, False), Owner(None, None, True)


@pytest.mark.parametrize(
    ("reasons", "complete", "path", "settled", "outcome"),
    [
        ((), True, None, True, Outcome.FEASIBLE),
        ((), False, path_of(HAND, 0.02), False, Outcome.FEASIBLE),
        ((BROKEN,), True, None, False, Outcome.INFEASIBLE),
        ((BROKEN,), False, None, False, Outcome.UNKNOWN),
        ((BROKEN,), False, None, True, Outcome.INFEASIBLE),
        ((), True, path_of(HAND, 0.0), False, Outcome.UNKNOWN),  # the arm alone could, and other postures may
        ((), True, path_of(HAND, 0.0), True, Outcome.INFEASIBLE),
        ((), False, path_of(PART, 0.0), False, Outcome.INFEASIBLE),  # no posture takes the part elsewhere
    ],
)
def test_the_word_is_no_stronger_than_what_was_looked_at(
    monkeypatch: pytest.MonkeyPatch,
    reasons: tuple[Reason, ...],
    complete: bool,
    path: PathClearance | None,
    settled: bool,
    outcome: Outcome,
) -> None:
    def chosen(cell: Cell, found: Sequence[Choice]) -> Together:
        return Together(tuple(choice.best for choice in found), cell.arms, path, settled)

    def choices(cell: Cell, arm: Arm) -> Choice:
        return choice_of(arm, reasons, complete) if arm.name == "one" else choice_of(arm)

    monkeypatch.setattr(evaluate, "together", chosen)
    monkeypatch.setattr(evaluate, "choices", choices)
    found = evaluate_layout(CELL)
    assert found.outcome is outcome
    assert found.proved == (outcome is Outcome.INFEASIBLE)
    assert (found.reasons[-1:] == (NOT_FOUND,)) == (outcome is Outcome.UNKNOWN)
    assert found.objective == pytest.approx(sum(placement.objective for placement in found.placements))
    assert [placement.arm for placement in found.placements] == ["one", "two"]
    assert found.search.candidates == 6
    assert bool(found.clearances) == (path is not None)


def test_bases_that_break_a_rule_decide_and_what_is_found_twice_is_told_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Whatever the arms may do; an arm without a path leaves the whole without an objective."""

    def chosen(cell: Cell, found: Sequence[Choice]) -> Together:
        return Together(tuple(choice.best for choice in found), cell.arms[1:], None, False)

    def choices(cell: Cell, arm: Arm) -> Choice:
        return choice_of(arm, (BROKEN, BROKEN), complete=False, there=arm.name == "two")

    monkeypatch.setattr(evaluate, "together", chosen)
    monkeypatch.setattr(evaluate, "choices", choices)
    low, high = CELL.arms
    high = replace(high, base=only_at(np.array([1.0, 0.0, 0.3]), 0.0))
    found = evaluate_layout(replace(CELL, arms=(low, high), couplings=(SameHeight((0, 1)),)))
    assert (found.outcome, found.proved, found.objective) == (Outcome.INFEASIBLE, True, None)
    assert [reason.kind for reason in found.reasons] == ["joint_limit", "coupling"]
    assert [placement.arm for placement in found.placements] == ["two"]
    assert found.verification is not None
