"""Balls inside of bodies: what surely collides is seen for thousands of stands at once.

A ball lies inside of its body, so two bodies are no farther apart than their balls: what balls reject cannot be clean,
what they accept may still be anything.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from models.arrays import Bools, Floats, Ints, Singles
from models.collision import CollisionModel
from models.collision_bodies import EVERY
from models.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from models.surroundings import PairClass

SPACING = 1.3
"""Distance of neighbouring balls over their radius."""
FEW = 12
"""Balls along one side of a body at most."""


@dataclass(frozen=True, eq=False, slots=True)
class ArmBalls:
    """The balls of one arm and what they must keep away from.

    Attributes:
        centres: (n, 3) m, in the frames of the links. radii: (n,) m. links: (n,) numbers of the links.
        bodies: (n,) numbers of the bodies in the model.
        others: what is not of any arm, as (body, its number in the model, required distance m, True if it moves with
            the part, number of its job, the balls it is to be kept from, those of them that it may carry).
    """

    centres: Floats
    radii: Floats
    links: Ints
    bodies: Ints
    others: tuple[tuple[Body, int, float, bool, int, Ints, Ints], ...]

    @staticmethod
    def of(model: CollisionModel, arm: int, required: Floats) -> ArmBalls:
        """Fill the bodies of an arm.

        Args:
            model: of the cell. arm: index. required: (P,) m, of its pairs.
        """
        b = model.bodies
        own = [i for i, owner in enumerate(b.owners) if owner.arm == arm]
        rows = [(body_ball, i) for i in own for body_ball in balls_in(b.bodies[i])]
        bodies = np.array([i for _, i in rows], dtype=np.int64)
        others = []
        for j in np.unique(b.second):
            if b.owners[j].arm is not None:
                continue
            pairs = np.flatnonzero((b.second == j) & np.isin(b.first, own))
            if len(pairs):
                kept = np.flatnonzero(np.isin(bodies, b.first[pairs]))
                standing = np.flatnonzero(np.isin(bodies, b.first[pairs[b.mounts[pairs]]]))
                most = float(np.max(required[pairs]))
                others.append((b.bodies[j], int(j), most, b.owners[j].part, int(b.jobs[pairs[0]]), kept, standing))
        return ArmBalls(
            np.array([ball[0] for ball, _ in rows]).reshape(-1, 3),
            np.array([ball[1] for ball, _ in rows], dtype=np.float64),
            b.frames[bodies] - model.offsets[arm],
            bodies,
            tuple(others),
        )

    def placed(self, links: Floats) -> Floats:
        """(..., n, 3) m, centres for link frames (..., L, 4, 4) in the world."""
        own = links[..., self.links, :, :]
        places: Floats = (own[..., :3, :3] @ self.centres[..., None])[..., 0] + own[..., :3, 3]
        return places

    def lacks(self, centres: Floats, carriers: Bools, held: Floats, job: int) -> Floats:
        """(N,) m, what an arm surely lacks of the distances from obstacles and part; negative if nothing is near.

        Args:
            centres: (N, n, 3) m in the world, at one pose.
            carriers: (N, B) bodies that the bases are mounted on (`CollisionModel.carriers`).
            held: (4, 4) the object's frame. job: number of the job of the pose.
        """
        worst: Floats = np.full(len(centres), -np.inf)
        for body, number, required, part, own_job, kept, standing in self.others:
            if own_job not in (EVERY, job):
                continue
            frame = held @ body.pose if part else body.pose
            gaps = np.full(centres.shape[:2], np.inf)
            gaps[:, kept] = _apart(body.shape, frame, centres[:, kept]) - self.radii[kept]
            gaps[np.ix_(carriers[:, number], standing)] = np.inf
            worst = np.maximum(worst, required - np.min(gaps, axis=1, initial=np.inf))
        return worst


def pair_lacks(first: Singles, second: Singles, reach: Singles) -> Floats:
    """(K,) m, what pairs of arms surely lack of their distance at one pose.

    Args:
        first: (K, n, 3) m, centres of one arm. second: (K, l, 3) m, of the other.
        reach: (n, l) m, radii and required distance together; -inf where nothing is required.
    """
    square = (first * first).sum(axis=2)[:, :, None] + (second * second).sum(axis=2)[:, None, :]
    square -= 2.0 * (first @ second.swapaxes(1, 2))
    lacks: Floats = np.max(reach - np.sqrt(np.maximum(square, 0.0)), axis=(1, 2), initial=-np.inf)
    return lacks


def reach_of(model: CollisionModel, first: ArmBalls, second: ArmBalls, required: Floats) -> Singles:
    """(n, l) m: radii and required distance of the balls of two arms, -inf where no pair of the model asks for one."""
    b = model.bodies
    asked = np.full((len(b.bodies), len(b.bodies)), -np.inf)
    for pair in np.flatnonzero([kind is PairClass.ARM_ARM for kind in b.kinds]):
        asked[b.first[pair], b.second[pair]] = asked[b.second[pair], b.first[pair]] = required[pair]
    wanted = asked[first.bodies[:, None], second.bodies[None, :]]
    reach: Singles = (first.radii[:, None] + second.radii[None, :] + wanted).astype(np.float32)
    return reach


def balls_in(body: Body) -> list[tuple[Floats, float]]:
    """Centres [m], in the frame that the body moves with, and radii [m] of balls inside of a body."""
    return [(body.pose[:3, :3] @ centre + body.pose[:3, 3], radius) for centre, radius in _filled(body.shape)]


def _filled(shape: Shape) -> list[tuple[Floats, float]]:
    match shape:
        case Sphere(radius=radius):
            return [(np.zeros(3), radius)]
        case Capsule(radius=radius, length=length):
            return _grid(np.array([0.0, 0.0, 0.5 * length]), radius)
        case Cylinder(radius=radius, length=length):
            inner = min(radius, 0.5 * length)
            return _grid(np.array([0.0, 0.0, 0.5 * length - inner]), inner)
        case Box(size=size):
            inner = 0.5 * float(np.min(size))
            return _grid(0.5 * size - inner, inner)
        case ConvexHull(points=points, planes=planes):
            middle = points.mean(axis=0)
            return [(middle, float(np.min(-(planes[:, :3] @ middle + planes[:, 3]))))]
        case HalfSpace():
            return []


def _grid(half: Floats, radius: float) -> list[tuple[Floats, float]]:
    """Balls with centres all over a box of half sizes (3,)."""
    counts = [1 + min(FEW, ceil(2.0 * side / (SPACING * radius))) if side > 0.0 else 1 for side in half]
    sides = [
        np.linspace(-side, side, count) if count > 1 else np.zeros(1) for side, count in zip(half, counts, strict=True)
    ]
    centres = np.stack(np.meshgrid(*sides, indexing="ij"), axis=-1).reshape(-1, 3)
    return [(centre, radius) for centre in centres]


def _apart(shape: Shape, frame: Floats, points: Floats) -> Floats:
    """(...) m, signed distances of points (..., 3) from a shape; outside of a hull infinite: it is not known."""
    local = (points - frame[:3, 3]) @ frame[:3, :3]
    match shape:
        case Sphere(radius=radius):
            return np.asarray(np.linalg.norm(local, axis=-1) - radius)
        case Capsule(radius=radius, length=length):
            local[..., 2] -= np.clip(local[..., 2], -0.5 * length, 0.5 * length)
            return np.asarray(np.linalg.norm(local, axis=-1) - radius)
        case Cylinder(radius=radius, length=length):
            aside = np.hypot(local[..., 0], local[..., 1]) - radius
            return _cornered(np.stack([aside, np.abs(local[..., 2]) - 0.5 * length], axis=-1))
        case Box(size=size):
            return _cornered(np.abs(local) - 0.5 * size)
        case HalfSpace():
            return np.asarray(local[..., 2])
        case ConvexHull(planes=planes):
            height = np.max(local @ planes[:, :3].T + planes[:, 3], axis=-1)
            return np.where(height > 0.0, np.inf, height)


def _cornered(beyond: Floats) -> Floats:
    """(...) m, signed distance from a product of intervals, by how far a point is beyond each of them (..., k)."""
    outside = np.maximum(beyond, 0.0)
    gap: Floats = np.sqrt(np.einsum("...k,...k->...", outside, outside)) + np.minimum(np.max(beyond, axis=-1), 0.0)
    return gap
