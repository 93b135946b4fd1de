"""Where bases may stand on the floor: an allowed polygon, forbidden ones, a margin, and the footprint of a base.

Everything is seen from above, in the world's x and y [m]. The region is kept as convex pieces that a footprint must not
touch: the half-planes around the allowed polygon's hull, the dents of that hull, and the forbidden polygons. Distances
from convex pieces are exact, and each comes with the line that separates it from the footprint.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Floats, frozen, set_frozen
from duocell.models.base.errors import InvalidInput
from duocell.models.base.ranges import check_between
from duocell.models.geometry.convex_polygons import (
    convex_parts,
    cross,
    hull_and_dents,
    opened,
    polygon_gaps,
    simple_polygon,
)
from duocell.models.geometry.shapes import LARGEST, SMALLEST


@dataclass(frozen=True, eq=False)
class Footprint:
    """The ground a base covers: a convex polygon in the base frame, swollen by a radius.

    Attributes:
        corners: (c, 2) m, counter-clockwise, about the base origin; a single one for a disc.
        radius: m.
    """

    corners: Floats
    radius: float = 0.0

    def __post_init__(self) -> None:
        set_frozen(self, "corners", self.corners, (None, 2))

    @staticmethod
    def disc(radius: float) -> Footprint:
        """A round plate.

        Raises:
            InvalidInput: a radius that is negative, absurd or not finite.
        """
        check_between("the radius of a footprint", radius, (0.0, LARGEST), "/radius")
        return Footprint(np.zeros((1, 2)), radius)

    @staticmethod
    def rectangle(x: float, y: float) -> Footprint:
        """A plate of full lengths ``x`` and ``y`` [m] centred on the base origin."""
        for side in (x, y):
            check_between("a side of a footprint", side, (SMALLEST, LARGEST), "/size")
        return Footprint(0.5 * np.array([[-x, -y], [x, -y], [x, y], [-x, y]]))

    @staticmethod
    def polygon(corners: ArrayLike) -> Footprint:
        """A convex polygon of at least three corners.

        Raises:
            InvalidInput: no polygon, or one that is not convex.
        """
        points = simple_polygon(corners, "/corners")
        if len(convex_parts(points)) > 1:
            raise InvalidInput("a footprint must be convex; send its hull.", "/corners")
        return Footprint(points)


POINT = Footprint(np.zeros((1, 2)))
"""The base origin alone."""


@dataclass(frozen=True, eq=False)
class HalfPlane:
    """A line that keeps a footprint off the nearest forbidden piece: clear where ``normal · point >= offset``.

    Attributes:
        normal: (2,) unit, away from the piece. offset: m, footprint and margin included.
        distance: m, ``normal · point - offset`` at the point asked for: the signed distance there.
        yaw_slope: m/rad, derivative of the distance by the yaw of the footprint.
        piece: what is beyond, for people ("outside of the allowed floor", "forbidden 2").
    """

    normal: Floats
    offset: float
    distance: float
    yaw_slope: float
    piece: str

    def __post_init__(self) -> None:
        set_frozen(self, "normal", self.normal, (2,))


@dataclass(frozen=True, eq=False)
class Floor:
    """Free and forbidden floor for base origins.

    Attributes:
        allowed: (k, 2) corners of the polygon a footprint must lie in, or None for everywhere.
        forbidden: polygons (k, 2) that it must not touch.
        margin: m, to be kept to all of these.
    """

    allowed: Floats | None = None
    forbidden: tuple[Floats, ...] = ()
    margin: float = 0.0
    _walls: tuple[tuple[Floats, float], ...] = field(init=False, repr=False)
    _pieces: tuple[tuple[str, Floats], ...] = field(init=False, repr=False)

    def __post_init__(self) -> None:
        check_between("the margin", self.margin, (0.0, LARGEST), "/margin")
        walls: list[tuple[Floats, float]] = []
        pieces: list[tuple[str, Floats]] = []
        if self.allowed is not None:
            polygon = simple_polygon(self.allowed, "/allowed")
            object.__setattr__(self, "allowed", frozen(polygon))
            hull, dents = hull_and_dents(polygon)
            for start, end in zip(hull, np.roll(hull, -1, axis=0), strict=True):
                inward = cross(end - start) / np.linalg.norm(end - start)
                walls.append((inward, float(inward @ start)))
            pieces += [(OUTSIDE, opened(part, hull)) for dent in dents for part in convex_parts(dent)]
        polygons = tuple(simple_polygon(p, f"/forbidden/{i}") for i, p in enumerate(self.forbidden))
        pieces += [(f"forbidden {i}", part) for i, p in enumerate(polygons) for part in convex_parts(p)]
        object.__setattr__(self, "forbidden", tuple(frozen(p) for p in polygons))
        object.__setattr__(self, "_walls", tuple(walls))
        object.__setattr__(self, "_pieces", tuple(pieces))

    def signed_distance(self, points: ArrayLike, footprint: Footprint = POINT, yaw: ArrayLike = 0.0) -> Floats:
        """How far footprints are from what they must not touch, beyond the margin.

        Args:
            points: (k, 2) m, base origins.
            footprint: of the base.
            yaw: (k,) or one number, rad.

        Returns:
            (k,) m; exact where positive. Negative: the margin is not kept, or the shallowest way out of the convex
            piece that is penetrated deepest. Infinite where nothing is forbidden. At most 1 m/m steep.
        """
        origins = np.atleast_2d(np.asarray(points, dtype=np.float64))
        corners = _placed(origins, footprint, yaw)
        nearest = np.full(len(origins), np.inf)
        for inward, offset in self._walls:
            nearest = np.minimum(nearest, np.min(corners @ inward, axis=1) - offset)
        for _, piece in self._pieces:
            nearest = np.minimum(nearest, polygon_gaps(piece, corners)[0])
        return nearest - footprint.radius - self.margin

    def half_plane(self, point: ArrayLike, footprint: Footprint = POINT, yaw: float = 0.0) -> HalfPlane | None:
        """The nearest (or deepest violated) piece's half-plane at a point; None where nothing is forbidden.

        Args:
            point: (2,) m, base origin. footprint: of the base. yaw: rad.
        """
        origin = np.asarray(point, dtype=np.float64)
        corners = _placed(origin[None], footprint, yaw)
        found: list[tuple[float, Floats, Floats | None, str]] = [
            (float(np.min(corners @ inward) - offset), inward, None, OUTSIDE) for inward, offset in self._walls
        ]
        for name, piece in self._pieces:
            gap, normal = polygon_gaps(piece, corners)
            found.append((float(gap[0]), normal[0], piece, name))
        if not found:
            return None
        core, away, nearest, name = min(found, key=lambda f: f[0])
        distance = core - footprint.radius - self.margin
        touching = _touching(corners[0], away, nearest)
        slope = float(away @ cross(touching - origin))
        return HalfPlane(away, float(away @ origin) - distance, distance, slope, name)


OUTSIDE = "outside of the allowed floor"


def _touching(corners: Floats, away: Floats, piece: Floats | None) -> Floats:
    """The point of a polygon that is nearest to a piece, ``away`` being the direction from the piece to it."""
    heights = corners @ away
    low = corners[heights <= np.min(heights) + 1e-9]
    if piece is None or len(low) == 1:
        return np.asarray(low[0])
    # A side of the polygon faces the piece: the piece's corner touches it.
    corner = piece[np.argmax(piece @ away)]
    side = low[-1] - low[0]
    share = np.clip((corner - low[0]) @ side / (side @ side), 0.0, 1.0)
    return np.asarray(low[0] + share * side)


def _placed(origins: Floats, footprint: Footprint, yaw: ArrayLike) -> Floats:
    """(k, c, 2) corners of footprints at origins (k, 2)."""
    angles = np.broadcast_to(np.asarray(yaw, dtype=np.float64), (len(origins),))[:, None]
    cos, sin = np.cos(angles), np.sin(angles)
    x, y = footprint.corners[:, 0], footprint.corners[:, 1]
    placed: Floats = origins[:, None, :] + np.stack([cos * x - sin * y, sin * x + cos * y], axis=-1)
    return placed
