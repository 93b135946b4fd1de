"""Is there a layout at all? Pairs of stands on a lattice, best first, until one is clean or none is left.

Every lattice point of both arms, all eight postures, the yaw in closed form (turned where a mirror asks for it). Balls
inside of the bodies throw out what surely collides; what is left goes through Coal at coarse steps of the path, and at
last through `bench.judges.dense_check`: a layout that is found is one. It is what a claim of infeasibility is held
against.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from math import ceil, floor
from time import perf_counter

import numpy as np

from bench.draws.cell_draw import REACH, Known, base_frames, coarse, keeps_clear
from bench.judges.dense_bodies import DenseBodies
from bench.judges.dense_check import dense_check
from bench.judges.dense_path import ObjectSteps, follow
from bench.judges.dense_rules import floor_gap
from bench.judges.grid_stands import lattice_of, stands_of, turned
from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Direction, Distance, Mirror, Rail, SameHeight
from duocell.models.robot.arm import TURN

BLOCK = 48
"""Candidates of each arm per block of pairs."""
OBEYED = 1e-9
"""m; couplings on the lattice."""


@dataclass(frozen=True, eq=False)
class Exhausted:
    """What the search found.

    Attributes:
        layout: clean under the dense check, or None. complete: True if every pair of the lattice was looked at.
        tried, working, free: per arm lattice points, stands that do the task alone, those that do not surely collide.
        pairs: looked at. checked: by Coal. seconds: spent.
    """

    layout: Known | None
    complete: bool
    tried: tuple[int, ...]
    working: tuple[int, ...]
    free: tuple[int, ...]
    pairs: int
    checked: int
    seconds: float


def exhaustive(cell: Cell, time_limit: float = 60.0, step: float | None = None) -> Exhausted:
    """Search a cell of two arms.

    Args:
        cell: both arms with closed forms.
        time_limit: s.
        step: m, of the lattice; by default 60 mm, 100 mm for large arms.
    """
    search = _Search(cell, time_limit, step)
    layout = None if search.part_blocked() else next(search.layouts(), None)
    found = [search.stands[a] for a in range(2)]
    return Exhausted(
        layout=layout,
        complete=not search.late,
        tried=tuple(s.tried for s in found),
        working=tuple(s.working for s in found),
        free=tuple(len(s) for s in found),
        pairs=search.pairs,
        checked=search.checked,
        seconds=perf_counter() - search.began,
    )


class _Search:
    def __init__(self, cell: Cell, time_limit: float, step: float | None) -> None:
        self.began = perf_counter()
        self.deadline = self.began + time_limit
        self.cell = cell
        self.scale = min(REACH.get(arm.robot.name, 1.0) for arm in cell.arms)
        lattice = lattice_of(cell, step or (0.06 if self.scale < 1.5 else 0.1))
        self.stands = [stands_of(cell, a, lattice) for a in range(2)]
        self.steps: ObjectSteps = coarse(cell.task, self.scale)
        self.alone: list[dict[tuple[int, float], Floats | None]] = [{}, {}]
        self.pairs = self.checked = 0
        self.late = False

    def part_blocked(self) -> bool:
        """True if the part hits something wherever the arms stand."""
        if self.cell.surroundings.clearances.part_obstacle is None:
            return False
        cell, required = self.cell, self.cell.surroundings.clearances.part_obstacle
        bodies = DenseBodies(cell, base_frames(cell, np.zeros((2, 4))))
        bodies.pairs = [pair for pair in bodies.pairs if pair[0] == "part_obstacle"]
        still = [np.zeros(arm.dof) for arm in cell.arms]
        return any(bodies.nearest(bodies.place(still, p), {"part_obstacle": required}) for p in self.steps.poses)

    def layouts(self) -> Iterator[Known]:
        """Clean layouts, best first; ``late`` tells if time ran out."""
        main, follower = self.stands
        starts = [range(0, len(stands), BLOCK) for stands in self.stands]
        blocks = [(main.objective[i] + follower.objective[j], i, j) for i in starts[0] for j in starts[1]]
        for _, i, j in sorted(blocks):
            left, right = np.arange(i, min(i + BLOCK, len(main))), np.arange(j, min(j + BLOCK, len(follower)))
            pairs = np.argwhere(self._obeying(main.stands[left], follower.stands[right])) + np.array([i, j])
            self.pairs += len(left) * len(right)
            for a, b in pairs[self._apart(pairs)]:
                layout = self._clean((int(a), int(b)))
                if layout is not None:
                    yield layout
                if perf_counter() > self.deadline:
                    self.late = True
                    return
            if perf_counter() > self.deadline:
                self.late = True
                return

    def _obeying(self, first: Floats, second: Floats) -> Bools:
        """(k, l) pairs that obey the couplings, yaws aside."""
        shape = len(first), len(second)
        apart = second[None, :, :3] - first[:, None, :3]
        far, good = np.hypot(apart[..., 0], apart[..., 1]), np.ones(shape, dtype=np.bool_)
        for tie in self.cell.couplings:
            if isinstance(tie, SameHeight | Rail | Mirror):
                good &= np.abs(apart[..., 2]) <= OBEYED
            if isinstance(tie, Distance):
                good &= (far >= tie.minimum) & (far <= tie.maximum)
            if isinstance(tie, Direction | Rail | Mirror):
                along = np.array([np.cos(tie.angle), np.sin(tie.angle)])
                aside = np.array([-along[1], along[0]])
                if isinstance(tie, Mirror):
                    middle = 0.5 * (first[:, None, :2] + second[None, :, :2]) - tie.point
                    good &= (np.abs(apart[..., :2] @ along) <= OBEYED) & (np.abs(middle @ aside) <= OBEYED)
                else:
                    good &= np.abs(apart[..., :2] @ aside) <= OBEYED
                if isinstance(tie, Direction):
                    good &= apart[..., :2] @ along >= 0.0
                if isinstance(tie, Rail) and tie.point is not None:
                    good &= np.abs((first[:, None, :2] - tie.point) @ aside) <= OBEYED
        return good

    def _apart(self, pairs: Ints) -> Bools:
        """(k,) False where balls of both arms are surely too near at one of the poses; pairs (k, 2) of candidates."""
        required = self.cell.surroundings.clearances.arm_arm
        good: Bools = np.ones(len(pairs), dtype=np.bool_)
        if required is None:
            return good
        main, follower = self.stands
        reach = (main.radii[:, None] + follower.radii[None, :] + required).astype(np.float32)
        for first, second in zip(main.balls, follower.balls, strict=True):
            left = np.flatnonzero(good)
            a, b = first[pairs[left, 0]], second[pairs[left, 1]]
            square = (
                np.sum(a * a, axis=2)[:, :, None] + np.sum(b * b, axis=2)[:, None, :] - 2.0 * (a @ b.swapaxes(1, 2))
            )
            good[left] = np.min(np.sqrt(np.maximum(square, 0.0)) - reach, axis=(1, 2)) >= -1e-3  # single precision
        return good

    def _clean(self, pair: tuple[int, int]) -> Known | None:
        """The pair as a layout if it is clean."""
        self.checked += 1
        yaws = self._yaws(pair)
        if yaws is None:
            return None
        stands, joints, paths = [], [], []
        for a, (k, yaw) in enumerate(zip(pair, yaws, strict=True)):
            stand, q = turned(self.cell.arms[a], self.stands[a].stands[k], self.stands[a].joints[k], yaw)
            path = self._alone(a, k, stand, q) if floor_gap(self.cell, a, stand) >= 0.0 else None
            if path is None:
                return None
            stands.append(stand)
            joints.append(q)
            paths.append(path)
        together = np.array(stands)
        if not keeps_clear(self.cell, together, (paths[0], paths[1]), self.steps, 0.0):
            return None
        return Known(together, tuple(joints)) if dense_check(self.cell, together, joints).clean else None

    def _alone(self, index: int, k: int, stand: Floats, joints: Floats) -> Floats | None:
        """The path of one arm at the coarse steps if it keeps clear by itself; remembered."""
        known, key = self.alone[index], (k, float(stand[3]))
        if key not in known:
            arm = self.cell.arms[index]
            path, lost = follow(arm, arm.base_in_world(stand[:3], stand[3]), self.steps, joints)
            alone = replace(self.cell, arms=(arm,))
            good = lost is None and keeps_clear(alone, stand[None], (path,), self.steps, 0.0)
            known[key] = path if good else None
        return known[key]

    def _yaws(self, pair: tuple[int, int]) -> tuple[float, float] | None:
        """Yaws of both: the best ones, or those nearest to them that a mirror allows."""
        best = [float(self.stands[a].stands[k, 3]) for a, k in enumerate(pair)]
        mirror = next((tie for tie in self.cell.couplings if isinstance(tie, Mirror)), None)
        if mirror is None:
            return best[0], best[1]
        spans = [self.stands[a].yaws[k] for a, k in enumerate(pair)]
        low, high = spans[0][0] + spans[1][0], spans[0][1] + spans[1][1]
        first, last = ceil((low - 2.0 * mirror.angle) / TURN), floor((high - 2.0 * mirror.angle) / TURN)
        if first > last:
            return None
        turns = min(range(first, last + 1), key=lambda n: abs(2.0 * mirror.angle + TURN * n - sum(best)))
        excess = 2.0 * mirror.angle + TURN * turns - sum(best)
        one = float(np.clip(best[0] + 0.5 * excess, *spans[0]))
        other = float(np.clip(sum(best) + excess - one, *spans[1]))
        return sum(best) + excess - other, other
