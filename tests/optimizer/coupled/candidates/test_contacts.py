"""What collides surely, against Coal: capsules lie inside of their bodies, and nothing that is clear is thrown out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.pose import transform
from duocell.models.cell.surroundings import PairClass
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, Shape, Sphere
from duocell.models.kinematics.link_frames import link_frames
from duocell.optimizer.coupled.candidates.contacts import SomePairs, inner_capsule
from duocell.optimizer.verification.scene import Scene
from tests.support.given.cells import beam_pair
from tests.support.present import present

POST = Body("post", np.eye(4), Cylinder(0.15, 2.0))
CRATE = Body("crate", transform(np.eye(3), [0.5, -0.4, 0.3]), Box(np.ones(3)))


@pytest.mark.parametrize(
    "shape",
    [
        Sphere(0.2),
        Capsule(0.1, 0.7),
        Cylinder(0.1, 0.7),
        Cylinder(0.4, 0.1),
        Box(np.array([0.1, 0.4, 0.7])),
        ConvexHull(np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 0.5, 0], [0, 0, 0.8]])),
    ],
    ids=lambda shape: type(shape).__name__,
)
def test_inner_capsules_lie_inside_of_their_bodies(shape: Shape) -> None:
    """Points on the balls at both ends, by the definition of each shape; all shapes are convex."""
    around = np.random.default_rng(1).normal(size=(200, 3))
    around /= np.linalg.norm(around, axis=1)[:, None]
    ends, radius = inner_capsule(shape)
    assert radius > 0.0
    for end in ends:
        x, y, z = (end + radius * around).T
        match shape:
            case Sphere(radius=r):
                outside = np.sqrt(x * x + y * y + z * z) - r
            case Capsule(radius=r, length=length):
                outside = np.sqrt(x * x + y * y + np.maximum(np.abs(z) - length / 2, 0.0) ** 2) - r
            case Cylinder(radius=r, length=length):
                outside = np.maximum(np.hypot(x, y) - r, np.abs(z) - length / 2)
            case Box(size=size):
                outside = np.max(np.abs(np.stack([x, y, z], axis=1)) - size / 2, axis=1)
            case _:
                outside = np.maximum(np.max(-np.stack([x, y, z]), axis=0), x + 2.0 * y + z / 0.8 - 1.0)
        assert np.max(outside) <= 1e-9


def test_pairs_never_violate_more_than_by_coal() -> None:
    made = beam_pair(count=3)
    around = replace(made.surroundings, obstacles=(*made.surroundings.obstacles, POST, CRATE))
    scene = Scene.of(replace(made.cell, surroundings=around))
    model, task, rng, seen = present(scene.model), made.cell.task, np.random.default_rng(2), 0
    wanted = np.array([kind is not PairClass.PART_OBSTACLE for kind in model.bodies.kinds])
    some = SomePairs.of(model, scene.required, wanted)
    for _ in range(15):
        bases, joints = made.bases.copy(), []
        for a in range(2):
            bases[a, :3, 3] += rng.uniform(-0.4, 0.4, 3)
            joints.append(made.joints[a][:1] + rng.uniform(-0.8, 0.8, 6))
        places = model.configure(bases, joints, task.poses[:1])
        frames = np.concatenate(
            [
                np.eye(4)[None],
                task.poses[:1],
                *(
                    base @ link_frames(arm.robot, q)[0]
                    for arm, base, q in zip(made.cell.arms, bases, joints, strict=True)
                ),
            ]
        )
        violations = some.violations(frames[None, some.frames], np.zeros(1, dtype=np.int64))[0]
        for violation, pair in zip(violations, some.pairs, strict=True):
            exact = scene.required[pair] - model.contact(places, 0, int(pair)).distance
            assert violation <= max(exact, 0.0) + 2e-6
            seen += violation > 0.0
    assert seen > 20
