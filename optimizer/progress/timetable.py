"""How far a solve is, and about how long it still takes: stages with the time each is expected to take."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

from duocell.models.cell.cell import Cell
from duocell.optimizer.budget import LEAST, MOST, search_time
from duocell.optimizer.monitoring.events import Stage
from duocell.optimizer.monitoring.watch import check_stop, tell
from duocell.optimizer.settings import Settings

Progress = Callable[[str, float], None]
"""Called with what is being done and the fraction done so far."""

VERIFY, BASELINE, TOLERANCE, EXPLAIN = 0.02, 1.0, 1.0, 5.0
"""s that a check, a baseline, a tolerance and an explanation take, roughly."""
TRUST = 0.2
"""Share of the whole after which what was seen counts as much as what was expected."""


class Timetable:
    """Tells of the stages of one solve: share of the whole that lies behind, and s that are probably left.

    Both are guesses. The share never falls, and the time left is never more than what limits leave.
    """

    def __init__(self, stages: Sequence[tuple[str, float]], most: float, progress: Progress | None = None) -> None:
        """Nothing is told yet.

        Args:
            stages: names, in order, and the s each is expected to take.
            most: s after which limits end it all.
            progress: told beside whoever watches.
        """
        self._stages = dict(stages)
        self._total = sum(self._stages.values())
        self._most, self._progress = most, progress
        self._began = time.perf_counter()
        self._done = 0.0

    def stage(self, name: str) -> Progress:
        """What is to be called within a stage, with words and the share of the stage that is done."""
        names = list(self._stages)
        before = sum(self._stages[one] for one in names[: names.index(name)])

        def report(what: str, share: float) -> None:
            check_stop()
            self._done = max(self._done, min((before + share * self._stages[name]) / self._total, 1.0))
            tell(Stage(what, self._done, self._left()))
            if self._progress is not None:
                self._progress(what, self._done)

        return report

    def _left(self) -> float:
        """s: what was expected of the rest, at the pace seen so far."""
        elapsed = time.perf_counter() - self._began
        pace = (elapsed + TRUST * self._total) / ((self._done + TRUST) * self._total)
        return max(min((1.0 - self._done) * self._total * pace, self._most - elapsed), 0.0)


def timetable(cell: Cell, settings: Settings, progress: Progress | None = None) -> Timetable:
    """The stages of `duocell.optimizer.optimize` for a cell: arms, together, proof, checks, and whatever is asked."""
    proof, most = 0.0, settings.time_limit
    seconds = search_time(cell)
    if settings.certificate is not None:
        proof = min(max(seconds, LEAST), MOST)
        if settings.certificate != "auto":
            proof = min(proof, settings.certificate.time_limit)
            most += settings.certificate.time_limit
    together = cell.coupled or settings.alternatives > 0
    alone = min(seconds, 0.2 * seconds + 0.1) if together else seconds
    after = {
        "explain": EXPLAIN if settings.explain else 0.0,
        "tolerance": 0.0 if settings.tolerance is None else TOLERANCE,
        "baselines": BASELINE * len(settings.baselines),
    }
    stages = [("arms", alone), ("together", max(seconds - alone, 0.0)), ("proof", proof), ("verify", VERIFY)]
    return Timetable(
        [*stages, *after.items()], most + settings.time_limit * settings.explain + after["baselines"], progress
    )
