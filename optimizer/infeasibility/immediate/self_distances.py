"""Links of one arm, two joints apart, that no joint angles within the limits keep far enough from each other.

The distance of two bodies is bounded over boxes of the joints between them: a point X of the farther body is moved by
joint k by at most ``2 ρ_k sin(min(h_k, π)/2)``, with ρ_k its distance from the axis at the centre of the box and h_k
the box's half width, where the joints are turned one by one starting at the link that is held. Best first, until the
largest distance is known to `PRECISE` or one sample keeps what is asked for.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.bounding import bounding, segment_distances
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, Sphere
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.arm import TURN, Arm
from duocell.optimizer.infeasibility.immediate.cause import Infeasibility, millimetres, rounded_down, surely_short
from duocell.optimizer.monitoring.watch import check_stop

JOINTS = 2
"""Joints between two bodies at most."""
PRECISE = 5e-5
"""m, of the largest distance."""
BATCH, MOST = 256, 6000
"""Boxes cut at once, and samples of one pair at most."""


@dataclass(frozen=True, slots=True)
class LargestDistance:
    """How far two bodies of one arm can be apart [m]: ``found`` at some joint angles, at most ``bound`` at any."""

    found: float
    bound: float


def self_distance_conflicts(cell: Cell, model: CollisionModel, deadline: float = np.inf) -> tuple[Infeasibility, ...]:
    """Pairs of links that come too near to each other in every posture.

    Args:
        cell: the arms and the clearance. model: of the cell.
        deadline: `time.perf_counter` value after which no further pairs are looked at.

    Raises:
        Cancelled: whoever watches (`duocell.optimizer.monitoring.watch`) wants an end.
    """
    required = cell.surroundings.clearances.self_collision
    if required is None:
        return ()
    b, found = model.bodies, []
    for pair in np.flatnonzero([kind is PairClass.SELF for kind in b.kinds]):
        i, j = sorted((int(b.first[pair]), int(b.second[pair])), key=lambda k: b.owners[k].link or 0)
        a, low, high = b.owners[i].arm, b.owners[i].link or 0, b.owners[j].link or 0
        if a is None or not 0 < high - low <= JOINTS:
            continue
        check_stop()
        if time.perf_counter() > deadline:
            break
        largest = largest_distance(cell.arms[a], (low, b.sure[i]), (high, b.sure[j]), required)
        if surely_short(largest.bound, required):
            found.append(_cause(a, (b.names[i], b.names[j]), required, largest))
    return tuple(sorted(found, key=lambda cause: cause.possible if cause.possible is not None else -1.0))


def largest_distance(arm: Arm, held: tuple[int, Body], turned: tuple[int, Body], enough: float) -> LargestDistance:
    """The largest signed distance of two bodies over the joints between them.

    Args:
        arm: limits. held: (link, body in its frame). turned: likewise, of a later link.
        enough: m; the search ends as soon as a sample has it.
    """
    pair = _Pair(arm, held, turned)
    centre, half = pair.whole
    gaps, bounds = pair.look(centre, half)
    best, samples = float(np.max(gaps)), 1
    while best < enough and np.max(bounds) > best + PRECISE and samples < MOST:
        some = np.argsort(-bounds, kind="stable")[:BATCH]
        some = some[bounds[some] > best + PRECISE]
        kept = np.setdiff1d(np.arange(len(bounds)), some)
        widest = pair.widest(centre[some], half[some])
        smaller = half[some].copy()
        smaller[np.arange(len(some)), widest] *= 0.5
        shift = np.zeros_like(smaller)
        shift[np.arange(len(some)), widest] = smaller[np.arange(len(some)), widest]
        halves = np.vstack([centre[some] - shift, centre[some] + shift]), np.vstack([smaller, smaller])
        new_gaps, new_bounds = pair.look(*halves)
        best, samples = max(best, float(np.max(new_gaps))), samples + len(new_gaps)
        new_bounds = np.minimum(new_bounds, np.tile(bounds[some], 2))
        centre, half = np.vstack([centre[kept], halves[0]]), np.vstack([half[kept], halves[1]])
        bounds = np.concatenate([bounds[kept], new_bounds])
    return LargestDistance(best, max(best, float(np.max(bounds))))


class _Pair:
    """Two bodies of an arm with the joints between them."""

    def __init__(self, arm: Arm, held: tuple[int, Body], turned: tuple[int, Body]) -> None:
        self.robot, (self.first, self.held), (self.last, self.turned) = arm.robot, held, turned
        self.joints = np.arange(self.first, self.last)
        low, high = arm.lower[self.joints] - KEPT, arm.upper[self.joints] + KEPT
        self.shifts = arm.robot.prismatic[self.joints]
        endless = (~np.isfinite(high - low) | (high - low > TURN)) & ~self.shifts
        low, high = np.where(endless, -0.5 * TURN, low), np.where(endless, 0.5 * TURN, high)
        self.whole = (0.5 * (low + high))[None], (0.5 * (high - low))[None]
        self.points, self.swollen = _outline(turned[1])
        self.capsules = [bounding(body.shape) for body in (held[1], turned[1])]

    def look(self, centre: Floats, half: Floats) -> tuple[Floats, Floats]:
        """(N,) m, signed distances at the centres of boxes (N, k) rad or m, and bounds of them over the boxes."""
        frames = self._frames(centre)
        gaps = self._gaps(frames)
        chords = np.where(self.shifts, half, 2.0 * np.sin(0.5 * np.minimum(half, 0.5 * TURN)))
        moved = self._levers(frames) * chords
        return gaps, gaps + np.sum(moved, axis=1)

    def widest(self, centre: Floats, half: Floats) -> Ints:
        """(N,) which joint of each box moves the body most."""
        ways = np.where(self.shifts, half, np.minimum(half, 1.5))
        widest: Ints = np.argmax(self._levers(self._frames(centre)) * ways + 1e-9 * half, axis=1)
        return widest

    def _frames(self, centre: Floats) -> Floats:
        q = np.zeros((len(centre), self.robot.dof))
        q[:, self.joints] = centre
        return link_frames(self.robot, q)

    def _gaps(self, frames: Floats) -> Floats:
        poses = frames[:, self.first] @ self.held.pose, frames[:, self.last] @ self.turned.pose
        if all(capsule.exact for capsule in self.capsules):
            ends = [
                c.ends @ pose[:, :3, :3].swapaxes(1, 2) + pose[:, None, :3, 3]
                for c, pose in zip(self.capsules, poses, strict=True)
            ]
            radii = self.capsules[0].radius + self.capsules[1].radius
            gaps: Floats = segment_distances(ends[0], ends[1]) - radii
            return gaps
        shapes = self.held.shape, self.turned.shape
        return np.array([separation(shapes[0], p, shapes[1], q).distance for p, q in zip(*poses, strict=True)])

    def _levers(self, frames: Floats) -> Floats:
        """(N, k) m, largest distance of the turned body's points from each axis; 1 for a joint that shifts."""
        last = frames[:, self.last]
        points = self.points @ last[:, :3, :3].swapaxes(1, 2) + last[:, None, :3, 3]
        levers = np.empty((len(frames), len(self.joints)))
        for column, joint in enumerate(self.joints):
            frame = frames[:, joint + 1]
            axis = frame[:, :3, :3] @ self.robot.joint_axes[joint]
            off = np.cross(axis[:, None], points - frame[:, None, :3, 3])
            levers[:, column] = np.max(np.linalg.norm(off, axis=2), axis=1) + self.swollen
        return np.where(self.shifts, 1.0, levers)


