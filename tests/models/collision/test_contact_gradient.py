"""Derivatives of distances against finite differences."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.pose import rotation_about, rotation_x, rotation_z, transform
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel
from duocell.models.collision.contact_gradient import contact_gradients
from tests.support.given.cells import beam_pair, random_obstacles

SCENE = beam_pair(obstacles=random_obstacles(np.random.default_rng(5), 6, [-1.5, -1.0, 0.2], [1.5, 1.5, 1.5]))
MODEL = CollisionModel(SCENE.cell.arms, SCENE.surroundings)
STEP = 1e-5


def base_at(mount: Floats, placement: Floats) -> Floats:
    """x, y, z and yaw about the base's own z axis, on a fixed mount."""
    return transform(mount @ rotation_z(placement[3]), placement[:3])


def sampled_pairs(rng: np.random.Generator, count: int = 60) -> Ints:
    """Pairs of every class."""
    kinds = np.array(MODEL.bodies.kinds)
    return np.concatenate([rng.permutation(np.flatnonzero(kinds == kind))[: count // 5] for kind in PairClass])


@pytest.mark.parametrize("mount", [np.eye(3), rotation_x(0.7)], ids=["floor", "slope"])
def test_derivatives_are_those_of_finite_differences(mount: Floats) -> None:
    rng = np.random.default_rng(11)
    places = np.array([[-0.6, 0.05, 0.31, 1.5], [0.6, -0.03, 0.32, 1.7]])
    joints = [q[2] + rng.uniform(-0.1, 0.1, q.shape[1]) for q in SCENE.joints]
    pose = SCENE.cell.task.poses[2]

    def distance(pair: int, places: Floats, joints: Sequence[Floats], pose: Floats) -> float:
        bases = np.stack([base_at(mount, place) for place in places])
        return MODEL.contact(MODEL.configure(bases, [q[None] for q in joints], pose[None]), 0, pair).distance

    bases = np.stack([base_at(mount, place) for place in places])
    here = MODEL.configure(bases, [q[None] for q in joints], pose[None])
    compared = smooth = 0
    for pair in sampled_pairs(rng):
        contact = MODEL.contact(here, 0, int(pair))
        gradient = contact_gradients(MODEL, here, np.array([0]), [contact], bases)
        ways = []
        for a in range(2):
            joint, axis = rng.integers(joints[a].size), rng.integers(4)
            q, place = np.zeros_like(joints[a]), np.zeros((2, 4))
            q[joint], place[a, axis] = STEP, STEP
            turned = [[x + s * q * (i == a) for i, x in enumerate(joints)] for s in (1, -1)]
            ways.append((gradient.joints[a][0, joint], [(places, moved, pose) for moved in turned]))
            ways.append((gradient.bases[0, a, axis], [(places + s * place, joints, pose) for s in (1, -1)]))
        way = rng.normal(size=3)
        way /= np.linalg.norm(way)
        shifted = [pose + s * STEP * np.pad(way[:, None], ((0, 1), (3, 0))) for s in (1, -1)]
        ways.append((gradient.object[0, :3] @ way, [(places, joints, moved) for moved in shifted]))
        spun = [transform(rotation_about(way, s * STEP) @ pose[:3, :3], pose[:3, 3]) for s in (1, -1)]
        ways.append((gradient.object[0, 3:] @ way, [(places, joints, moved) for moved in spun]))
        for expected, (plus, minus) in ways:
            ahead, behind = distance(int(pair), *plus), distance(int(pair), *minus)
            compared += 1
            if abs(ahead + behind - 2.0 * contact.distance) < 1e-7:  # else a kink, another nearest point
                smooth += 1
                assert (ahead - behind) / (2.0 * STEP) == pytest.approx(expected, abs=2e-3)
    assert smooth > 0.9 * compared


def test_a_contact_without_arms_moves_with_the_object_alone() -> None:
    contact = MODEL.contacts(SCENE.bases, [q[0] for q in SCENE.joints], SCENE.cell.task.poses[0])[
        PairClass.PART_OBSTACLE
    ]
    here = MODEL.configure(SCENE.bases, [q[:1] for q in SCENE.joints], SCENE.cell.task.poses[:1])
    gradient = contact_gradients(MODEL, here, np.array([0]), [contact], SCENE.bases)
    assert not np.any(gradient.bases)
    assert not any(np.any(row) for row in gradient.joints)
    assert np.linalg.norm(gradient.object[0, :3]) == pytest.approx(1.0)


def test_self_distances_do_not_depend_on_the_base() -> None:
    contact = MODEL.contacts(SCENE.bases, [q[0] for q in SCENE.joints], SCENE.cell.task.poses[0])[PairClass.SELF]
    here = MODEL.configure(SCENE.bases, [q[:1] for q in SCENE.joints], SCENE.cell.task.poses[:1])
    gradient = contact_gradients(MODEL, here, np.array([0]), [contact], SCENE.bases)
    assert np.allclose(gradient.bases, 0.0, atol=1e-6)
    arm = contact.first_owner.arm
    assert arm is not None
    assert np.any(gradient.joints[arm])
    assert np.allclose(gradient.joints[arm][0, 0], 0.0, atol=1e-6)  # joint 1 turns both bodies together
