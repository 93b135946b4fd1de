"""Layouts of some arms and placements of one more: those that go together, cheapest first, of many regions."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.coupled.candidates.candidates import ArmCandidates
from duocell.optimizer.coupled.candidates.contacts import SomePairs
from duocell.optimizer.coupled.candidates.loose import LooseTies
from duocell.optimizer.coupled.candidates.placement_filter import FORGIVEN, arm_frames, telling_order
from duocell.optimizer.coupled.candidates.placements import Placements
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.parameters.coupled import Pairing
from duocell.optimizer.verification.scene import LIMITS, Scene

MOST = 200_000
"""Pairs that are looked at at most."""
REGION, OF_REGION = 0.12, 2
"""m; layouts in the same postures whose bases are in the same cubes of this side are alike: so many are kept."""
ALONE = 400
"""Usable placements of an arm that is alone in its cell."""


@dataclass(frozen=True, eq=False, slots=True)
class Layouts:
    """Layouts of the first arms.

    Attributes:
        placements: per arm, one for each layout. violations: (K,) m, what is missing, 0 if nothing.
    """

    placements: tuple[Placements, ...]
    violations: Floats

    def __len__(self) -> int:
        return len(self.violations)

    @property
    def objective(self) -> Floats:
        """(K,) E."""
        total: Floats = np.sum([own.objective for own in self.placements], axis=0)
        return total

    def take(self, rows: Ints | Bools) -> Layouts:
        """Some of them."""
        return Layouts(tuple(own.take(rows) for own in self.placements), self.violations[rows])

    @staticmethod
    def joined(parts: Sequence[Layouts]) -> Layouts:
        """All in one."""
        arms = range(len(parts[0].placements))
        return Layouts(
            tuple(Placements.joined([part.placements[a] for part in parts]) for a in arms),
            np.concatenate([part.violations for part in parts]),
        )


class Extender:
    """Adds one more arm to layouts."""

    def __init__(self, scene: Scene, arms: Sequence[ArmCandidates], ties: LooseTies, pairing: Pairing) -> None:
        """Get ready.

        Args:
            scene: of the cell. arms: candidates of the arms so far and of the one to be added.
            ties: what samples do not keep by themselves, as far as it concerns these arms. pairing: where to end.
        """
        self._scene, self._arms, self._ties, self._pairing = scene, arms, ties, pairing
        self._pairs: list[SomePairs | None] = [_between(scene, other, len(arms) - 1) for other in range(len(arms) - 1)]

    def extended(self, layouts: Layouts) -> Layouts:
        """The cheapest layouts with one more arm that do not surely collide, those that violate nothing first.

        Args:
            layouts: of the arms before it, cheapest first; of a single one all its placements, tested or not.
        """
        added = self._arms[-1]
        kept: list[Layouts] = []
        counts: dict[tuple[int, ...], int] = {}
        clean, best, looked = 0, np.inf, 0
        for k, j, cost in self._pairs_by_cost(layouts, added):
            check_stop()
            least = float(cost[0]) if len(cost) else np.inf
            if looked >= MOST or least > self._pairing.worth * best:
                break
            if clean >= self._pairing.wanted and least >= best:  # what turning costs may have been underrated
                break
            looked += len(k)
            found = self._looked_at(layouts, added, k, j, counts)
            if len(found):
                kept.append(found)
                good = found.violations <= LIMITS
                clean += int(np.sum(good))
                best = min(best, float(np.min(found.objective[good], initial=np.inf)))
        if not kept:
            none = np.zeros(0, dtype=np.int64)
            return Layouts((*layouts.take(none).placements, added.placements.take(none)), np.zeros(0))
        every = Layouts.joined(kept)
        return every.take(np.lexsort((every.objective, every.violations > LIMITS)))

    def _pairs_by_cost(self, layouts: Layouts, added: ArmCandidates) -> Iterator[tuple[Ints, Ints, Floats]]:
        """Blocks of pairs of a layout and a placement that may keep their couplings, with lower bounds of the cost."""
        other, own = layouts.placements[0].groups, added.placements.groups
        if np.any(other != other[:1]) or np.any(own != own[:1]):
            k, j = _same_group(other, own)
            yield from self._sorted(layouts, added, k, j)
            return
        done = 0
        for window in self._pairing.windows:
            ahead = self._ahead(layouts, window)
            rows = np.arange(min(window, len(added))) if self._stay_untested else added.usable(window)
            k, j = np.meshgrid(np.arange(len(ahead)), np.arange(len(rows)), indexing="ij")
            new = (k >= done) | (j >= done)
            yield from self._sorted(layouts, added, ahead[k[new]], rows[j[new]])
            if len(rows) < window and len(ahead) < window:
                return
            done = window

    @property
    def _stay_untested(self) -> bool:
        """True where placements are looked at only once they are moved or turned."""
        return self._ties.moves or self._ties.turns

    def _ahead(self, layouts: Layouts, count: int) -> Ints:
        """Numbers of the first ``count`` layouts that violate nothing or little by themselves."""
        if self._stay_untested or len(self._arms) > 2:
            return np.arange(min(count, len(layouts)))
        return self._arms[0].usable(count)

    def _violations_before(self, layouts: Layouts, k: Ints) -> Floats:
        """(n,) m, violations of layouts (n,) without the arm that is added."""
        found: Floats = self._arms[0].tested(k) if len(self._arms) == 2 else layouts.violations[k]
        return found

    def _sorted(self, layouts: Layouts, added: ArmCandidates, k: Ints, j: Ints) -> Iterator[tuple[Ints, Ints, Floats]]:
        """Pairs that may keep their couplings, in blocks by cost."""
        check_stop()
        cost = layouts.objective[k] + added.placements.objective[j]
        bases = [own.bases[:, k] for own in layouts.placements] + [added.placements.bases[:, j]]
        check_stop()
        near, more = self._ties.near(bases)
        check_stop()
        k, j, cost = k[near], j[near], cost[near] + more[near]
        order = np.argsort(cost, kind="stable")[:MOST]
        for at in range(0, len(order), self._pairing.block):
            some = order[at : at + self._pairing.block]
            yield k[some], j[some], cost[some]

    def _looked_at(
        self, layouts: Layouts, added: ArmCandidates, k: Ints, j: Ints, counts: dict[tuple[int, ...], int]
    ) -> Layouts:
        """Those of some pairs, cheapest first, that go together in regions where more are wanted."""
        if not self._stay_untested:
            first = self._arms[0].violations[k] if len(self._arms) == 2 else layouts.violations[k]
            hopeful = ~((first > FORGIVEN) | (added.violations[j] > FORGIVEN))  # not known is hopeful
            k, j = k[hopeful], j[hopeful]
        room = np.flatnonzero(_room(_keys(layouts, added, k, j), counts, 6 * OF_REGION))
        k, j = k[room], j[room]
        together = Layouts((*layouts.take(k).placements, added.placements.take(j)), np.zeros(len(k)))
        if self._stay_untested:
            placements, _ = self._ties.kept(together.placements)
            violations = [arm.tests.violations(own) for arm, own in zip(self._arms, placements, strict=True)]
            together = Layouts(placements, np.max(violations, axis=0))
        else:
            together = Layouts(together.placements, np.maximum(self._violations_before(layouts, k), added.tested(j)))
        together = together.take(together.violations <= FORGIVEN)
        together = Layouts(together.placements, np.maximum(together.violations, self._arm_violations(together)))
        together = together.take(together.violations <= FORGIVEN)
        keys = _region_keys(together)
        taken = np.zeros(len(together), dtype=np.bool_)
        for row in np.lexsort((together.objective, together.violations > LIMITS)).tolist():
            key = (*keys[row], int(together.violations[row] > LIMITS))
            if counts.get(key, 0) < OF_REGION:
                taken[row] = True
                counts[key] = counts.get(key, 0) + 1
        return together.take(taken)

    def _arm_violations(self, layouts: Layouts) -> Floats:
        """(K,) m, by how much the last arm violates its distances from the others."""
        worst: Floats = np.zeros(len(layouts))
        for other, pairs in enumerate(self._pairs):
            if pairs is not None:
                worst = np.maximum(worst, self._violations_between(layouts, other, pairs, worst))
        return worst

    def _violations_between(self, layouts: Layouts, other: int, pairs: SomePairs, worst: Floats) -> Floats:
        """(K,) m, violations of two arms' distances; poses are looked at in turn until too much is missing."""
        task, cell = self._scene.cell.task, self._scene.cell
        last = len(self._arms) - 1
        both = [layouts.placements[a] for a in (other, last)]
        bases = np.stack(
            [cell.arms[a].base_in_world(own.positions, own.yaws) for a, own in zip((other, last), both, strict=True)],
            axis=1,
        )
        order, done, worst = telling_order(len(task)), 0, worst.copy()
        while done < len(order):
            left = np.flatnonzero(worst <= FORGIVEN)
            if not len(left):
                break
            poses = order[done : done + (1 if done < 3 else max(2, 2000 // len(left)))]
            done += len(poses)
            joints = [own.joints[left][:, poses] for own in both]
            frames = arm_frames(self._scene, [other, last], pairs, bases[left], joints, task.poses[poses])
            violations = pairs.violations(
                frames.reshape(len(left) * len(poses), -1, 4, 4), np.tile(task.segment_of[poses], len(left))
            )
            worst[left] = np.maximum(worst[left], violations.reshape(len(left), -1).max(axis=1, initial=0.0))
        return worst


def _between(scene: Scene, first: int, second: int) -> SomePairs | None:
    """The pairs of two arms; None where nothing is asked of them."""
    if scene.model is None:
        return None
    b = scene.model.bodies
    owners = np.array([-1 if owner.arm is None else owner.arm for owner in b.owners])
    arm_arm = np.array([kind is PairClass.ARM_ARM for kind in b.kinds], dtype=np.bool_)
    wanted = arm_arm & (
        ((owners[b.first] == first) & (owners[b.second] == second))
        | ((owners[b.first] == second) & (owners[b.second] == first))
    )
    return SomePairs.of(scene.model, scene.required, wanted) if np.any(wanted) else None


def _same_group(first: Ints, second: Ints) -> tuple[Ints, Ints]:
    """All pairs of rows with the same group."""
    order = np.argsort(second, kind="stable")
    low = np.searchsorted(second[order], first, side="left")
    count = np.searchsorted(second[order], first, side="right") - low
    k = np.repeat(np.arange(len(first)), count)
    within = np.arange(len(k)) - np.repeat(np.cumsum(count) - count, count)
    return k, order[low[k] + within]


def _keys(layouts: Layouts, added: ArmCandidates, k: Ints, j: Ints) -> list[tuple[int, ...]]:
    """Regions of pairs."""
    return _region_keys(Layouts((*layouts.take(k).placements, added.placements.take(j)), np.zeros(len(k))))


def _region_keys(layouts: Layouts) -> list[tuple[int, ...]]:
    """Regions of layouts: postures, and cubes of the bases in axes that turn with the task."""
    parts = [np.hstack([np.floor(own.cells / REGION).astype(np.int64), own.signs]) for own in layouts.placements]
    return [tuple(row) for row in np.hstack(parts).tolist()]


def _room(keys: Sequence[tuple[int, ...]], counts: dict[tuple[int, ...], int], most: int) -> Bools:
    """(n,) True for the first ``most`` pairs of every region that is not full yet."""
    here: dict[tuple[int, ...], int] = {}
    room = np.zeros(len(keys), dtype=np.bool_)
    for row, key in enumerate(keys):
        if counts.get((*key, 0), 0) < OF_REGION and here.get(key, 0) < most:
            here[key] = here.get(key, 0) + 1
            room[row] = True
    return room


def first_layouts(arm: ArmCandidates, ties: LooseTies, alone: bool) -> Layouts:
    """Layouts of the first arm: all its placements; where it stays alone, the cheapest usable ones of every region."""
    if not alone:
        return Layouts((arm.placements,), np.zeros(len(arm)))
    counts: dict[tuple[int, ...], int] = {}
    rows = arm.usable(ALONE)
    layouts = Layouts((arm.placements.take(rows),), arm.violations[rows])
    layouts = layouts.take(np.lexsort((layouts.objective, layouts.violations > LIMITS)))
    taken = _room(_region_keys(layouts), counts, OF_REGION)
    return layouts.take(taken)
