"""Layouts of a cell in which nothing but couplings ties the arms, brought downhill together along what they leave free.

A pattern search on the free unknowns, all layouts at once: the couplings hold at every step, so what is compared are
layouts, and a batch of trials costs little more than one.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.optimizer.coupled.candidates.extender import Layouts
from duocell.optimizer.coupled.candidates.followed import Followed, FollowedProblem
from duocell.optimizer.coupled.candidates.layouts import boxes_of
from duocell.optimizer.coupled.candidates.loose import LooseTies
from duocell.optimizer.coupled.candidates.placements import Placements
from duocell.optimizer.coupled.candidates.unknowns import TiedUnknowns
from duocell.optimizer.monitoring.watch import check_stop

TAKEN = 64
"""Layouts that are brought downhill."""
STEP, SHORTEST = 0.06, 1e-3
"""m, first and last step along an unknown."""
ROUNDS = 40
"""Steps at most."""
ACROSS = 8
"""Directions across the unknowns."""


def polished(followed: Followed, layouts: Layouts) -> Layouts:
    """Where the cheapest of some layouts lead, cheapest first; those stay where they are that lead to nothing better.

    Args:
        followed: a cell without distances and floor. layouts: cheapest first.
    """
    layouts = layouts.take(np.arange(min(TAKEN, len(layouts))))
    if not len(layouts):
        return layouts
    unknowns = TiedUnknowns.of(followed.scene.cell, boxes_of(followed))
    ties = LooseTies.of(followed.scene.cell.couplings, followed.problems, unknowns, 1.0)
    start = np.stack([own.positions for own in layouts.placements], axis=1)
    positions = _Descent(followed.problems, ties).run(start, layouts)
    arrived, rows = _layouts_at(followed.problems, ties, positions, layouts)
    better = arrived.objective <= layouts.objective[rows]
    lost = np.setdiff1d(np.arange(len(layouts)), rows[better])  # what turning costs was underrated on their way
    found = Layouts.joined([arrived.take(better), layouts.take(lost)])
    return found.take(np.argsort(found.objective, kind="stable"))


class _Descent:
    """Steps along the unknowns, half as long where none of them helps."""

    def __init__(self, problems: Sequence[FollowedProblem], ties: LooseTies) -> None:
        self._problems, self._ties = problems, ties

    def run(self, positions: Floats, layouts: Layouts) -> Floats:
        """(K, A, 3) m, where layouts at positions (K, A, 3) end."""
        signs = [own.signs for own in layouts.placements]
        cost = self._costs(positions, signs)
        length = np.full(len(positions), STEP)
        directions = self._directions()
        for _ in range(ROUNDS):
            check_stop()
            going = np.flatnonzero(length > SHORTEST)
            if not len(going) or not len(directions):
                break
            trials = positions[going, None] + length[going, None, None, None] * directions
            flat, arrived = self._ties.projected(trials.reshape(-1, *positions.shape[1:]))
            repeated = [own[np.repeat(going, len(directions))] for own in signs]
            costs = np.where(arrived, self._costs(flat, repeated), np.inf).reshape(len(going), -1)
            best = np.argmin(costs, axis=1)
            here = costs[np.arange(len(going)), best]
            better = here < cost[going]
            moved = going[better]
            positions[moved] = flat.reshape(len(going), len(directions), *positions.shape[1:])[better, best[better]]
            cost[moved] = here[better]
            length[going[~better]] *= 0.5
        return positions

    def _directions(self) -> Floats:
        """(W, A, 3) m per m, along the unknowns and across them: along a limit no single unknown leads downhill."""
        basis = self._ties.basis
        if not len(basis):
            return basis
        across = np.random.default_rng(0).normal(size=(ACROSS, len(basis)))
        across /= np.linalg.norm(across, axis=1)[:, None]
        return np.concatenate([basis, -basis, np.einsum("wu,uac->wac", across, basis)])

    def _costs(self, positions: Floats, signs: Sequence[Ints]) -> Floats:
        """(K,) E of layouts with what turning onto the couplings costs at least; infinite where they are not usable."""
        total: Floats = np.zeros(len(positions))
        bases = []
        for arm, (problem, own) in enumerate(zip(self._problems, signs, strict=True)):
            paths, violation = problem.at(positions[:, arm], own)
            total += np.where(violation[0] == 0.0, paths.objective[0], np.inf)
            bases.append(np.vstack([positions[:, arm].T, paths.yaw[0]]))
        return total + self._ties.near(bases)[1]


def _layouts_at(
    problems: Sequence[FollowedProblem], ties: LooseTies, positions: Floats, layouts: Layouts
) -> tuple[Layouts, Ints]:
    """Usable layouts at positions (K, A, 3), on their couplings; and their numbers."""
    placed: list[Placements] = []
    good = np.ones(len(positions), dtype=np.bool_)
    for arm, (problem, own) in enumerate(zip(problems, layouts.placements, strict=True)):
        paths, violation = problem.at(positions[:, arm], own.signs)
        good &= violation[0] == 0.0
        placed.append(
            replace(
                own,
                positions=positions[:, arm],
                yaws=paths.yaw[0],
                joints=paths.joints[:, 0].transpose(1, 2, 0),
                objective=paths.objective[0],
            )
        )
    kept, rows = ties.kept(tuple(own.take(good) for own in placed))
    return Layouts(kept, np.zeros(len(rows))), np.flatnonzero(good)[rows]
