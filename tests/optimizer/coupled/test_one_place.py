"""Arms that stand in one place are never an answer, and what does not stand so costs nothing more."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import duocell.optimizer.optimize
from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Distance
from duocell.models.cell.coupling.apart import Apart
from duocell.models.cell.one_place import NEAREST
from duocell.models.robot.arm import BaseRegion
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.pairs.couplings import untied
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.infeasibility.immediate.immediate import immediate_infeasibility
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.progress.timetable import Timetable
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.sqp.refine import Refined
from tests.support.given.arms import only_at, region
from tests.support.given.blocked import carried, one_arm
from tests.support.present import present

LONG = Settings(time_limit=600.0)


def twins(base: BaseRegion | None = None, second: BaseRegion | None = None) -> Cell:
    """Two arms of one kind with one grasp and one region: alone, each of them stands best where the other one does."""
    cell = one_arm(task=carried(3), base=base)
    arm = cell.arms[0]
    other = replace(arm, name="other", base=second or arm.base)
    return replace(cell, arms=(arm, other))


def apart(layout: Layout) -> float:
    one, other = (placement.position for placement in layout.placements)
    return float(np.linalg.norm(one - other))


def test_two_arms_that_would_stand_in_one_place_are_searched_together() -> None:
    cell = twins()
    layout = optimize(cell, LONG)
    assert layout.usable, layout.reasons
    assert apart(layout) >= NEAREST - 1e-6
    alone = optimize(replace(cell, arms=cell.arms[:1]), LONG)
    assert layout.certificate is not None
    assert present(layout.certificate.lower_bound) <= present(layout.objective)
    asked = optimize(replace(cell, couplings=(Distance((0, 1), NEAREST),)), LONG)
    assert 2.0 * present(alone.objective) - 1e-9 <= present(layout.objective) <= present(asked.objective) * (1.0 + 1e-3)
    seen = evaluate_layout(_placed(cell, layout))
    assert seen.outcome is Outcome.FEASIBLE
    assert seen.objective == pytest.approx(layout.objective, rel=1e-6)


def _placed(cell: Cell, layout: Layout) -> Cell:
    arms = tuple(
        replace(arm, base=only_at(p.position, p.yaw)) for arm, p in zip(cell.arms, layout.placements, strict=True)
    )
    return replace(cell, arms=arms)


def test_an_evaluation_of_arms_in_one_place_says_so() -> None:
    layout = optimize(one_arm(task=carried(3)))
    one = layout.placements[0]
    cell = _placed(twins(), replace(layout, placements=(one, one)))
    seen = evaluate_layout(cell)
    assert (seen.outcome, seen.proved) == (Outcome.INFEASIBLE, True)
    (reason,) = seen.reasons
    assert reason.kind == "collision"
    assert "main and other stand in one place" in reason.detail
    assert reason.amount == pytest.approx(NEAREST)


def test_regions_that_leave_only_one_place_are_refused_with_a_proof() -> None:
    spot = region((-0.4, -0.39), (0.1, 0.11), (0.0, 0.0))
    layout = optimize(twins(spot, spot))
    assert (layout.outcome, layout.proved) == (Outcome.INFEASIBLE, True)
    assert "would stand in one place" in layout.reasons[0].detail
    wide = region((-0.4, -0.35), (0.1, 0.11), (0.0, 0.0))
    assert immediate_infeasibility(twins(wide, spot)) == ()


def test_what_stands_in_two_places_is_not_searched_again(monkeypatch: pytest.MonkeyPatch) -> None:
    cell = twins(region((-0.7, -0.2), (-0.7, 0.7)), region((0.2, 0.7), (-0.7, 0.7)))

    def never(*arguments: object, **named: object) -> None:
        raise AssertionError

    monkeypatch.setattr(duocell.optimizer.optimize, "search_coupled", never)
    assert apart(optimize(cell)) > NEAREST


def test_a_layout_that_only_the_proof_knows_is_no_answer_where_its_arms_stand_in_one_place() -> None:
    """The search of an arm may have been cut before it had a place: then nothing is there to search both from."""
    cell = twins()
    alone = optimize(replace(cell, arms=cell.arms[:1]), LONG).placements[0]
    point = ArmSolution(alone.position, alone.yaw, alone.joints)
    of_proof = Refined((point, point), 1.0, 0.0, True, None, 1)
    searches = [ArmSearch(cell.arms[0], best=point), ArmSearch(cell.arms[1])]
    table = Timetable([("together", 1.0)], np.inf)
    asked = LONG, np.inf, table
    _, left = duocell.optimizer.optimize._in_two_places(cell, searches, CoupledSearch([of_proof]), *asked)
    assert left is not None
    assert left.best is None


def test_boxes_that_lie_in_one_place_hold_no_pair() -> None:
    rng = np.random.default_rng(0)
    ties = (Apart((0, 1), NEAREST),)
    sides = np.column_stack([np.tile([-0.05, 0.05], (3, 1)), rng.uniform(0.0, 0.03, (3, 1))])
    first, second = (_boxes(rng, sides) for _ in range(2))
    lost = untied(ties, (0, 1), first, second)
    assert 0 < np.count_nonzero(lost) < len(lost)
    for _ in range(400):
        one, other = (box.centre + box.half * rng.uniform(-1.0, 1.0, box.half.shape) for box in (first, second))
        assert not np.any(lost & (np.linalg.norm(one - other, axis=1) >= NEAREST))


def _boxes(rng: np.random.Generator, sides: Floats) -> Boxes:
    centre = rng.uniform(sides[:, 0], sides[:, 1], (300, 3))
    half = np.repeat(rng.uniform(0.0, 0.02, (300, 1)), 3, axis=1)
    return Boxes(centre, half, np.zeros(300, dtype=np.int64))
