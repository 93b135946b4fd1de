"""A task: the poses the part goes through, and the paths that make them.

Pointers of the errors are relative to the object that holds the parameters (``/count``, ``/center``, ...).
"""

from __future__ import annotations

from dataclasses import dataclass, field
from math import asin, atan2, isfinite, pi, sin

import numpy as np
from numpy.typing import ArrayLike

from duocell.models.base.arrays import Bools, Floats, Ints, set_frozen
from duocell.models.base.errors import InvalidRotation, InvalidTask
from duocell.models.base.pose import HALF_TURN_TOLERANCE, interpolate_rotations, rotation_about, transform
from duocell.models.base.weights import check_weights
from duocell.models.cell.segments import joined, slices

LENGTH_TOLERANCE = 1e-6
"""m; how far arc data may contradict themselves (radii of both ends, chord against normal)."""

FARTHEST = 1e6
"""m; coordinates beyond are mistakes, and would overflow sooner or later."""


@dataclass(frozen=True, eq=False)
class Task:
    """Poses of the object frame C in the world, in the order in which they are passed.

    A task may be a sequence of segments that one layout has to serve. Between the last pose of a segment and the first
    of the next nothing is continuous: there is no way of the object, no limit on joint steps, and joints may take other
        turns.

    Attributes:
        poses: (m, 4, 4) T_W^C, segment after segment.
        starts: index of the first pose of each segment, the first one 0.
        names: of the segments; () for segments without names.
        weights: (m,) >= 0, what each pose counts for in the objective; where it is 0 the pose only has to be possible.
            Empty for 1 everywhere.
    """

    poses: Floats
    starts: tuple[int, ...] = (0,)
    names: tuple[str, ...] = ()
    weights: Floats = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        set_frozen(self, "poses", self.poses, (None, 4, 4))
        m = len(self.poses)
        set_frozen(self, "weights", self.weights if len(self.weights) else np.ones(m), (m,))
        check_weights(self.weights, "/weights")
        object.__setattr__(self, "names", self.names or ("",) * len(self.starts))
        if self.starts[:1] != (0,) or any(a >= b for a, b in zip(self.starts, (*self.starts[1:], m), strict=True)):
            raise ValueError(f"jobs of {m} poses cannot start at {self.starts}")
        if len(self.names) != len(self.starts):
            raise ValueError(f"{len(self.starts)} jobs, {len(self.names)} names")

    def __len__(self) -> int:
        return len(self.poses)

    @property
    def segments(self) -> tuple[slice, ...]:
        """The poses of each segment."""
        return slices(self.starts, len(self.poses))

    @property
    def segment_of(self) -> Ints:
        """(m,) number of the segment that each pose belongs to."""
        numbers: Ints = np.searchsorted(self.starts, np.arange(len(self.poses)), side="right") - 1
        return numbers

    @property
    def joined(self) -> Bools:
        """(m - 1,) True where the next pose is one of the same segment."""
        return joined(self.starts, len(self.poses))

    @property
    def total_weight(self) -> float:
        """What all poses count for together; their number if that is 0."""
        return float(np.sum(self.weights)) or len(self.poses)

    @property
    def weight_scale(self) -> float:
        """Mean of the weights that are not zero (1 without any): what a cost is to be measured against."""
        positive = self.weights[self.weights > 0.0]
        return float(np.mean(positive)) if len(positive) else 1.0

    def alone(self, segment: int) -> Task:
        """One segment as a task of its own."""
        some = self.segments[segment]
        return Task(self.poses[some], names=(self.names[segment],), weights=self.weights[some])

    def part(self, first: int, last: int) -> Task:
        """The poses from ``first`` to ``last``, both included; a single one is held for two."""
        rows = np.arange(first, last + 1) if first < last else np.array([first, first])
        segments = self.segment_of[rows]
        starts = (0,) if first == last else tuple(int(k) for k in np.flatnonzero(np.diff(segments, prepend=-1)))
        names = tuple(self.names[segments[k]] for k in starts)
        return Task(self.poses[rows], starts, names, self.weights[rows])


