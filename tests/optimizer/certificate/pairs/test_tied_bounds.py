"""Bounds of tied arms: below every layout that keeps the ties, and above the sum of what both arms cost alone."""

from __future__ import annotations

import numpy as np
import pytest

from bench.soundness.tied_soundness import attempt
from duocell.optimizer.certificate.pairs.mirrored_yaw import BestYaw
from duocell.optimizer.certificate.pairs.shared_yaw import HALF, cell_costs


@pytest.mark.parametrize(
    "number", [2, 9, 76, 80], ids=["rail", "direction", "mirror, free yaws", "mirror, bounded yaws"]
)
def test_no_usable_tied_layout_costs_less_than_the_bound(number: int) -> None:
    found = attempt(number, pairs=20)
    assert found["samples"] > 0
    assert found.get("wrong", 0) == 0
    assert found["raised"] > 0.3 * found["pairs"]
    if number in (2, 9):
        assert found.get("below", 0) == 0


def test_a_cell_of_the_shared_yaw_costs_the_least_of_its_yaws() -> None:
    rng = np.random.default_rng(4)
    u, v = rng.uniform(-np.pi, np.pi, (2, 200, 8))
    one, other = (
        BestYaw(np.zeros(200), rng.uniform(0.0, 0.4, 200), float(rng.uniform(1, 9)), np.zeros(200)) for _ in "ab"
    )
    cost = cell_costs(u, v, one, other)
    t = np.linspace(-HALF, HALF, 401)
    ways = [np.abs(off[..., None] + sign * t) for off, sign in ((u, 1.0), (v, -1.0))]
    ways = [np.minimum(way, 2.0 * np.pi - way) for way in ways]
    parts = [
        best.weight * np.maximum(way - best.radius[:, None, None], 0.0) ** 2
        for way, best in zip(ways, (one, other), strict=True)
    ]
    least = np.min(parts[0] + parts[1], axis=2)
    assert np.all(cost <= least + 1e-9)
    inner = np.maximum(np.abs(u), np.abs(v)) < np.pi - HALF
    assert np.all(cost[inner] >= least[inner] - 0.05)


def test_what_is_not_known_costs_nothing() -> None:
    unknown = BestYaw(np.zeros(2), np.full(2, np.inf), 1.0, np.zeros(2))
    assert np.all(cell_costs(np.ones((2, 3)), np.ones((2, 3)), unknown, unknown) == 0.0)
