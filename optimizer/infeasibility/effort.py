"""How much an explanation may still do, counted in work and not in time.

A time would make the words depend on how busy the machine is. What boxes, samples and refinements are worth on an idle
machine is known well enough to count one in the other; time only cuts: that of the processor where something takes much
longer than it is counted for, and the deadline of whoever asked.
"""

from __future__ import annotations

import time

from duocell.models.cell.cell import Cell

BOX, BOX_POSE = 150e-6, 20e-6
"""s for bounding and testing a box of an arm, and for each of its poses."""
PAIR, PAIR_POSE = 250e-6, 25e-6
"""s for looking at a pair of boxes of two arms, and for each of the poses."""
REFINEMENT, SAMPLES = 0.25, 0.5
"""s that a refinement, and a full round of samples of two arms are counted for, at 13 poses."""
HEIGHTS = 4.0
"""Times as much where heights are free: twice the samples, fewer of which are refused at once."""
POSES = 13
SLOWEST = 1.7
TOO_LONG = 1.25
"""Times as much of the processor's time as is counted may be used: by a part of an effort, and by all of it."""


class Effort:
    """What is left to be spent [s of an idle machine], perhaps as a part of a larger effort."""

    def __init__(self, worth: float, deadline: float, whole: Effort | None = None) -> None:
        """``deadline`` is a `time.perf_counter` value, soft; what is spent is spent of the whole as well."""
        self.left, self.deadline, self.whole = worth, deadline, whole
        self.cut = time.process_time() + (SLOWEST if whole is not None else TOO_LONG) * worth

    @property
    def late(self) -> bool:
        """True once time cuts."""
        here = time.process_time() > self.cut or time.perf_counter() > self.deadline
        return here or (self.whole is not None and self.whole.late)

    @property
    def over(self) -> bool:
        """True if nothing is left to be spent, or time is up."""
        return self.left <= 0.0 or self.late or (self.whole is not None and self.whole.over)

    def spend(self, worth: float) -> None:
        """Count some work."""
        self.left -= worth
        if self.whole is not None:
            self.whole.spend(worth)

    def share(self, share: float) -> Effort:
        """A share of what is left, to be spent on one thing."""
        return Effort(share * max(self.left, 0.0), self.deadline, self)

    def boxes(self, cell: Cell, count: float) -> None:
        """Count boxes that were bounded and tested."""
        self.spend(count * (BOX + BOX_POSE * len(cell.task)))

    def pairs(self, cell: Cell, count: int) -> None:
        """Count pairs of boxes that were looked at."""
        self.spend(count * (PAIR + PAIR_POSE * len(cell.task)))

    def refined(self, cell: Cell) -> None:
        """Count a refinement."""
        self.spend(REFINEMENT * _size(cell))

    def sampled(self, cell: Cell, density: float) -> None:
        """Count a round of samples."""
        heights = any(not arm.base.z.fixed for arm in cell.arms)
        self.spend(SAMPLES * density * _size(cell) * (HEIGHTS if heights else 1.0))


def _size(cell: Cell) -> float:
    return 0.5 * len(cell.arms) * (0.5 + 0.5 * len(cell.task) / POSES)
