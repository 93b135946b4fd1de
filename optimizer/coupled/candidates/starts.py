"""Layouts to refine from: measured by Coal, those that keep everything first, one of every neighbourhood."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import islice

import numpy as np

from duocell.models.base.arrays import Ints
from duocell.optimizer.coupled.candidates.extender import Layouts
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.coupled import COUPLED
from duocell.optimizer.sqp.nearby import nearby
from duocell.optimizer.verification.scene import LIMITS

BATCH = 16
"""Layouts measured together."""


@dataclass(frozen=True, eq=False, slots=True)
class Start:
    """One point per arm.

    Attributes:
        points: one per arm. objective: E. violation: largest shortfall [m], <= 0 if none.
    """

    points: tuple[ArmSolution, ...]
    objective: float
    violation: float

    @property
    def clean(self) -> bool:
        """True if it keeps everything at the poses."""
        return self.violation <= LIMITS

    def score(self, penalty: float) -> float:
        """E with the shortfall made dear."""
        return self.objective + penalty * max(self.violation, 0.0)


def starts_of(
    followed: Followed,
    layouts: Layouts,
    clean: int,
    others: int,
    apart: float = COUPLED.apart,
    measured: int = COUPLED.measured,
) -> list[Start]:
    """Distinct starts: up to ``clean`` that keep everything at the poses, cheapest first, then ``others`` that do not.

    Args:
        followed: the cell. layouts: those first that seem to keep everything. apart: m; layouts of the same
            postures whose bases are all nearer than this count as one start. measured: by Coal, at most.
    """
    seems = layouts.violations <= LIMITS
    kept: list[Start] = []
    spoilt: list[Start] = []
    for start in _measured(followed, layouts, np.flatnonzero(seems)[:measured], kept, apart):
        if not start.clean:
            spoilt.append(start)
        elif _distinct(start.points, kept, apart):
            kept.append(start)
        if len(kept) >= clean:
            break
    rest = [*spoilt[:others], *_measured(followed, layouts, np.flatnonzero(~seems)[: 2 * others])]
    near: list[Start] = []
    for start in sorted(rest, key=lambda one: one.objective):
        if len(near) < others and _distinct(start.points, [*kept, *near], apart):
            near.append(start)
    return [*kept, *near]


def _measured(
    followed: Followed, layouts: Layouts, rows: Ints, kept: Sequence[Start] = (), apart: float = 0.0
) -> Iterator[Start]:
    """Layouts with their violations at and between the poses by Coal; without those beside ``kept``, which may grow."""
    scene = followed.scene
    places = ((row, tuple(own.point(row) for own in layouts.placements)) for row in rows.tolist())
    apart_ones = (place for place in places if _distinct(place[1], kept, apart))
    while some := list(islice(apart_ones, BATCH)):
        check_stop()
        points = [own for _, own in some]
        violations = np.maximum(scene.contact_violations(points), scene.floor_violations(points))
        for (row, own), violation in zip(some, violations.tolist(), strict=True):
            seen = float(layouts.violations[row])
            worst = max(violation, scene.tie_violation(own), seen if seen > LIMITS else 0.0)
            yield Start(followed.at_poses(own), float(layouts.objective[row]), worst)


def _distinct(points: Sequence[ArmSolution], others: Sequence[Start], apart: float) -> bool:
    """False beside an earlier start in the same postures."""
    return not any(nearby(points, other.points, apart) for other in others)
