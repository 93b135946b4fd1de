"""What mirrored yaws cost two parabolas, against a fine grid of yaws."""

from __future__ import annotations

import numpy as np

from duocell.models.cell.coupling import Mirror
from duocell.optimizer.certificate.pairs.mirrored_yaw import BestYaw, mirrored_cost


def test_the_cost_is_that_of_the_best_common_yaw() -> None:
    rng, angle = np.random.default_rng(1), 0.4
    best, radius = rng.uniform(-3.0, 3.0, (2, 40)), rng.uniform(0.0, 0.3, (2, 40))
    weights = 3.0, 7.0
    yaws = [BestYaw(best[k], radius[k], weights[k], np.zeros(len(best[k]))) for k in (0, 1)]
    found = mirrored_cost((Mirror((0, 1), (0.0, 0.0), angle),), (0, 1), yaws[0], yaws[1])
    grid = np.linspace(-2.0 * np.pi, 2.0 * np.pi, 20001)
    off = [grid, 2.0 * angle - grid]
    costs = []
    for k in range(40):
        turned = [np.abs((off[a] - best[a, k] + np.pi) % (2.0 * np.pi) - np.pi) - radius[a, k] for a in (0, 1)]
        costs.append(np.min(sum(p * np.maximum(t, 0.0) ** 2 for p, t in zip(weights, turned, strict=True))))
    assert np.all(found <= np.array(costs) + 1e-9)
    assert np.allclose(found, costs, atol=0.02)
    assert not mirrored_cost((), (0, 1), yaws[0], yaws[1]).any()


def test_nothing_is_known_of_yaws_that_are_not() -> None:
    unknown = BestYaw(np.zeros(2), np.full(2, np.inf), 1.0, np.zeros(2))
    known = BestYaw(np.ones(2), np.zeros(2), 1.0, np.zeros(2))
    assert not mirrored_cost((Mirror((0, 1), (0.0, 0.0), 0.0),), (0, 1), unknown, known).any()
