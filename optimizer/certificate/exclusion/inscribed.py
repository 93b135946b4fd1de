"""Capsules, balls and points inside of bodies: what stands for a body where a collision has to be certain.

Whatever is inside of a body is no nearer to anything than the body itself: a distance of inscribed things is an upper
bound of the body's. Points on edges count where flat tops and thin plates have no ball of any size near their rims.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import ceil

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, Shape, Sphere
from duocell.optimizer.certificate.exclusion.gap import inside

SPACING = 0.7
"""Distance of neighbouring balls in a row over their radius."""
FLAT = 0.3
"""A box whose middle side exceeds its thinnest by less than this share of the latter needs one row of balls only."""
ROWS = 8
"""Rows of balls in a box at most, besides the first."""
EDGE, MOST_ON_EDGE = 0.08, 7
"""m between points on an edge of a box; and how many there are at most."""
AROUND = 12
"""Points on the rim of a cylinder."""
SMALLEST = 1e-3
"""m; smaller balls about the yaw axis are not worth a test."""
STEPS = 81
"""Heights on the yaw axis at which balls are looked for."""
THICKNESS = 0.95, 0.5
"""Shares of the largest radius of a ball on the axis that capsules there have at least."""


@dataclass(frozen=True, eq=False, slots=True)
class InnerCapsule:
    """All points within ``radius`` m of a segment with ends (2, 3) m; a ball where the ends agree."""

    ends: Floats
    radius: float

    def placed(self, pose: Floats) -> InnerCapsule:
        """The same in the frame that ``pose`` (4, 4) is given in."""
        return InnerCapsule(self.ends @ pose[:3, :3].T + pose[:3, 3], self.radius)

    def centres(self) -> Floats:
        """(n, 3) m, centres of balls in a row that stand for the capsule."""
        length = float(np.linalg.norm(self.ends[1] - self.ends[0]))
        count = 1 + ceil(length / (SPACING * self.radius)) if length > 1e-9 else 1
        shares = np.linspace(0.0, 1.0, count)[:, None]
        centres: Floats = (1.0 - shares) * self.ends[0] + shares * self.ends[1]
        return centres


def inner_capsules(body: Body) -> list[InnerCapsule]:
    """Capsules inside of a body, in the frame that the body moves with."""
    return [capsule.placed(body.pose) for capsule in _capsules(body.shape)]


def edge_points(body: Body) -> Floats:
    """(n, 3) m, points on the edges and corners of a body, in the frame that the body moves with."""
    return _edges(body.shape) @ body.pose[:3, :3].T + body.pose[:3, 3]


def axis_capsules(body: Body) -> list[InnerCapsule]:
    """Capsules inside of a body on the z axis of the frame it moves with: a yaw leaves them where they are.

    The hull of two balls inside of a convex body is inside too. One capsule is as thick as the body allows, one longer
    and thinner.
    """
    middle, reach = body.pose[2, 3], radius_of(body.shape)
    heights = np.linspace(middle - reach, middle + reach, STEPS)
    radii = -inside(body.shape, body.pose, np.column_stack([np.zeros((STEPS, 2)), heights]))
    found: list[InnerCapsule] = []
    if np.max(radii) <= SMALLEST:  # the body stands beside the axis
        return found
    for share in THICKNESS:
        low, high = np.flatnonzero(radii >= share * np.max(radii))[[0, -1]]
        radius = float(min(radii[low], radii[high]))
        if radius > SMALLEST:
            found.append(InnerCapsule(np.array([[0.0, 0.0, heights[low]], [0.0, 0.0, heights[high]]]), radius))
    return found


def radius_of(shape: Shape) -> float:
    """m; no point of a bounded shape is farther than this from its frame's origin."""
    match shape:
        case Sphere(radius=radius):
            return radius
        case Capsule(radius=radius, length=length):
            return radius + 0.5 * length
        case Cylinder(radius=radius, length=length):
            return float(np.hypot(radius, 0.5 * length))
        case Box(size=size):
            return float(np.linalg.norm(0.5 * size))
        case ConvexHull(points=points):
            return float(np.max(np.linalg.norm(points, axis=1)))
        case _:
            return np.inf


