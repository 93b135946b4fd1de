"""Rows of couplings that samples do not keep by themselves: distances, sides, yaws. Layouts are moved onto them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.coupling import Coupling
from duocell.optimizer.coupled.candidates.followed import FollowedProblem
from duocell.optimizer.coupled.candidates.placements import Placements, moved
from duocell.optimizer.coupled.candidates.unknowns import TiedUnknowns
from duocell.optimizer.coupled.combinations.project_positions import tie_violations

STEPS, TURNS = 5, 12
"""Gauss-Newton steps onto the rows of positions, and of yaws; a turn that ends at a limit is made up for by others."""
DIFFERENCE = 1e-6
"""m and rad, of the rows' derivatives."""
KEPT = 1e-9
"""m and rad; what is violated by less is kept."""
REACHED = 1e-7
"""m and rad of violation that a layout that was moved or turned may have."""
SPACINGS = 1.5
"""How many spacings of the samples layouts may be moved."""
TRIED = 64
"""Samples that tell which rows are kept by themselves."""


@dataclass(frozen=True, eq=False, slots=True)
class LooseTies:
    """The couplings among the first arms of a cell.

    Attributes:
        couplings: among them. problems: their reduced problems. boxes: (A, 3, 2) m, where their bases may stand.
        basis: (U, A, 3) m per m, how the positions follow the free unknowns.
        slack: (R,) m, violation of a row below which layouts are not moved yet; infinite for rows of yaws.
        stiffness: (R,) what a rad² of violation of a row of yaws costs at least; 0 for other rows.
        moves: True if layouts have to be moved, turns: or turned, to keep the couplings.
    """

    couplings: tuple[Coupling, ...]
    problems: tuple[FollowedProblem, ...]
    boxes: Floats
    basis: Floats
    slack: Floats
    stiffness: Floats
    moves: bool
    turns: bool

    @staticmethod
    def of(
        couplings: Sequence[Coupling], problems: Sequence[FollowedProblem], unknowns: TiedUnknowns, spacing: float
    ) -> LooseTies:
        """Look at the rows.

        Args:
            couplings: of the cell. problems: of its first arms. unknowns: of the cell. spacing: m between samples.
        """
        count = len(problems)
        own = tuple(c for c in couplings if all(arm < count for arm in c.arms))
        slack, stiffness = [], []
        moves = turns = False
        tied = _tied_rows(own, unknowns, count)
        place = np.random.default_rng(2).normal(size=(count, 4))
        for number, (coupling, k, low, high) in enumerate(_rows(own, place)):
            here = float(coupling.rows([*place]).values[k])
            by_yaw = []
            for arm in range(count):
                turned = place + 0.5 * np.outer(np.eye(count)[arm], np.eye(4)[3])
                if abs(float(coupling.rows([*turned]).values[k]) - here) > KEPT:
                    by_yaw.append(arm)
            softness = sum(1.0 / _stiffness(problems[arm]) for arm in by_yaw)
            narrow = not by_yaw and not tied[number] and high - low < 2.0 * SPACINGS * spacing
            stiffness.append(1.0 / softness if by_yaw else 0.0)
            slack.append(np.inf if by_yaw else SPACINGS * spacing if narrow else KEPT)
            moves, turns = moves or narrow, turns or bool(by_yaw)
        return LooseTies(
            own,
            tuple(problems),
            unknowns.boxes[:count],
            unknowns.moves()[:, :count],
            np.array(slack),
            np.array(stiffness),
            moves,
            turns,
        )

    def near(self, bases: Sequence[Floats]) -> tuple[Bools, Floats]:
        """(q,) True for layouts, per arm (4, q), that can be moved onto their couplings; and what turning costs."""
        count = bases[0].shape[1]
        if not self.couplings:
            return np.ones(count, dtype=np.bool_), np.zeros(count)
        violations = tie_violations(self.couplings, bases)
        near: Bools = np.all(np.abs(violations) <= self.slack, axis=-1)
        return near, (np.where(self.stiffness > 0.0, violations, 0.0) ** 2) @ self.stiffness

    def kept(self, placements: tuple[Placements, ...]) -> tuple[tuple[Placements, ...], Ints]:
        """Layouts that keep their couplings once they are moved and turned as little as possible.

        Returns:
            Per arm, and their numbers among those given.
        """
        rows = np.arange(len(placements[0]))
        if self.moves:
            placements, rows = self._moved(placements)
        if self.turns and len(rows):
            placements = self._turned(placements)
            violations = tie_violations(self.couplings, [own.bases for own in placements])
            good = np.all(np.abs(violations) <= REACHED, axis=-1)
            placements, rows = tuple(own.take(good) for own in placements), rows[good]
        return placements, rows

    def projected(self, positions: Floats) -> tuple[Floats, Bools]:
        """(K, A, 3) m, positions moved onto the couplings, and (K,) False where they do not arrive in their boxes."""
        rows = self.stiffness == 0.0
        for _ in range(STEPS if self.moves else 0):
            violations = self._violations(positions)[:, rows]
            slopes = np.stack(
                [
                    (self._violations(positions + DIFFERENCE * direction)[:, rows] - violations) / DIFFERENCE
                    for direction in self.basis
                ],
                axis=-1,
            )
            step = (np.linalg.pinv(slopes, rcond=1e-6) @ violations[..., None])[..., 0]
            positions = positions - (step @ self.basis.reshape(len(self.basis), -1)).reshape(positions.shape)
        inside = np.all(
            (positions >= self.boxes[..., 0] - KEPT) & (positions <= self.boxes[..., 1] + KEPT), axis=(1, 2)
        )
        positions = np.clip(positions, self.boxes[..., 0], self.boxes[..., 1])
        return positions, inside & np.all(np.abs(self._violations(positions)[:, rows]) <= REACHED, axis=-1)

    def _violations(self, positions: Floats) -> Floats:
        """(K, R) violations of the couplings at positions (K, A, 3), yaws aside."""
        if not self.couplings:
            return np.zeros((len(positions), 0))
        bases = [np.vstack([positions[:, arm].T, np.zeros(len(positions))]) for arm in range(positions.shape[1])]
        return tie_violations(self.couplings, bases)

    def _moved(self, placements: tuple[Placements, ...]) -> tuple[tuple[Placements, ...], Ints]:
        """Those that are usable in the same postures where their couplings hold; and which these are."""
        positions, good = self.projected(np.stack([own.positions for own in placements], axis=1))
        rows = np.flatnonzero(good)
        found = [own.take(rows) for own in placements]
        for arm, problem in enumerate(self.problems):
            cells = found[arm].cells
            found[arm], usable = moved(problem, found[arm], positions[rows, arm], cells)
            rows = rows[usable]
            found = [found[other].take(usable) if other != arm else found[other] for other in range(len(found))]
        return tuple(found), rows

    def _turned(self, placements: tuple[Placements, ...]) -> tuple[Placements, ...]:
        """Layouts whose bases are turned as little as the couplings ask for and as their limits allow."""
        bases = np.stack([own.bases for own in placements])
        limits = np.stack([own.turns(problem.problem) for own, problem in zip(placements, self.problems, strict=True)])
        by = np.zeros(bases[:, 3].shape)
        ease = 1.0 / np.array([_stiffness(problem) for problem in self.problems])
        for _ in range(TURNS):
            violations = tie_violations(self.couplings, _with_yaws(bases, by))
            slopes = np.stack(
                [
                    (tie_violations(self.couplings, _with_yaws(bases, by + DIFFERENCE * unit[:, None])) - violations)
                    / DIFFERENCE
                    for unit in np.eye(len(bases))
                ],
                axis=-1,
            )
            slopes[np.abs(slopes) < DIFFERENCE] = 0.0
            scaled = slopes * np.sqrt(ease)
            step = np.sqrt(ease) * (np.linalg.pinv(scaled, rcond=1e-6) @ violations[..., None])[..., 0]
            by = np.clip(by - step.T, limits[..., 0], limits[..., 1])
        return tuple(own.turned(p.problem, turn) for own, p, turn in zip(placements, self.problems, by, strict=True))


