"""What is inscribed in a body is inside of it: seen by Coal, from a ball grown by a hair."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from duocell.models.base.pose import transform
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, Shape, Sphere
from duocell.optimizer.certificate.exclusion.gap import gap, inside
from duocell.optimizer.certificate.exclusion.inscribed import (
    axis_capsules,
    axis_distance,
    edge_points,
    inner_capsules,
    radius_of,
)

SHAPES: tuple[Shape, ...] = (
    Box(np.array([0.4, 0.6, 1.0])),
    Box(np.array([1.2, 0.9, 0.02])),
    Sphere(0.5),
    Capsule(0.3, 0.8),
    Cylinder(0.4, 0.7),
    Cylinder(0.4, 0.1),
    ConvexHull(0.4 * np.random.default_rng(5).normal(size=(20, 3))),
)


@pytest.mark.parametrize("tilted", [False, True])
@pytest.mark.parametrize("shape", SHAPES, ids=lambda shape: type(shape).__name__)
def test_inscribed_things_are_inside(shape: Shape, tilted: bool) -> None:
    rng = np.random.default_rng(7)
    turn = Rotation.random(rng=rng).as_matrix() if tilted else np.eye(3)
    body = Body("body", transform(turn, [0.02, -0.03, 0.2]), shape)
    capsules, about_axis = inner_capsules(body), axis_capsules(body)
    assert capsules
    assert about_axis
    for capsule in capsules + about_axis:
        depths = -gap(shape, body.pose, capsule.centres())
        assert np.all(depths >= capsule.radius - 1e-9)
    for capsule in about_axis:
        assert np.all(capsule.ends[:, :2] == 0.0)
    edges = edge_points(body)
    assert np.all(np.abs(inside(shape, body.pose, edges)) < 1e-9)
    core = np.concatenate([edges, *(c.centres() for c in capsules)])
    assert np.all(np.hypot(core[:, 0], core[:, 1]) <= axis_distance(body) + 1e-9)
    assert np.all(np.linalg.norm(core - body.pose[:3, 3], axis=1) <= radius_of(shape) + 1e-9)


def test_a_body_beside_the_axis_has_no_capsule_on_it() -> None:
    beside = Body("pedestal", transform(np.eye(3), [0.2, 0.2, -0.3]), Box(np.array([0.2, 0.2, 0.6])))
    assert axis_capsules(beside) == []