def task_from_poses(poses: ArrayLike) -> Task:
    """A task from poses sent one by one.

    Args:
        poses: (m, 4, 4) with m >= 2, finite.

    Raises:
        InvalidTask: fewer than two poses, or one that is no rigid transform (pointer ``/poses/j``).
    """
    stack = np.asarray(poses, dtype=np.float64)
    if len(stack) < 2:
        raise InvalidTask(
            f"a task has at least 2 poses, this one has {len(stack)}; for a part at rest send its pose twice.",
            "/poses",
        )
    if stack.ndim != 3 or stack.shape[1:] != (4, 4):
        raise InvalidTask(f"poses are 4x4 transforms; got an array of shape {stack.shape}.", "/poses")
    gram = np.swapaxes(stack[:, :3, :3], 1, 2) @ stack[:, :3, :3]
    rigid = np.isfinite(stack).all(axis=(1, 2)) & (np.abs(gram - np.eye(3)) < 1e-9).all(axis=(1, 2))
    rigid &= (np.linalg.det(np.where(np.isfinite(stack), stack, 0.0)) > 0.0) & (stack[:, 3] == (0, 0, 0, 1)).all(axis=1)
    if not rigid.all():
        j = int(np.argmin(rigid))
        raise InvalidTask(f"pose {j} is no rigid transform of finite numbers.", f"/poses/{j}")
    far = np.abs(stack[:, :3, 3]).max(axis=1) > FARTHEST
    if far.any():
        raise _too_far(f"/poses/{int(np.argmax(far))}/position")
    return Task(stack)


def line(start: Floats, end: Floats, count: int) -> Task:
    """A straight path with evenly spaced positions; the orientation turns evenly along the shortest rotation.

    Args:
        start: (4, 4) first pose.
        end: (4, 4) last pose.
        count: number of poses, both ends included, at least 2.

    Raises:
        InvalidTask: fewer than two poses, numbers that are not finite, or orientations 180° apart.
    """
    fractions = _fractions(count)
    _check_ends(start, end)
    positions = (1.0 - fractions)[:, None] * start[:3, 3] + fractions[:, None] * end[:3, 3]
    return Task(transform(_orientations(start, end, fractions), positions))


def arc_through_center(start: Floats, end: Floats, center: ArrayLike, count: int) -> Task:
    """The minor arc of a circle about ``center`` from ``start`` to ``end``, evenly spaced.

    Args:
        start: (4, 4) first pose.
        end: (4, 4) last pose.
        center: (3,) m, equally far from both positions to 1e-6 m.
        count: number of poses, both ends included, at least 2.

    Raises:
        InvalidTask: centre not equidistant, ends in the same place or half a circle apart (no plane is defined), or
            what `line` refuses.
    """
    fractions = _fractions(count)
    middle = _vector(center, "center")
    _check_ends(start, end)
    u, v = start[:3, 3] - middle, end[:3, 3] - middle
    first, last = float(np.linalg.norm(u)), float(np.linalg.norm(v))
    if abs(first - last) > LENGTH_TOLERANCE:
        raise InvalidTask(
            f"the centre is {first:.7g} m from the start and {last:.7g} m from the end; these must agree to "
            f"{LENGTH_TOLERANCE:g} m. Correct the centre, or give radius and normal instead.",
            "/center",
        )
    _check_chord(start, end)
    normal = np.cross(u, v)
    angle = atan2(float(np.linalg.norm(normal)), float(u @ v))
    if angle > pi - HALF_TURN_TOLERANCE:
        raise InvalidTask(
            "start and end lie on opposite sides of the centre, so the plane of the arc is undefined; "
            "an arc with a centre spans less than 180°. Give radius and normal for a half circle.",
            "/center",
        )
    return Task(transform(_orientations(start, end, fractions), _arc(start, end, normal, angle, fractions)))