def _rows(couplings: Sequence[Coupling], place: Floats) -> Iterator[tuple[Coupling, int, float, float]]:
    """Every row of the couplings: the coupling, the row's number in it, low and high."""
    for coupling in couplings:
        rows = coupling.rows([*place])
        for k, (low, high) in enumerate(zip(rows.lower, rows.upper, strict=True)):
            yield coupling, k, low, high


def _tied_rows(couplings: Sequence[Coupling], unknowns: TiedUnknowns, count: int) -> Bools:
    """(R,) True for rows that samples of the unknowns keep by themselves."""
    if not couplings:
        return np.zeros(0, dtype=np.bool_)
    samples = unknowns.sampled(TRIED, 0)[:count]
    common = samples[0].groups
    for own in samples[1:]:
        common = np.intersect1d(common, own.groups)
    common = np.unique(common)
    rows = [np.searchsorted(own.groups, common) for own in samples]
    bases = [np.vstack([own.positions[at].T, np.zeros(len(at))]) for own, at in zip(samples, rows, strict=True)]
    violations = tie_violations(couplings, bases)
    kept: Bools = np.all(np.abs(violations) <= KEPT, axis=0)
    return kept


def _stiffness(problem: FollowedProblem) -> float:
    """What turning a base by a rad under its arm costs: the objective rises by this times the square of the turn."""
    arm, objective = problem.problem.arm, problem.problem.objective
    curvature = objective.curvature(arm, arm.reference[None], np.ones(1))[0]
    return max(0.5 * float(curvature[0, 0]) * problem.problem.total_weight, 1e-9)


def _with_yaws(bases: Floats, by: Floats) -> list[Floats]:
    """Per arm (4, K) bases, turned by (A, K) rad."""
    return [np.concatenate([base[:3], base[3:] + turn]) for base, turn in zip(bases, by, strict=True)]