def axis_distance(body: Body) -> float:
    """m; a body is a set within this distance of the z axis of the frame it moves with, perhaps swollen by a ball."""
    beside = float(np.hypot(body.pose[0, 3], body.pose[1, 3]))
    level = body.pose[:2, :3]
    match body.shape:
        case Sphere():
            return beside
        case Capsule(length=length):
            return beside + 0.5 * length * float(np.hypot(*level[:, 2]))
        case Cylinder(radius=radius, length=length):
            return beside + radius + 0.5 * length * float(np.hypot(*level[:, 2]))
        case Box(size=size):
            corners = 0.5 * size * np.array(np.meshgrid([-1, 1], [-1, 1], [-1, 1])).reshape(3, -1).T
        case ConvexHull(points=points):
            corners = points
        case _:
            return np.inf
    return float(np.max(np.linalg.norm(corners @ level.T + body.pose[:2, 3], axis=1)))


def _capsules(shape: Shape) -> list[InnerCapsule]:
    """Capsules in the shape's own frame."""
    match shape:
        case Sphere(radius=radius):
            return [InnerCapsule(np.zeros((2, 3)), radius)]
        case Capsule(radius=radius, length=length):
            return [_upright(0.5 * length, radius)]
        case Cylinder(radius=radius, length=length):
            inner = min(radius, 0.5 * length)
            return [_upright(0.5 * length - inner, inner)]
        case Box(size=size):
            return _in_box(0.5 * size)
        case ConvexHull(points=points, planes=planes):
            middle = points.mean(axis=0)
            return [InnerCapsule(np.tile(middle, (2, 1)), float(np.min(-(planes[:, :3] @ middle + planes[:, 3]))))]
        case _:
            return []


def _upright(half: float, radius: float) -> InnerCapsule:
    return InnerCapsule(np.array([[0.0, 0.0, -half], [0.0, 0.0, half]]), radius)


def _in_box(half: Floats) -> list[InnerCapsule]:
    """Capsules along the longest side of a box, side by side along the middle one."""
    thin, middle, long = np.argsort(half, kind="stable")
    radius = float(half[thin])
    aside, along = float(half[middle]) - radius, float(half[long]) - radius
    count = 1 if aside < FLAT * radius else 1 + min(ROWS, ceil(2.0 * aside / radius))
    offsets = np.linspace(-aside, aside, count) if count > 1 else np.zeros(1)
    across, lengthwise = np.eye(3)[middle], np.eye(3)[long]
    return [
        InnerCapsule(np.stack([o * across - along * lengthwise, o * across + along * lengthwise]), radius)
        for o in offsets
    ]


def _edges(shape: Shape) -> Floats:
    """(n, 3) m in the shape's own frame."""
    match shape:
        case Box(size=size):
            counts = [max(2, min(MOST_ON_EDGE, 1 + ceil(side / EDGE))) for side in size]
            lines = [np.linspace(-1.0, 1.0, count) for count in counts]
            grid = np.stack(np.meshgrid(*lines, indexing="ij"), axis=-1).reshape(-1, 3)
            return np.asarray(grid[np.sum(np.abs(grid) == 1.0, axis=1) >= 2] * (0.5 * size))
        case Cylinder(radius=radius, length=length):
            angles = np.arange(AROUND) * (2.0 * np.pi / AROUND)
            rim = radius * np.stack([np.cos(angles), np.sin(angles)], axis=1)
            heights = np.repeat([-0.5 * length, 0.5 * length], AROUND)
            return np.column_stack([np.tile(rim, (2, 1)), heights])
        case ConvexHull(points=points):
            return points
        case _:
            return np.empty((0, 3))
