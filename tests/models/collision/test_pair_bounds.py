"""Bounds of single pairs and of near pairs, against those of all pairs."""

from __future__ import annotations

import numpy as np
import pytest

from bench.draws.beam import beam_cell
from duocell.models.collision.collision import CollisionModel, Configurations
from duocell.models.collision.pair_bounds import PairBounds


@pytest.fixture(scope="module")
def placed() -> tuple[CollisionModel, Configurations]:
    cell, rng = beam_cell(), np.random.default_rng(3)
    model = CollisionModel(cell.arms, cell.surroundings)
    bases = np.stack(
        [arm.base_in_world(np.array([x, 0.1, 0.6]), 0.3) for arm, x in zip(cell.arms, (-1.0, 0.9), strict=True)]
    )
    joints = [rng.uniform(-2.5, 2.5, (len(cell.task), 6)) for _ in cell.arms]
    return model, model.configure(bases, joints, cell.task.poses)


def test_single_pairs_are_bounded_as_in_company(placed: tuple[CollisionModel, Configurations]) -> None:
    model, places = placed
    every = np.ones(len(model.bodies.first), dtype=bool)
    bounds = PairBounds(model.bodies)
    dense = bounds(places.frames, places.ends, every)
    k, pairs = (index.ravel() for index in np.indices(dense.shape))
    assert bounds.of_pairs(places.frames, places.ends, k, pairs).reshape(dense.shape) == pytest.approx(dense, abs=1e-12)


def test_what_is_near_is_bounded_as_ever_and_the_rest_from_below_but_beyond(
    placed: tuple[CollisionModel, Configurations],
) -> None:
    model, places = placed
    rng = np.random.default_rng(4)
    wanted = rng.random(len(model.bodies.first)) < 0.7
    enough = rng.uniform(0.0, 0.4, len(wanted))
    bounds = PairBounds(model.bodies)
    dense = bounds(places.frames, places.ends, wanted)
    rough = bounds.up_to(places.frames, places.ends, wanted, enough)
    near = rough <= enough
    assert np.any(near & wanted)
    assert rough[near] == pytest.approx(dense[near], abs=1e-12)
    assert np.all(np.isinf(rough[:, ~wanted]))
    k, pairs = np.nonzero(~near & wanted)
    some = rng.permutation(len(k))[:400]
    real = np.array([model.contact(places, int(k[i]), int(pairs[i])).distance for i in some])
    assert np.all(real >= rough[k[some], pairs[some]] - 1e-9)