def arc_about_normal(start: Floats, end: Floats, radius: float, normal: ArrayLike, count: int) -> Task:
    """An arc of given radius from ``start`` to ``end``, counter-clockwise about ``normal``, at most 180°.

    Args:
        start: (4, 4) first pose.
        end: (4, 4) last pose.
        radius: m, at least half the distance of the two positions.
        normal: (3,) of any length, at right angles to the line from start to end (to 1e-6 m over its length).
        count: number of poses, both ends included, at least 2.

    Raises:
        InvalidTask: radius too small, normal zero or not at right angles to the chord, ends in the same place, or what
            `line` refuses.
    """
    fractions = _fractions(count)
    axis = _vector(normal, "normal")
    _check_ends(start, end)
    chord = end[:3, 3] - start[:3, 3]
    distance = _check_chord(start, end)
    size = float(np.linalg.norm(axis))
    if size < 1e-9:
        raise InvalidTask(
            "the normal is zero; give the direction about which the arc turns, e.g. [0, 0, 1].", "/normal"
        )
    slant = abs(float(chord @ axis)) / size
    if slant > LENGTH_TOLERANCE:
        raise InvalidTask(
            f"the end lies {slant:.3g} m out of the plane through the start at right angles to the normal; "
            f"at most {LENGTH_TOLERANCE:g} m is accepted. Correct the normal or the positions.",
            "/normal",
        )
    if not isfinite(radius) or radius < 0.5 * distance - LENGTH_TOLERANCE:
        raise InvalidTask(
            f"radius {radius:g} m is too small: start and end are {distance:.7g} m apart, "
            f"so at least {0.5 * distance:.7g} m is needed (a half circle).",
            "/radius",
        )
    angle = 2.0 * asin(min(1.0, 0.5 * distance / radius))
    return Task(transform(_orientations(start, end, fractions), _arc(start, end, axis, angle, fractions)))


def _arc(start: Floats, end: Floats, normal: Floats, angle: float, fractions: Floats) -> Floats:
    """(m, 3) positions on an arc, written as chords from its start: exact at both ends and for any radius.

    The chord to the fraction t of the arc is ``sin(t φ/2) / sin(φ/2)`` times as long as the whole one and turned back
    from it by ``(1 - t) φ/2``.
    """
    chord = end[:3, 3] - start[:3, 3]
    shares = np.sin(0.5 * angle * fractions) / sin(0.5 * angle)
    turns = rotation_about(normal, -0.5 * angle * (1.0 - fractions))
    positions: Floats = start[:3, 3] + shares[:, None] * (turns @ chord)
    return positions


def _orientations(start: Floats, end: Floats, fractions: Floats) -> Floats:
    """(m, 3, 3) along the shortest rotation."""
    try:
        return interpolate_rotations(start[:3, :3], end[:3, :3], fractions)
    except InvalidRotation as error:
        raise InvalidTask(error.detail, "/end/orientation") from error


def _fractions(count: int) -> Floats:
    """(count,) from 0 to 1."""
    if count < 2:
        raise InvalidTask(f"count is {count}; a path has at least 2 poses, its two ends.", "/count")
    return np.linspace(0.0, 1.0, count)


def _vector(values: ArrayLike, name: str) -> Floats:
    """Three finite numbers of sensible size."""
    vector = np.asarray(values, dtype=np.float64)
    if vector.shape != (3,) or not np.all(np.isfinite(vector)):
        raise InvalidTask(f"{name} must be three finite numbers.", f"/{name}")
    if np.abs(vector).max() > FARTHEST:
        raise _too_far(f"/{name}")
    return vector


def _check_ends(start: Floats, end: Floats) -> None:
    """Refuse poses with infinities, NaN or absurd positions."""
    for name, pose in (("start", start), ("end", end)):
        if not np.all(np.isfinite(pose)):
            raise InvalidTask(f"{name} holds a number that is not finite.", f"/{name}")
        if np.abs(pose[:3, 3]).max() > FARTHEST:
            raise _too_far(f"/{name}/position")


def _too_far(pointer: str) -> InvalidTask:
    """The error for coordinates beyond `FARTHEST`."""
    return InvalidTask(f"a coordinate is beyond {FARTHEST:g} m, far outside any cell. Lengths are metres.", pointer)


def _check_chord(start: Floats, end: Floats) -> float:
    """Distance of both ends [m]; an arc needs one."""
    distance = float(np.linalg.norm(end[:3, 3] - start[:3, 3]))
    if distance <= LENGTH_TOLERANCE:
        raise InvalidTask(
            f"start and end of the arc are {distance:.3g} m apart; they must be different places. "
            "Use a line to turn a part on the spot, two arcs for a full circle.",
            "/end/position",
        )
    return distance
