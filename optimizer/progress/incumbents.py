"""The best usable layout of the whole cell so far: when the first one was found, and an event for every better one.

Searches tell of what they find in one line, `layout_found` or `arm_found`, and need not know who listens; nothing is
recorded outside of `recording`.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field

from duocell.models.cell.cell import Cell
from duocell.models.cell.one_place import in_one_place
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import name_signs
from duocell.optimizer.clearance.clearance import PathClearance
from duocell.optimizer.monitoring.events import Incumbent, Standing
from duocell.optimizer.monitoring.watch import tell, watched
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.progress.known import Usable

BETTER = 1e-6
"""Relative gain from which on a layout is told as a better one."""


@dataclass(eq=False, slots=True)
class Incumbents:
    """What is known of one cell while it is solved.

    Attributes:
        cell: it. started: `time.perf_counter` value from which times count.
        objective: E of the best usable layout, or None. first_time: s, when the first one was found, or None.
        best: that layout.
    """

    cell: Cell
    started: float
    objective: float | None = None
    first_time: float | None = None
    best: Usable | None = None
    _arms: dict[str, tuple[float, ArmSolution]] = field(default_factory=dict)

    def found(self, points: Sequence[ArmSolution], objective: float, path: PathClearance | None = None) -> None:
        """Take a usable layout, one point per arm, into account, with the check of its whole way if that is at hand."""
        if in_one_place(self.cell.arms, [point.position for point in points]):
            return  # it is not allowed, though the search was not told
        seconds = time.perf_counter() - self.started
        if self.first_time is None:
            self.first_time = seconds
        if self.objective is not None and objective >= self.objective * (1.0 - BETTER):
            return
        self.objective = objective
        self.best = Usable(self.cell, tuple(points), seconds, path)
        if watched():
            standing = (_standing(self.cell, arm, point) for arm, point in zip(self.cell.arms, points, strict=True))
            tell(self.best)
            tell(Incumbent(objective, seconds, tuple(standing)))

    def found_alone(self, arm: Arm, point: ArmSolution, objective: float) -> None:
        """Take a usable place of one arm into account, where nothing ties it to the others."""
        known = self._arms.get(arm.name)
        if known is None or objective < known[0]:
            self._arms[arm.name] = objective, point
        if len(self._arms) == len(self.cell.arms):
            best = [self._arms[each.name] for each in self.cell.arms]
            self.found([one for _, one in best], sum(value for value, _ in best))


_recorded: ContextVar[Incumbents | None] = ContextVar("incumbents", default=None)


@contextmanager
def recording(cell: Cell, started: float) -> Iterator[Incumbents]:
    """Record what is found for a cell in the block; ``started`` is a `time.perf_counter` value."""
    incumbents = Incumbents(cell, started)
    token = _recorded.set(incumbents)
    try:
        yield incumbents
    finally:
        _recorded.reset(token)


def best_found(cell: Cell) -> Usable | None:
    """The best usable layout of a cell that was told of so far, where it is recorded."""
    incumbents = _recorded.get()
    return incumbents.best if incumbents is not None and incumbents.cell is cell else None


def layout_found(points: Sequence[ArmSolution], objective: float, path: PathClearance | None = None) -> None:
    """Tell of a layout of the whole cell that passed every check: one point per arm, E, and the check of its way."""
    incumbents = _recorded.get()
    if incumbents is not None:
        incumbents.found(points, objective, path)


def arm_found(cell: Cell, arm: Arm, point: ArmSolution, objective: float) -> None:
    """Tell of a place of one arm that passed every check of the arm; it counts where nothing couples the cell."""
    incumbents = _recorded.get()
    if incumbents is not None and cell is incumbents.cell and not cell.coupled:
        incumbents.found_alone(arm, point, objective)


def _standing(cell: Cell, arm: Arm, point: ArmSolution) -> Standing:
    x, y, z = (float(value) for value in point.position)
    posture = None if point.signs is None else name_signs(point.signs)
    cost = float(objective_of(cell, arm, point.joints))
    return Standing(arm.name, (x, y, z), float(point.yaw), posture, cost, arm.mount)
