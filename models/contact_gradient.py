"""How a distance changes when the arms move: the row that stands for a pair of bodies in a smooth program."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import Floats, set_frozen
from models.collision import CollisionModel, Configurations, Contact
from models.collision_bodies import Owner


@dataclass(frozen=True, eq=False)
class ContactGradient:
    """Derivatives of a contact's distance.

    Attributes:
        joints: per arm (n,) m/rad.
        bases: (A, 4) by x, y, z of each base origin in the world [m/m] and by its yaw [m/rad]; the yaw turns about the
            base's own z axis, the world's vertical for an arm on the floor.
        object: (6,) by the object's position in the world [m/m] and by its rotation about world axes through its
            origin [m/rad].
    """

    joints: tuple[Floats, ...]
    bases: Floats
    object: Floats

    def __post_init__(self) -> None:
        set_frozen(self, "bases", self.bases, (None, 4))
        set_frozen(self, "object", self.object, (6,))


def contact_gradient(
    model: CollisionModel, configurations: Configurations, k: int, contact: Contact, bases: Floats
) -> ContactGradient:
    """Derivatives of ``contact.distance`` in configuration k, at fixed witness points.

    The nearest points of convex bodies slide at right angles to the normal, so to first order they may be taken as
    fixed to their bodies: ``d' = normal · (v(point_second) - v(point_first))``. Where the nearest points are not unique
    (parallel faces) it is one of the directional derivatives.

    Args:
        model: the model. configurations: that the contact was found in. k: likewise.
        contact: from `CollisionModel.contact`. bases: (A, 4, 4) base of each arm in the world.
    """
    frames = configurations.frames[k]
    joints = [np.zeros(arm.dof) for arm in model.arms]
    by_base: Floats = np.zeros((len(model.arms), 4))
    by_object: Floats = np.zeros(6)
    sides: tuple[tuple[Owner, Floats, float], ...] = (
        (contact.first_owner, contact.point_first, -1.0),
        (contact.second_owner, contact.point_second, 1.0),
    )
    for owner, point, sign in sides:
        push = sign * contact.normal
        if owner.part:
            by_object[:3] += push
            by_object[3:] += np.cross(point - frames[1, :3, 3], push)
        if owner.arm is None or owner.link is None:
            continue
        base, start = bases[owner.arm], model.offsets[owner.arm]
        by_base[owner.arm, :3] += push
        by_base[owner.arm, 3] += push @ np.cross(base[:3, 2], point - base[:3, 3])
        links = frames[start + 1 : start + 1 + owner.link]
        axes = np.einsum("iab,ib->ia", links[:, :3, :3], model.arms[owner.arm].robot.joint_axes[: owner.link])
        joints[owner.arm][: owner.link] += np.cross(axes, point - links[:, :3, 3]) @ push
    for row in joints:
        row.setflags(write=False)
    return ContactGradient(tuple(joints), by_base, by_object)
