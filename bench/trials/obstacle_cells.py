"""Two arms among obstacles against a long search of their own: ``python -m bench.trials.obstacle_cells [--count N]``.

Cells are drawn as those of `bench.draws.cells`, other ones: a layout first, then obstacles, floor and couplings around
it. So every "no" is wrong. Judge is `bench.searches.obstructed_search`, which also begins at the drawn layout and at
duocell's own.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from bench.comparison.real_cells import energy
from bench.draws.cell_draw import PAIRS, Known, draw
from bench.draws.cell_furniture import coupled, with_floor, with_obstacles, with_yaws
from bench.judges.dense_check import dense_check, judge
from bench.searches.long_search import budget
from bench.searches.obstructed_search import obstructed_search
from bench.soundness.proved_share import keeps_wrists
from bench.trials.coupled_tasks import say, summary
from bench.trials.trial import Answer, Record, ask, draw_of, is_worse, options_of, run
from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.optimizer.settings import Settings

NAME = "obstacle_cells"
STEPS = 2e-3, 0.01
"""m and rad; steps of the dense check."""


@dataclass(frozen=True, eq=False)
class ObstacleCell:
    """A cell, the layout it was drawn around, and its scale [m]."""

    cell: Cell
    known: Known
    scale: float

    @property
    def kind(self) -> str:
        """The coupling, if there is one."""
        return self.cell.couplings[0].kind if self.cell.couplings else "free"


@lru_cache(maxsize=16)
def obstacle_cell(seed: int) -> ObstacleCell:
    """Cell ``seed``; what is drawn around a straight wrist is drawn again."""
    rng = draw_of(NAME, seed)
    while True:
        drawn = draw(rng, PAIRS[rng.integers(len(PAIRS))])
        drawn, couplings = coupled(rng, drawn)
        cell = with_obstacles(rng, drawn, heed=True)
        cell = with_yaws(rng, drawn, with_floor(rng, drawn, cell))
        cell = replace(cell, couplings=couplings[:1], name=f"{NAME} {seed}")
        if keeps_wrists(cell, drawn.known.joints):
            return ObstacleCell(cell, drawn.known, drawn.scale)


def attempt(seed: int, seconds: float | None = None) -> Record:
    """duocell and the long search on one cell; ``seconds`` of CPU time for the search if its share is not wanted."""
    task = obstacle_cell(seed)
    answer = ask(task.cell, Settings(time_limit=120.0))
    starts = [task.known.stands, *_bases(task.cell, answer)]
    found = obstructed_search(
        task.cell, task.scale, seconds or budget(answer.cpu), draw_of(NAME + " judge", seed), starts
    )
    drawn = (
        energy(task.cell, task.known)
        if dense_check(task.cell, task.known.stands, task.known.joints, *STEPS).clean
        else None
    )
    known = min((value for value in (found.objective, drawn) if value is not None), default=None)
    faults = [] if answer.layout is None or answer.objective is None else judge(task.cell, answer.layout, *STEPS).faults
    robots = [arm.robot.name for arm in task.cell.arms]
    record = answer.record | {"kind": task.kind, "robots": robots, "drawn": drawn, "faults": faults}
    return record | {"long": known, "looked": found.looked, "worse": is_worse(answer.objective, known)}


def _bases(cell: Cell, answer: Answer) -> list[Floats]:
    """(2, 4) of duocell's layout, if there is one."""
    if answer.layout is None or answer.objective is None:
        return []
    by_name = {placement.arm: placement for placement in answer.layout.placements}
    return [np.array([[*by_name[arm.name].position, by_name[arm.name].yaw] for arm in cell.arms])]


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    records = run(options_of(__doc__, 200, arguments), attempt, say)
    print(summary(records))
    for record in records:
        if record["faults"]:
            print(f"- {record['seed']} is not clean: {'; '.join(record['faults'])}")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