def _outline(body: Body) -> tuple[Floats, float]:
    """Points (k, 3) in the link's frame, and m, such that what moves no point far moves no part of the body farther.

    A body is the hull of the points, swollen by a ball: balls do not count, for they turn in themselves. The rims of a
    cylinder do.
    """
    swollen = 0.0
    match body.shape:
        case Sphere():
            points = np.zeros((1, 3))
        case Capsule(length=length):
            points = np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]])
        case Cylinder(radius=swollen, length=length):
            points = np.array([[0.0, 0.0, -0.5 * length], [0.0, 0.0, 0.5 * length]])
        case Box(size=size):
            points = 0.5 * size * np.stack(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]), axis=-1).reshape(-1, 3)
        case ConvexHull(points=corners):
            points = corners
        case _:
            raise ValueError(f"{body.shape!r} is no part of an arm")
    placed: Floats = points @ body.pose[:3, :3].T + body.pose[:3, 3]
    return placed, swollen


def _cause(arm: int, names: tuple[str, str], required: float, largest: LargestDistance) -> Infeasibility:
    possible = rounded_down(largest.found) if largest.found >= 0.0 else None
    most = "touch in every posture" if possible is None else f"are at most {millimetres(possible)} apart in any posture"
    less = "leave the clearance of arms with themselves out" if possible is None else f"ask for {millimetres(possible)}"
    detail = f"{names[0]} and {names[1]} {most}; {millimetres(required)} are asked for: {less}"
    return Infeasibility(
        kind="collision",
        detail=detail,
        arms=(arm,),
        bodies=names,
        pair_class=PairClass.SELF,
        required=required,
        possible=possible,
        missing=required - largest.bound,
        pointer="/clearance/self",
        unit="m",
    )
