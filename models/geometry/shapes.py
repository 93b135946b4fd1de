"""Solid shapes and bodies: what can stand in a cell, hang on an arm or be carried.

Every shape is convex; a mesh that is not becomes several hulls. A shape lives in its own frame, a `Body` puts it
somewhere. Pointers of the errors are relative to the shape or body (``/size``, ``/pose``, ...).
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import ArrayLike
from scipy.spatial import ConvexHull as _Hull
from scipy.spatial import QhullError

from duocell.models.base.arrays import Floats, frozen
from duocell.models.base.errors import InvalidInput

LARGEST = 1e3
"""m; a longer side is taken for a length sent in millimetres."""

SMALLEST = 1e-6
"""m; thinner than this is no solid."""


@dataclass(frozen=True, eq=False)
class Box:
    """A cuboid centred on its frame.

    Attributes:
        size: (3,) m, full lengths along x, y, z.
    """

    size: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", _lengths(self.size, "size", 3))


@dataclass(frozen=True, slots=True)
class Sphere:
    """A ball centred on its frame; ``radius`` m."""

    radius: float

    def __post_init__(self) -> None:
        _length(self.radius, "radius")


@dataclass(frozen=True, slots=True)
class Cylinder:
    """A round cylinder about z, centred on its frame; ``radius`` m, ``length`` m along z."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _length(self.radius, "radius")
        _length(self.length, "length")


@dataclass(frozen=True, slots=True)
class Capsule:
    """All points within ``radius`` m of a segment of ``length`` m along z, centred on its frame; the caps are extra."""

    radius: float
    length: float

    def __post_init__(self) -> None:
        _length(self.radius, "radius")
        _length(self.length, "length")


@dataclass(frozen=True, slots=True)
class HalfSpace:
    """Everything with z <= 0 in its frame: a floor, or a wall when turned."""


@dataclass(frozen=True, eq=False)
class ConvexHull:
    """The convex hull of points.

    Attributes:
        points: (k, 3) m, at least four that are not in one plane; only the corners of the hull are kept.
        planes: (f, 4) outer unit normals n and offsets d of its faces: inside is ``n·x + d <= 0``.
    """

    points: Floats
    planes: Floats = field(init=False, repr=False)

    def __post_init__(self) -> None:
        points = _points(self.points)
        try:
            hull = _Hull(points)
        except QhullError as error:
            raise InvalidInput(
                "these points enclose no volume: a solid needs at least four that are not in one plane.", "/points"
            ) from error
        corners = points[hull.vertices]
        if _thickness(corners, hull.equations) < SMALLEST:
            raise InvalidInput(f"these points enclose a sheet thinner than {SMALLEST:g} m; give it a depth.", "/points")
        object.__setattr__(self, "points", frozen(corners))
        object.__setattr__(self, "planes", frozen(np.unique(hull.equations.round(12), axis=0)))


Shape = Box | Sphere | Cylinder | Capsule | HalfSpace | ConvexHull


@dataclass(frozen=True, eq=False)
class Body:
    """A named shape somewhere.

    Attributes:
        name: for people: it appears in reports.
        pose: (4, 4) the shape's frame in the frame the body belongs to (world, object, link or flange).
        shape: the solid.
    """

    name: str
    pose: Floats
    shape: Shape

    def __post_init__(self) -> None:
        pose = np.asarray(self.pose, dtype=np.float64)
        if pose.shape != (4, 4) or not np.all(np.isfinite(pose)):
            raise InvalidInput(f"the pose of {self.name!r} must be a 4x4 transform of finite numbers.", "/pose")
        if (
            np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max() > 1e-9
            or np.linalg.det(pose[:3, :3]) < 0.0
            or not np.array_equal(pose[3], (0.0, 0.0, 0.0, 1.0))
        ):
            raise InvalidInput(f"the pose of {self.name!r} is no rigid transform.", "/pose")
        if np.abs(pose[:3, 3]).max() > LARGEST:
            raise InvalidInput(
                f"{self.name!r} is farther than {LARGEST:g} m away; lengths are metres.", "/pose/position"
            )
        object.__setattr__(self, "pose", frozen(pose))


def _length(value: float, name: str) -> None:
    """Refuse lengths that are not finite, not positive or absurd."""
    if not np.isfinite(value) or not SMALLEST <= value <= LARGEST:
        raise InvalidInput(
            f"{name} is {value:g} m; allowed is {SMALLEST:g} to {LARGEST:g} m. Lengths are metres.", f"/{name}"
        )


def _lengths(values: ArrayLike, name: str, count: int) -> Floats:
    """``count`` lengths as a read-only array."""
    array = np.asarray(values, dtype=np.float64)
    if array.shape != (count,):
        raise InvalidInput(f"{name} must be {count} lengths [m].", f"/{name}")
    for index, value in enumerate(array):
        _length(float(value), f"{name}/{index}")
    return frozen(array)


def _points(values: ArrayLike) -> Floats:
    """Points of a hull: finite, not absurdly far."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 2 or array.shape[1] != 3 or len(array) < 4:
        raise InvalidInput(f"a hull needs at least 4 points of 3 coordinates; got shape {array.shape}.", "/points")
    if not np.all(np.isfinite(array)) or np.abs(array).max() > LARGEST:
        raise InvalidInput(f"points must be finite and within {LARGEST:g} m; lengths are metres.", "/points")
    return array


def _thickness(corners: Floats, planes: Floats) -> float:
    """Smallest extent [m] of the hull at right angles to one of its faces."""
    return float(np.min(np.max(-(corners @ planes[:, :3].T + planes[:, 3]), axis=0)))
