"""Cells of yaws cost no more than what joint 1 really costs there beyond the best yaw."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.rules import Rules
from duocell.optimizer.certificate.bounds.yaw import Shifts
from duocell.optimizer.certificate.exclusion.yaw_cells import yaw_cells
from tests.support.present import present

WINDINGS = TURN * np.arange(-3, 4)


def _rules(rng: np.random.Generator, free: bool, counts: Floats) -> Rules:
    lower = rng.uniform(-7.0, -2.0)
    return Rules(
        lower=np.full(6, lower),
        upper=np.full(6, lower + rng.uniform(4.0, 12.0)),
        reference=rng.uniform(-1.5, 1.5, 6),
        weights=rng.uniform(0.5, 2.0, 6),
        max_step=1.0,
        shifts=Shifts(float(rng.uniform(-3.0, 3.0)), float(rng.uniform(0.1, 6.0)), free),
        segments=(slice(0, len(counts)),),
        joined=np.ones(len(counts) - 1, dtype=np.bool_),
        counts=counts,
    )


def _costs(path: Floats, rules: Rules, shifts: Floats) -> Floats:
    """What joint 1 costs on a path (m,) shifted by (k,), on the best turn; inf where no turn keeps the limits."""
    turned = path + (shifts[:, None] + WINDINGS)[..., None]
    inside = np.all((turned >= rules.lower[0]) & (turned <= rules.upper[0]), axis=2)
    each = rules.weights[0] * (turned - rules.reference[0]) ** 2 @ present(rules.counts)
    least: Floats = np.min(np.where(inside, each, np.inf), axis=1)
    return least


def _best(path: Floats, rules: Rules) -> float:
    """What joint 1 costs at least, over all yaws and turns; inf where none keeps the limits."""
    start, width = (-50.0, 100.0) if rules.shifts.free else (rules.shifts.start, rules.shifts.width)
    costs, counts = [np.inf], present(rules.counts)
    for winding in WINDINGS:
        low = max(start + winding, rules.lower[0] - float(np.min(path)))
        high = min(start + width + winding, rules.upper[0] - float(np.max(path)))
        if low <= high:
            shift = np.clip(rules.reference[0] - path @ counts / np.sum(counts), low, high)
            costs.append(rules.weights[0] * (path + shift - rules.reference[0]) ** 2 @ counts)
    return float(np.min(costs))


def test_no_yaw_costs_less_beyond_the_best_than_its_cell_says() -> None:
    rng = np.random.default_rng(5)
    checked, told = 0, 0
    for number in range(300):
        m = int(rng.integers(2, 7))
        rules = _rules(rng, number % 3 == 0, rng.uniform(0.2, 2.0, m))
        centre, radius = np.cumsum(rng.uniform(-0.4, 0.4, m)) + rng.uniform(-3.0, 3.0), rng.uniform(0.0, 0.2, m)
        cells = yaw_cells(Ball(centre[None], radius[None]), rules, np.array([np.inf]))
        path = centre + radius * rng.uniform(-1.0, 1.0, m)
        best = _best(path, rules)
        if np.isinf(best):
            continue
        for cell in range(cells.shift.shape[1]):
            here = cells.shift[0, cell] + cells.half[0] * rng.uniform(-1.0, 1.0, 8)
            more = _costs(path, rules, here) - best
            assert np.all(more >= np.where(np.isinf(more), 0.0, cells.cost[0, cell]) - 1e-6)
            checked += int(np.sum(np.isfinite(more)))
            told += int(0.5 * np.min(more) < cells.cost[0, cell] < np.inf)
    assert checked > 10_000
    assert told > 500
