"""Layouts to refine from: measured by Coal, those that keep everything first, one of every neighbourhood."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from models.arrays import Ints
from optimizer.coupled.candidates.extender import Layouts
from optimizer.coupled.candidates.followed import Followed
from optimizer.coupled.refine import nearby
from optimizer.coupled.scene import LIMITS
from optimizer.program import ArmPoint
from optimizer.watch import check_stop

APART = 0.12
"""m; layouts of the same postures whose bases are all nearer than this count as one start."""
BATCH = 16
"""Layouts measured together."""
MEASURED = 160
"""Layouts measured at most."""


@dataclass(frozen=True, eq=False, slots=True)
class Start:
    """One point per arm.

    Attributes:
        points: one per arm. objective: E. lack: largest shortfall [m], <= 0 if none.
    """

    points: tuple[ArmPoint, ...]
    objective: float
    lack: float

    @property
    def clean(self) -> bool:
        """True if it keeps everything at the poses."""
        return self.lack <= LIMITS

    def score(self, price: float) -> float:
        """E with the shortfall made dear."""
        return self.objective + price * max(self.lack, 0.0)


def starts_of(followed: Followed, layouts: Layouts, clean: int, others: int, apart: float = APART) -> list[Start]:
    """Distinct starts: up to ``clean`` that keep everything at the poses, cheapest first, then ``others`` that do not.

    Args:
        followed: the cell. layouts: those first that seem to keep everything. apart: m, see `APART`.
    """
    seems = layouts.lacks <= LIMITS
    kept: list[Start] = []
    spoilt: list[Start] = []
    for start in _measured(followed, layouts, np.flatnonzero(seems)[:MEASURED]):
        if not start.clean:
            spoilt.append(start)
        elif _distinct(start, kept, apart):
            kept.append(start)
        if len(kept) >= clean:
            break
    rest = [*spoilt[:others], *_measured(followed, layouts, np.flatnonzero(~seems)[: 2 * others])]
    near: list[Start] = []
    for start in sorted(rest, key=lambda one: one.objective):
        if len(near) < others and _distinct(start, [*kept, *near], apart):
            near.append(start)
    return [*kept, *near]


def _measured(followed: Followed, layouts: Layouts, rows: Ints) -> Iterator[Start]:
    """Layouts with what they lack at and between the poses by Coal."""
    scene = followed.scene
    for at in range(0, len(rows), BATCH):
        check_stop()
        some = rows[at : at + BATCH]
        points = [tuple(own.point(int(row)) for own in layouts.placements) for row in some]
        lacks = scene.contact_lacks(points)
        for row, own, lack in zip(some, points, lacks, strict=True):
            seen = float(layouts.lacks[row])
            worst = max(float(lack), scene.tie_lack(own), scene.floor_lack(own), seen if seen > LIMITS else 0.0)
            yield Start(followed.at_poses(own), float(layouts.objective[row]), worst)


def _distinct(start: Start, others: Sequence[Start], apart: float) -> bool:
    """False beside an earlier start in the same postures."""
    return not any(nearby(start.points, other.points, apart) for other in others)
