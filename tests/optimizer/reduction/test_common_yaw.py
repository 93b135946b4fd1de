"""The best common shift of several segments, against every turn and a fine grid of shifts."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.optimizer.reduction.common_yaw import SegmentShifts, Shifted
from tests.support.angles import TURN

TURNS = np.arange(-4, 5)
CASES, GRID = 60, 3001


def shifts(rng: np.random.Generator, segments: int, tight: bool) -> SegmentShifts:
    """One case with limits of all sorts; where they are tight there may be no shift at all."""
    wanted = rng.uniform(-6.0, 6.0, (segments, 1))
    low = wanted - rng.uniform(-1.0 if tight else 0.5, 2.0 if tight else 7.0, (segments, 1))
    high = low + rng.uniform(-0.5 if tight else 1.0, 2.0 if tight else 12.0, (segments, 1))
    if rng.random() < 0.3:
        low[0], high[0] = -np.inf, np.inf
    width = TURN if rng.random() < 0.4 else float(rng.choice([0.0, rng.uniform(0.0, TURN)]))
    weights = rng.choice([0.0, 0.5, 1.0, 4.0], segments)
    return SegmentShifts(wanted, weights, low, high, np.asarray(rng.uniform(-3.0, 3.0)), width)


def by_grid(given: SegmentShifts, least: Floats | None = None) -> tuple[float, float]:
    """Least cost, and least excess over the limits, of all turns on a fine grid of shifts."""
    y = float(given.start) + np.linspace(0.0, given.width, GRID)
    cost, excess = np.zeros(y.shape), np.zeros(y.shape)
    for b, weight in enumerate(given.weights):
        turns = np.array([k for k in TURNS if least is None or k >= least[b]])
        total = y + TURN * turns[:, None]
        over = np.maximum(given.low[b] - total, 0.0) + np.maximum(total - given.high[b], 0.0)
        cost += np.min(np.where(over <= 1e-12, weight * (total - given.wanted[b]) ** 2, np.inf), axis=0)
        excess += np.min(over, axis=0)
    return float(cost.min()), float(excess.min())


def cost_of(given: SegmentShifts, found: Shifted) -> float:
    total = found.yaw_shift + TURN * found.turns
    assert given.start - 1e-12 <= found.yaw_shift[0] <= given.start + given.width + 1e-12
    assert np.all(total >= given.low - 1e-9)
    assert np.all(total <= given.high + 1e-9)
    return float(np.sum(given.weights[:, None] * (total - given.wanted) ** 2))


@pytest.mark.parametrize(("segments", "tight"), [*product((2, 3), (False, True)), (5, False)])
def test_no_shift_is_cheaper_and_what_is_said_is_attained(segments: int, tight: bool) -> None:
    rng = np.random.default_rng(segments + 10 * tight)
    possible = 0
    for _ in range(CASES):
        given = shifts(rng, segments, tight)
        found, (least, excess) = given.best(), by_grid(given)
        if np.isinf(found.cost[0]):
            assert np.isinf(least)
            assert given.nearest().cost[0] <= excess + 1e-9
            continue
        possible += 1
        assert found.cost[0] == pytest.approx(cost_of(given, found), rel=1e-9, abs=1e-12)
        assert found.cost[0] <= least + 1e-9
        # the grid misses the minimum by at most half a step
        step = 0.5 * given.width / (GRID - 1)
        slope = 2.0 * np.sum(given.weights) * TURN
        assert np.isinf(least) or least <= found.cost[0] + slope * step + np.sum(given.weights) * step**2 + 1e-9
    assert CASES - possible > 20 if tight else possible > 20


def test_turns_can_be_asked_for() -> None:
    rng = np.random.default_rng(3)
    compared = 0
    for _ in range(CASES):
        given = shifts(rng, 3, False)
        best = given.best()
        if np.isinf(best.cost[0]):
            continue
        least, most = np.full((3, 1), -np.inf), np.full((3, 1), np.inf)
        least[1] = best.turns[1] + 1.0
        found = given.best(least, most)
        grid, _ = by_grid(given, least[:, 0])
        assert found.cost[0] <= grid + 1e-9
        assert found.cost[0] >= best.cost[0] - 1e-9
        if np.isfinite(found.cost[0]):
            compared += 1
            assert found.turns[1] >= least[1]
            assert found.cost[0] == pytest.approx(cost_of(given, found), rel=1e-9, abs=1e-12)
    assert compared > 10


def test_many_cases_at_once_are_those_one_by_one() -> None:
    rng = np.random.default_rng(5)
    cases = [shifts(rng, 2, False) for _ in range(20)]
    joined = SegmentShifts(
        wanted=np.concatenate([case.wanted for case in cases], axis=1),
        weights=cases[0].weights,
        low=np.concatenate([case.low for case in cases], axis=1),
        high=np.concatenate([case.high for case in cases], axis=1),
        start=np.array([float(case.start) for case in cases]),
        width=TURN,
    )
    found = joined.best()
    for k, case in enumerate(cases):
        alone = SegmentShifts(case.wanted, joined.weights, case.low, case.high, case.start, TURN).best()
        assert found.cost[k] == pytest.approx(alone.cost[0], rel=1e-12)
