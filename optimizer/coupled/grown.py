"""Layouts of some arms and stands of one more: those that go together, the best of as many regions as there are."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from models.arrays import Bools, Floats, Ints
from optimizer.coupled.inner_balls import pair_lacks, reach_of
from optimizer.coupled.place_tied import moved_onto, tie_lacks
from optimizer.coupled.scene import LIMITS, Scene
from optimizer.coupled.stands import FORGIVEN, Sieve, Stands
from optimizer.coupled.turn_tied import turned_onto
from optimizer.reduced import evaluate_signed
from optimizer.watch import check_stop

BLOCK, TIED_BLOCK = 64, 256
"""Candidates on each side of a block of pairs; the second where couplings leave few of them."""
MOST_PAIRS, MOST_TESTED = 30_000_000, 400_000
"""Pairs looked at, and those of them whose distances are."""
OBEYED = 1e-9
"""m; couplings that leave room are kept by the stands that are taken, the others by moving one of them."""
REGION, OF_REGION = 0.12, 2
"""m; layouts in the same postures whose bases are in the same cubes of this side are alike: so many are wanted."""
TRIED, MOVED = 12, 4
"""Pairs of such a region, for every one that is wanted, that are looked at before and after what surely collides is
thrown out, in each block where stands have to be moved."""


@dataclass(frozen=True, eq=False, slots=True)
class Partial:
    """Layouts of the first arms.

    Attributes:
        stands: per arm, one for each layout.
    """

    stands: tuple[Stands, ...]

    def __len__(self) -> int:
        return len(self.stands[0])

    @property
    def objective(self) -> Floats:
        """(K,) E."""
        total: Floats = np.sum([s.objective for s in self.stands], axis=0)
        return total

    def take(self, rows: Ints | Bools) -> Partial:
        """Some of them."""
        return Partial(tuple(s.take(rows) for s in self.stands))


class Grower:
    """Adds one more arm to layouts."""

    def __init__(self, scene: Scene, sieves: Sequence[Sieve], spacing: float, wanted: int, deadline: float) -> None:
        """Get ready.

        Args:
            scene: the cell. sieves: of the arms so far and of the one to be added.
            spacing: m between neighbouring stands of that one.
            wanted: layouts that are enough. deadline: `time.perf_counter` value, soft.
        """
        self._sieves, self._spacing, self._wanted, self._deadline = tuple(sieves), spacing, wanted, deadline
        index = len(sieves) - 1
        self._ties = [c for c in scene.cell.couplings if index in c.arms and all(arm <= index for arm in c.arms)]
        self._reaches = []
        if scene.model is not None:
            balls = [sieve.balls for sieve in sieves if sieve.balls is not None]
            self._reaches = [reach_of(scene.model, other, balls[-1], scene.required) for other in balls[:-1]]

    def grown(self, partial: Partial, stands: Stands) -> Partial:
        """The best layouts with one more arm that do not surely collide; none or about as many as wanted."""
        nothing = np.zeros(0, dtype=np.int64)
        kept = [Partial((*partial.take(nothing).stands, stands.take(nothing)))]
        spare = [*kept]  # arms that collide by themselves, perhaps repairable
        if not len(stands):
            return kept[0]
        crowd = _Crowd(partial, stands)
        sound = np.ones(len(partial), dtype=np.bool_), np.ones(len(stands), dtype=np.bool_)
        looked = tested = 0
        slack = self._slack(partial, stands)
        narrow = bool(np.any((slack > OBEYED) & (slack < np.inf)))
        for rows, columns in _blocks(partial.objective, stands.objective, TIED_BLOCK if narrow else BLOCK):
            check_stop()
            late = looked > MOST_PAIRS or tested > MOST_TESTED or time.perf_counter() > self._deadline
            if late or sum(map(len, kept)) >= self._wanted:
                break
            looked += len(rows) * len(columns)
            k, j = self._near_ties(partial, stands, rows, columns, slack)
            room = crowd.room(crowd.keys(k, j)) & sound[0][k] & sound[1][j]
            k, j = k[room], j[room]
            if narrow:
                k, j = crowd.foremost(k, j, OF_REGION * TRIED)
            tested += len(k)
            apart = self._clear(Partial((*partial.take(k).stands, stands.take(j))), FORGIVEN + narrow * self._spacing)
            k, j = k[apart], j[apart]
            if narrow:
                k, j = crowd.foremost(k, j, OF_REGION * MOVED)
            layouts, chosen = self._together(partial.take(k), stands.take(j), narrow)
            clear = np.flatnonzero(self._clear(layouts, FORGIVEN))
            clear = clear[np.argsort(layouts.objective[clear], kind="stable")]
            keys = crowd.keys(k[chosen[clear]], j[chosen[clear]])
            some = _first(keys, 2 * OF_REGION)
            clear, keys = clear[some], keys[some]
            lacks = self._own_lacks(layouts.take(clear))
            clean = np.max(lacks, axis=0) <= LIMITS
            if not narrow:  # else each stand is another one in every layout
                sound[0][k[chosen[clear[np.max(lacks[:-1], axis=0) > LIMITS]]]] = False
                sound[1][j[chosen[clear[lacks[-1] > LIMITS]]]] = False
            kept.append(layouts.take(clear[clean][crowd.taken(keys[clean])]))
            if sum(map(len, spare)) < self._wanted:
                spare.append(layouts.take(clear[~clean]))
        return _joined(kept if sum(map(len, kept)) else spare)

    def _near_ties(
        self, partial: Partial, stands: Stands, rows: Ints, columns: Ints, slack: Floats
    ) -> tuple[Ints, Ints]:
        """Pairs (q,), (q,) of a block whose positions nearly keep their couplings; yaws can be turned."""
        if not self._ties:
            return np.repeat(rows, len(columns)), np.tile(columns, len(rows))
        bases = [s.bases[:, rows, None] for s in partial.stands]
        lacks = tie_lacks(self._ties, [*bases, stands.bases[:, None, columns]])
        k, j = np.nonzero(np.all(np.abs(lacks) <= slack, axis=-1))
        return rows[k], columns[j]

    def _slack(self, partial: Partial, stands: Stands) -> Floats:
        """(R,) m, what a pair may lack of each row of the couplings, because it can be moved or turned onto it."""
        if not self._ties:
            return np.zeros(0)
        one = [np.array([*s.bases[:, 0]]) for s in (*partial.stands, stands)]
        turned = [np.append(base[:3], base[3] + 1.0 + a) for a, base in enumerate(one)]
        slack = []
        for tie in self._ties:
            here, there = tie.rows(one), tie.rows(turned)
            for value, other, low, high in zip(here.values, there.values, here.lower, here.upper, strict=True):
                narrow = self._spacing if high - low < 2.0 * self._spacing else OBEYED
                slack.append(np.inf if value != other else narrow)
        return np.array(slack)

    def _together(self, partial: Partial, stands: Stands, narrow: bool) -> tuple[Partial, Ints]:
        """Layouts and stands (K each) side by side, on their couplings; and which of the K these are."""
        if not len(stands):
            return Partial((*partial.stands, stands)), np.arange(0)
        if not narrow:
            return Partial(turned_onto(self._ties, self._sieves, (*partial.stands, stands))), np.arange(len(stands))
        sieve = self._sieves[-1]
        region = sieve.problem.arm.base.bounds[:3]
        positions = moved_onto(self._ties, [s.bases for s in partial.stands], stands.positions, stands.yaws, region)
        paths = evaluate_signed(sieve.problem, positions, stands.signs)
        good = np.flatnonzero(paths.violation[0] == 0.0)
        joints = paths.joints[:, 0, good].transpose(1, 2, 0)
        moved, passed = sieve.sifted(
            positions[good], paths.yaw[0, good], joints, stands.signs[good], paths.objective[0, good]
        )
        chosen = good[passed]
        layouts = turned_onto(self._ties, self._sieves, (*partial.take(chosen).stands, moved))
        return Partial(layouts), chosen

    def _clear(self, layouts: Partial, forgiven: float) -> Bools:
        """(K,) False where the last arm surely lacks more than ``forgiven`` [m] of its distances from the others."""
        *others, last = layouts.stands
        clear: Bools = np.ones(len(last), dtype=np.bool_)
        for other, reach in zip(others, self._reaches, strict=False):  # no reaches without clearances
            for first, second in zip(other.balls, last.balls, strict=True):
                left = np.flatnonzero(clear)
                clear[left] = pair_lacks(first[left], second[left], reach) <= forgiven
        return clear

    def _own_lacks(self, layouts: Partial) -> Floats:
        """(A, K) m, largest shortfall of what each arm keeps by itself."""
        return np.stack([sieve.own_lacks(some) for sieve, some in zip(self._sieves, layouts.stands, strict=True)])


class _Crowd:
    """How many layouts there are of every region."""

    def __init__(self, partial: Partial, stands: Stands) -> None:
        self._left, self._right = _regions(partial.stands), _regions((stands,))
        self._many = int(self._right.max(initial=0)) + 1
        self._first, self._second = partial.objective, stands.objective
        self._counts: dict[int, int] = {}
        self._full: list[int] = []

    def keys(self, k: Ints, j: Ints) -> Ints:
        """(q,) numbers of the regions of pairs of a layout and a stand."""
        keys: Ints = self._left[k] * self._many + self._right[j]
        return keys

    def foremost(self, k: Ints, j: Ints, count: int) -> tuple[Ints, Ints]:
        """The best ``count`` pairs of every region, best first."""
        order = np.argsort(self._first[k] + self._second[j], kind="stable")
        k, j = k[order], j[order]
        some = _first(self.keys(k, j), count)
        return k[some], j[some]

    def room(self, keys: Ints) -> Bools:
        """(q,) False for regions that have enough."""
        return ~np.isin(keys, self._full)

    def taken(self, keys: Ints) -> Bools:
        """(q,) True for those that are taken in, in this order."""
        taken: Bools = np.zeros(len(keys), dtype=np.bool_)
        for number, key in enumerate(keys.tolist()):
            count = self._counts.get(key, 0)
            if count < OF_REGION:
                taken[number], self._counts[key] = True, count + 1
                if count + 1 == OF_REGION:
                    self._full.append(key)
        return taken


def _first(keys: Ints, count: int) -> Ints:
    """Numbers of the first ``count`` of every key, in order."""
    order = np.argsort(keys, kind="stable")
    ordered = keys[order]
    rank = np.arange(len(keys)) - np.searchsorted(ordered, ordered)
    return np.sort(order[rank < count])


def _regions(stands: Sequence[Stands]) -> Ints:
    """(K,) numbers of regions: postures and cubes of the bases."""
    keys = np.hstack([np.hstack([np.round(s.positions / REGION).astype(np.int64), s.signs]) for s in stands])
    return np.unique(keys, axis=0, return_inverse=True)[1].reshape(-1).astype(np.int64)


def _blocks(first: Floats, second: Floats, size: int) -> Iterator[tuple[Ints, Ints]]:
    """Blocks of pairs, those with the best sums first; both (K,) and (N,) are sorted here."""
    orders = [np.argsort(values, kind="stable") for values in (first, second)]
    starts = [np.arange(0, len(order), size) for order in orders]
    lowest = first[orders[0][starts[0]]][:, None] + second[orders[1][starts[1]]]
    for index in np.argsort(lowest, axis=None, kind="stable"):
        i, j = divmod(int(index), len(starts[1]))
        yield orders[0][starts[0][i] : starts[0][i] + size], orders[1][starts[1][j] : starts[1][j] + size]


def _joined(parts: Sequence[Partial]) -> Partial:
    """All layouts in one."""
    return Partial(tuple(Stands.joined([part.stands[a] for part in parts]) for a in range(len(parts[0].stands))))
