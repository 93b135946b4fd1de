"""Evenly spread points."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.sampling import even_points


@given(st.integers(1, 7), st.integers(1, 300), st.integers(0, 1000))
def test_points_lie_in_the_unit_cube_and_are_repeatable(dimension: int, count: int, seed: int) -> None:
    points = even_points(dimension, count, seed)
    assert points.shape == (count, dimension)
    assert points.min() >= 0.0
    assert points.max() < 1.0
    assert np.array_equal(points, even_points(dimension, count, seed))
    assert len(np.unique(points, axis=0)) == count
    with pytest.raises(ValueError, match="read-only"):
        points[0, 0] = 0.5


@pytest.mark.parametrize(("dimension", "count"), [(2, 128), (2, 256), (3, 256), (3, 1024), (4, 256)])
def test_points_are_more_even_than_chance(dimension: int, count: int) -> None:
    """In every coordinate, and the largest gap in space is smaller than that of independent draws."""
    probes = np.random.default_rng(99).random((400, dimension))

    def gap(points: Floats) -> float:
        return float(np.linalg.norm(probes[:, None] - points[None], axis=-1).min(axis=1).max())

    even, chance = [], []
    for seed in range(5):
        points = even_points(dimension, count, seed)
        for column in points.T:
            assert np.bincount((16 * column).astype(int), minlength=16).min() >= count / 32
        even.append(gap(points))
        chance.append(gap(np.random.default_rng(seed).random((count, dimension))))
    assert np.mean(even) < 0.95 * np.mean(chance)
