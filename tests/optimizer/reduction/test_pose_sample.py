"""Samples of poses: the same for a segment and its reverse, with the weight of what they stand for."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, rotation_z
from duocell.optimizer.reduction.pose_sample import sample_segment


def way(poses: int, seed: int) -> tuple[Floats, Floats]:
    """Rotations (m, 3, 3) and positions (m, 3) of an uneven way."""
    rng = np.random.default_rng(seed)
    positions = np.cumsum(rng.exponential(0.02, (poses, 3)), axis=0)
    return rotation_about(rng.normal(size=3), np.cumsum(rng.exponential(0.02, poses))), positions


@pytest.mark.parametrize("seed", range(4))
def test_a_sample_keeps_the_ends_and_the_whole_weight(seed: int) -> None:
    rotations, positions = way(60, seed)
    weights = np.random.default_rng(seed).uniform(0.0, 2.0, 60)
    chosen, own = sample_segment(rotations, positions, weights, 6)
    assert chosen[0] == 0
    assert chosen[-1] == 59
    assert np.all(np.diff(chosen) > 0)
    assert 6 <= len(chosen) <= 20
    assert np.sum(own) == pytest.approx(np.sum(weights))


@pytest.mark.parametrize("poses", [10, 24, 60])
def test_the_reverse_of_a_segment_is_sampled_at_the_same_poses(poses: int) -> None:
    even = np.tile(np.eye(3), (poses, 1, 1)), np.linspace([0.0, 0.0, 0.0], [0.4, 0.1, 0.1], poses)
    for rotations, positions in (even, way(poses, 1)):
        weights = np.ones(poses)
        chosen, own = sample_segment(rotations, positions, weights, 5)
        backwards, other = sample_segment(rotations[::-1], positions[::-1], weights, 5)
        assert np.array_equal(chosen, np.sort(poses - 1 - backwards))
        assert own == pytest.approx(other[::-1])


def test_a_sample_does_not_depend_on_where_the_world_has_its_axes() -> None:
    rotations, positions = way(80, 2)
    chosen, own = sample_segment(rotations, positions, np.ones(80), 7)
    turned, moved = rotation_z(np.pi / 2) @ rotations, positions @ rotation_z(np.pi / 2).T + [7.0, -3.0, 0.0]
    again, other = sample_segment(turned, moved, np.ones(80), 7)
    assert np.array_equal(chosen, again)
    assert own == pytest.approx(other)


@pytest.mark.parametrize("at", [0, 7, 13, 20])
def test_a_dwell_between_two_places_of_the_sample_is_in_it_with_its_weight(at: int) -> None:
    positions = np.linspace([0.0, 0.0, 0.0], [0.5, 0.0, 0.0], 21)
    dwell = np.concatenate([positions[:at], np.tile(positions[at], (300, 1)), positions[at + 1 :]])
    chosen, own = sample_segment(np.tile(np.eye(3), (320, 1, 1)), dwell, np.ones(320), 5)
    there = np.linalg.norm(dwell[chosen] - positions[at], axis=1) < 1e-9
    assert np.any(there)
    assert np.max(own[there]) >= 300.0 / np.sum(there)
    assert len(chosen) <= 8


def test_a_sample_stands_for_the_whole_in_a_weighted_sum() -> None:
    """A smooth function of the way, summed over the sample with its weights and over all poses."""
    rotations, positions = np.tile(np.eye(3), (400, 1, 1)), np.linspace([0.0, 0.0, 0.0], [0.5, 0.0, 0.0], 400)
    positions = np.concatenate([positions[:150], np.tile(positions[150], (300, 1)), positions[150:]])[:700]
    rotations = np.tile(np.eye(3), (700, 1, 1))
    chosen, own = sample_segment(rotations, positions, np.ones(700), 9)
    values = np.cos(4.0 * positions[:, 0])
    assert float(own @ values[chosen]) == pytest.approx(float(np.sum(values)), rel=0.02)
