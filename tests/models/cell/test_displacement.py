"""Displacements against SciPy's rotations, their derivatives against differences, their symbols against numbers."""

import casadi as ca
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from duocell.models.base.arrays import Floats
from duocell.models.cell.displacement import displaced, displaced_symbols, displacement_twists

CONES = np.array([0.3, 1.2, 2.9, 3.1])


def drawn(seed: int, count: int = 64) -> tuple[Floats, Floats]:
    """Parameters and cones."""
    rng = np.random.default_rng(seed)
    cone = CONES[np.arange(count) % len(CONES)]
    full = rng.uniform(-1.0, 1.0, (count, 8))
    full[:, 3:5] *= 0.98 * cone[:, None]
    full[:, 7] *= 3.0 * np.pi
    return full, cone


def test_turns_and_shifts_are_those_of_scipy() -> None:
    full, cone = drawn(1)
    full[:, 3:5] = 0.0
    found = displaced(full, cone)
    turns = Rotation.from_euler("XYZ", full[:, 5:]).as_matrix()  # about the turned axes
    assert np.allclose(found[:, :3, :3], turns, atol=1e-14)
    assert np.array_equal(found[:, :3, 3], full[:, :3])


def test_the_tilt_takes_the_axis_anywhere_in_the_cone_and_nowhere_else_by_the_shortest_turn() -> None:
    full, cone = drawn(2, 4000)
    full[:, 3:5] *= 1.0 / 0.98
    full[:, 5:] = 0.0
    edge = np.random.default_rng(3).integers(0, 2, len(full)) == 0
    full[edge, 3] = np.sign(full[edge, 3]) * cone[edge]
    turns = Rotation.from_matrix(displaced(full, cone)[:, :3, :3])
    angle = np.arccos(np.clip(turns.as_matrix()[:, 2, 2], -1.0, 1.0))
    assert np.all(angle <= cone + 1e-7)
    assert np.allclose(angle[edge], cone[edge], atol=1e-7)
    vectors = turns.as_rotvec()
    assert np.allclose(np.linalg.norm(vectors, axis=1), angle, atol=1e-7)  # no part about the axis itself
    for one in CONES:  # some draw comes near to every direction of the cone
        own = cone == one
        wanted = np.stack([np.sin(0.7 * one), 0.0, np.cos(0.7 * one)])
        assert np.max(turns.as_matrix()[own][:, :, 2] @ wanted) > np.cos(0.25 * one)


@pytest.mark.parametrize("parameter", range(8))
def test_twists_are_the_derivatives(parameter: int) -> None:
    full, cone = drawn(4)
    points = np.random.default_rng(5).uniform(-1.0, 1.0, (len(full), 3))
    linear, angular = displacement_twists(full, cone, points)
    step = np.zeros(8)
    step[parameter] = 1e-6
    ahead, behind = displaced(full + step, cone), displaced(full - step, cone)
    here = displaced(full, cone)
    moved = (np.einsum("mij,mj->mi", (ahead - behind)[:, :3, :3], points) + (ahead - behind)[:, :3, 3]) / 2e-6
    assert np.allclose(linear[:, :, parameter], moved, atol=2e-8)
    spin = (ahead - behind)[:, :3, :3] @ here[:, :3, :3].swapaxes(1, 2) / 2e-6
    turned = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
    assert np.allclose(angular[:, :, parameter], turned, atol=2e-8)


@pytest.mark.parametrize("which", [(7,), (0, 2), (3, 4, 7), (0, 1, 2, 5, 6, 7), tuple(range(8))])
def test_symbols_are_the_numbers(which: tuple[int, ...]) -> None:
    full, cone = drawn(6, 8)
    full[:, [i for i in range(8) if i not in which]] = 0.0
    values, alpha = ca.SX.sym("values", len(which)), ca.SX.sym("cone")
    function = ca.Function("displaced", [values, alpha], [*displaced_symbols(which, values, alpha)])
    found = displaced(full, cone)
    for k in range(len(full)):
        rotation, position = function(full[k, list(which)], cone[k])
        assert np.allclose(np.asarray(rotation), found[k, :3, :3], atol=1e-14)
        assert np.allclose(np.asarray(position).ravel(), found[k, :3, 3], atol=1e-14)


def test_without_a_cone_there_is_no_tilt() -> None:
    values, alpha = ca.SX.sym("values", 2), ca.SX.sym("cone")
    rotation, _ = displaced_symbols((3, 4), values, alpha)
    slopes = ca.jacobian(ca.vec(rotation), values)
    function = ca.Function("tilt", [values, alpha], [rotation, slopes])
    found, derivative = function(np.zeros(2), 0.0)
    assert np.array_equal(np.asarray(found), np.eye(3))
    assert np.all(np.isfinite(np.asarray(derivative)))
    assert np.array_equal(displaced(np.zeros((1, 8)), np.zeros(1))[0], np.eye(4))
