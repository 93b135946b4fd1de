r"""How far the bodies of an arm move while its base takes every place of a box: as a ball, and to first order.

For one posture and one pose, joints 2 to 6 and the azimuth of joint 1 in the world are functions of the base's place p;
all links but the base are fixed in the world whatever the yaw. Let c be the centre of the box, q_c the joints there and
``Δ_k >= |q_k(p) - q_k(c)|`` over the box. X is a point of link i (moved by joints 1 to i), ρ_k its distance from axis
k.

*Ball.* From the base outwards, move the base and turn joints 1, 2, ..., i, one after the other: when joint k turns, its
distance from X is made by joints that have not turned yet, so it is ρ_k exactly, and X moves by at most
``2 ρ_k sin(min(Δ_k, π)/2)``. Together with the way of the base, |h|, that bounds the motion of X. From the hand, which
the task holds in place, the same with joints 6, 5, ..., i+1 and no base. The smaller of the two counts. Both hold
wherever q_c is a configuration that has the hand on its target; the former for any q_c.

*First order.* Along the line from c to p, ``dX = dp + Σ_{k<=i} dq_k a_k x (X - o_k)``, and the second derivative by two
joints l <= k is ``a_l x (a_k x (X - o_k))``, no longer than R_k, the largest distance of X from axis k in the box: ρ_k
and what the joints between the axis and X move it. With ``g_k >= |dq_k|`` and ``e_k >= |d²q_k|/2`` over the box,

    X(p) in X(c) + G (p - c) + ball(Σ_k R_k (e_k + g_k²/2 + g_k Σ_{l<k} g_l)),   G = 1 + Σ_k a_k x (X - o_k) dq_k/dp,

and, as seen from the hand, the same with k > i and l > k, G being the same. This needs all joints to be differentiable
over the box.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.kinematics.kinematics import reach
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.arm import Arm
from duocell.optimizer.certificate.bounds.angles.expansion import enclose, expand
from duocell.optimizer.certificate.bounds.angles.joints import Kinematics
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.boxes import Boxes

ON_TARGET = 1e-6
"""m by which the hand may seem to be off its target at the centre of a box; twice as much is added to every motion."""
MOST = 1e3
"""rad; where a joint may change by more over a box, slopes say nothing."""


_BY_POSE = "joints", "first", "frames", "axes", "origins", "error", "change", "slopes", "largest", "rest", "regular"
_BY_BOX = (*_BY_POSE, "boxes", "half", "shift")
_ARRAYS = frozenset(_BY_BOX) - {"boxes", "first"}


@dataclass(frozen=True, eq=False, slots=True)
class Motion:
    """An arm at the centres of N boxes (yaw 0), and how its joints change over them, at m poses.

    Attributes:
        boxes: the boxes, in the world.
        joints: (N, m, 6) rad. first: (N, m) rad, joint 1 at yaw 0 over the box.
        frames: (N, m, 7, 4, 4) of the links in the world.
        axes: (N, m, 6, 3) directions of the joints in the world. origins: (N, m, 6, 3) m, points on them.
        error: (N, m) m, how far points of the hand are from where the task wants them.
        change: (N, m, 6) rad, Δ.
        slopes: (N, m, 6, K) rad/m, dq/dp at the centre. largest: (N, m, 6) rad, g. rest: (N, m, 6) rad, e.
        regular: (N, m) True where slopes, g and e mean something.
        half: (N, K) m, half sides along the directions of the slopes. unit: (3, K) these directions in the world.
        shift: (N,) m, |h|.
    """

    boxes: Boxes
    joints: Floats
    first: Ball
    frames: Floats
    axes: Floats
    origins: Floats
    error: Floats
    change: Floats
    slopes: Floats
    largest: Floats
    rest: Floats
    regular: Bools
    half: Floats
    unit: Floats
    shift: Floats

    def __len__(self) -> int:
        return len(self.shift)

    def __getitem__(self, rows: Ints | Bools) -> Motion:
        return replace(self, **{name: getattr(self, name)[rows] for name in _BY_BOX})

    def at_poses(self, poses: Ints) -> Motion:
        """The same at some of the poses."""
        return replace(self, **{name: getattr(self, name)[:, poses] for name in _BY_POSE})

    @staticmethod
    def joined(parts: Sequence[Motion]) -> Motion:
        """All boxes of several motions of one arm."""
        arrays = {name: np.concatenate([getattr(p, name) for p in parts]) for name in _BY_BOX if name in _ARRAYS}
        first = Ball(*(np.concatenate([getattr(p.first, name) for p in parts]) for name in ("centre", "radius")))
        return replace(parts[0], boxes=Boxes.joined([p.boxes for p in parts]), first=first, **arrays)

    def swings(self, box: Ints, pose: Ints, points: Floats) -> tuple[Floats, Floats, Floats]:
        """What the joints do to points (q, 3) m in boxes (q,) at poses (q,).

        Returns:
            (q, 6, 3) m, velocities a_k x (X - o_k) per radian; (q, 6) m, ρ_k; (q, 6) m, 2 ρ_k sin(min(Δ_k, π)/2).
        """
        velocity = np.cross(self.axes[box, pose], points[:, None] - self.origins[box, pose])
        distance = np.sqrt(np.einsum("qka,qka->qk", velocity, velocity))
        swing = 2.0 * distance * np.sin(0.5 * np.minimum(self.change[box, pose], np.pi))
        return velocity, distance, swing

    def ball(self, box: Ints, pose: Ints, points: Floats, link: Ints) -> Floats:
        """(q,) m; points (q, 3) of moving links (q,) do not move farther than this in boxes (q,) at poses (q,)."""
        return self._ball(box, pose, link, self.swings(box, pose, points)[2])

    def _ball(self, box: Ints, pose: Ints, link: Ints, swing: Floats) -> Floats:
        before = np.arange(6) < link[:, None]
        error = self.error[box, pose]
        outwards = self.shift[box] + np.sum(np.where(before, swing, 0.0), axis=1)
        inwards = np.sum(np.where(before, 0.0, swing), axis=1) + 2.0 * error
        moved: Floats = np.where(error < ON_TARGET, np.minimum(outwards, inwards), outwards)
        return moved

    def linear(self, box: Ints, pose: Ints, points: Floats, link: Ints) -> tuple[Floats, Floats, Floats]:
        """The motion of points (q, 3) of moving links (q,) in boxes (q,) at poses (q,): as a ball and to first order.

        Returns:
            (q,) m as from `ball`; (q, 3, K) slopes G of the point's place; (q,) m, what these leave out, inf where
            they mean nothing.
        """
        velocity, distance, swing = self.swings(box, pose, points)
        before = np.arange(6) < link[:, None]
        slopes = self.slopes[box, pose]
        moving = np.where(before[..., None], velocity, 0.0)
        gradient = self.unit + np.einsum("qka,qkK->qaK", moving, slopes)
        error = self.error[box, pose]
        g, e = self.largest[box, pose], self.rest[box, pose]
        outwards = _remainder(distance, np.where(before, swing, 0.0), np.where(before, g, 0.0), e, before)
        far, swung, g_back, e_back = (array[:, ::-1] for array in (distance, swing, g, e))
        after: Bools = ~before[:, ::-1]
        inwards = _remainder(far, np.where(after, swung, 0.0), np.where(after, g_back, 0.0), e_back, after)
        rest = np.minimum(outwards, inwards) + 2.0 * error
        known = self.regular[box, pose] & (error < ON_TARGET)
        return self._ball(box, pose, link, swing), gradient, np.where(known, rest, np.inf)


def _remainder(distance: Floats, swing: Floats, largest: Floats, rest: Floats, used: Bools) -> Floats:
    """(q,) m, the second-order rest of points moved by the used ones of joints (q, 6), which act from left to right.

    Args:
        distance: (q, 6) m, ρ. swing: (q, 6) m and largest: (q, 6) rad, g, both 0 for joints that are not used.
        rest: (q, 6) rad, e.
    """
    farthest = distance + np.sum(swing, axis=1, keepdims=True) - np.cumsum(swing, axis=1)
    earlier = np.cumsum(largest, axis=1) - largest
    with np.errstate(invalid="ignore"):  # an infinite rest of a joint that is not used
        each = np.where(used, farthest * (rest + 0.5 * largest**2 + largest * earlier), 0.0)
    total: Floats = np.sum(each, axis=1)
    return total


def motion(arm: Arm, kinematics: Kinematics, targets: Floats, boxes: Boxes) -> Motion:
    """Place an arm at the centres of boxes and bound what its joints do over them.

    Args:
        arm: the arm. kinematics: of it, for the same poses.
        targets: (m, 4, 4) of the flange in the world. boxes: in the world.
    """
    dims, upright = kinematics.targets.dims, kinematics.targets.upright
    local = kinematics.targets.local(boxes)
    enclosed = enclose(kinematics, local, kinematics.angles(local))
    expansion = expand(kinematics, enclosed)
    sizes = kinematics.joint_slopes(enclosed.slopes).size
    largest = np.einsum("iKNm,NK->iNm", sizes, local.half[:, :dims])
    world = expansion if upright else expansion.in_world(kinematics.targets.mount)
    change = np.abs(enclosed.values.centre - enclosed.exact) + enclosed.values.radius
    joints = np.ascontiguousarray(np.moveaxis(enclosed.exact, 0, -1))
    count, m = joints.shape[:2]
    bases = arm.base_in_world(boxes.centre, 0.0)
    frames = bases[:, None, None] @ link_frames(arm.robot, joints.reshape(-1, 6)).reshape(count, m, 7, 4, 4)
    rotations = frames[:, :, 1:, :3, :3]
    return Motion(
        boxes=boxes,
        joints=joints,
        first=enclosed.values[0],
        frames=frames,
        axes=(rotations @ arm.robot.joint_axes[..., None])[..., 0],
        origins=frames[:, :, 1:, :3, 3],
        error=_off_target(arm, frames[:, :, 6], targets),
        change=np.moveaxis(change, 0, -1),
        slopes=np.moveaxis(world.slopes, (0, 1), (-2, -1)),
        largest=np.moveaxis(largest, 0, -1),
        rest=np.moveaxis(expansion.rest, 0, -1),
        regular=np.all(enclosed.regular & (largest < MOST), axis=0),
        half=boxes.half[:, :dims] if upright else boxes.half,
        unit=np.eye(3)[:, :dims] if upright else np.eye(3),
        shift=np.linalg.norm(boxes.half, axis=1),
    )


def _off_target(arm: Arm, last: Floats, targets: Floats) -> Floats:
    """(N, m) m, how far any point within the robot's reach of the flange is from where the task wants it."""
    flange = last @ arm.robot.flange_placement
    aside = np.linalg.norm(flange[..., :3, 3] - targets[:, :3, 3], axis=-1)
    turned = np.linalg.norm(flange[..., :3, :3] - targets[:, :3, :3], axis=(-1, -2))
    off: Floats = aside + reach(arm.robot) * turned
    return off
