"""How distances change when the arms move: the rows that stand for pairs of bodies in a smooth program."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints, set_frozen
from duocell.models.collision.collision import CollisionModel, Configurations, Contact
from duocell.models.collision.collision_bodies import Owner


@dataclass(frozen=True, eq=False)
class ContactGradients:
    """Derivatives of the distances of C contacts.

    Attributes:
        joints: per arm (C, n) m/rad, m/m for a joint that shifts.
        bases: (C, A, 4) by x, y, z of each base origin in the world [m/m] and by its yaw [m/rad]; the yaw turns about
            the base's own z axis, the world's vertical for an arm on the floor.
        object: (C, 6) by the object's position in the world [m/m] and by its rotation about world axes through its
            origin [m/rad].
    """

    joints: tuple[Floats, ...]
    bases: Floats
    object: Floats

    def __post_init__(self) -> None:
        set_frozen(self, "bases", self.bases, (None, None, 4))
        set_frozen(self, "object", self.object, (None, 6))


def contact_gradients(
    model: CollisionModel, configurations: Configurations, places: Ints, contacts: Sequence[Contact], bases: Floats
) -> ContactGradients:
    """Derivatives of ``contact.distance``, at fixed witness points.

    The nearest points of convex bodies slide at right angles to the normal, so to first order they may be taken as
    fixed to their bodies: ``d' = normal · (v(point_second) - v(point_first))``. Where the nearest points are not unique
    (parallel faces) it is one of the directional derivatives.

    Args:
        model: the model. configurations: that the contacts were found in. places: (C,) the configuration of each.
        contacts: from `CollisionModel.contact`. bases: (A, 4, 4) base of each arm in the world.
    """
    normals = np.array([c.normal for c in contacts]).reshape(-1, 3)
    count = len(contacts)
    joints = [np.zeros((count, arm.dof)) for arm in model.arms]
    by_base: Floats = np.zeros((count, len(model.arms), 4))
    by_object: Floats = np.zeros((count, 6))
    for owners, points, sign in (
        ([c.first_owner for c in contacts], [c.point_first for c in contacts], -1.0),
        ([c.second_owner for c in contacts], [c.point_second for c in contacts], 1.0),
    ):
        where, push = np.array(points).reshape(-1, 3), sign * normals
        carried = np.flatnonzero([owner.part for owner in owners])
        away = where[carried] - configurations.frames[places[carried], 1, :3, 3]
        by_object[carried] += np.concatenate([push[carried], _cross(away, push[carried])], axis=1)
        for a, arm in enumerate(model.arms):
            some = np.flatnonzero([owner.arm == a for owner in owners])
            at, along = where[some], push[some]
            by_base[some, a, :3] += along
            by_base[some, a, 3] += _cross(at - bases[a, :3, 3], along) @ bases[a, :3, 2]
            start = model.offsets[a] + 1
            links = configurations.frames[places[some], start : start + arm.dof]
            axes = np.einsum("ciab,ib->cia", links[..., :3, :3], arm.robot.joint_axes)
            turned = np.sum(axes * _cross(at[:, None] - links[..., :3, 3], along[:, None]), axis=-1)
            if arm.robot.slides:
                turned = np.where(arm.robot.prismatic, np.sum(axes * along[:, None], axis=-1), turned)
            joints[a][some] += np.where(_moves(owners, some, arm.dof), turned, 0.0)
    for rows in joints:
        rows.setflags(write=False)
    return ContactGradients(tuple(joints), by_base, by_object)


def _moves(owners: Sequence[Owner], some: Ints, dof: int) -> np.ndarray:
    """(k, n) True where joint i carries the link that owns the body."""
    links = np.array([owners[i].link or 0 for i in some], dtype=np.int64)
    return np.arange(dof) < links[:, None]


def _cross(first: Floats, second: Floats) -> Floats:
    """``first × second`` along the last axis; `numpy.cross` takes far longer over its axes than over its numbers."""
    x, y, z = first[..., 0], first[..., 1], first[..., 2]
    u, v, w = second[..., 0], second[..., 1], second[..., 2]
    return np.stack([y * w - z * v, z * u - x * w, x * v - y * u], axis=-1)
