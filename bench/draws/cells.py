"""Real cells: a hundred random ones with obstacles, floor and couplings, and the beam of the example.

from bench.draws.cells import beam_cell, real_cell, real_cells
real_cell(seed).cell, real_cell(seed).known      # seeds 0 to 99
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from bench.draws.beam import beam_cell
from bench.draws.cell_draw import PAIRS, Known, draw
from bench.draws.cell_furniture import blocked, coupled, with_floor, with_obstacles, with_yaws
from duocell.models.cell.cell import Cell

__all__ = ["CELLS", "RealCell", "beam_cell", "quick_cells", "real_cell", "real_cells"]

CELLS = 100


@dataclass(frozen=True, eq=False)
class RealCell:
    """A random cell and what is known about it.

    Attributes:
        name: unique.
        kind: "open": ``known`` is a layout that works; "cluttered": obstacles without regard to a layout, nobody knows;
            "blocked": impossible, for the reason in ``why``.
        cell: the problem.
        known: a layout that works, or None.
        why: of the blocked ones.
    """

    name: str
    kind: str
    cell: Cell
    known: Known | None
    why: str = ""


BLOCKED = (
    "an obstacle in the part's way",
    "no free floor for one arm",
    "one arm too far away",
    "the bases must stand in each other",
    "a wall between one arm and the part",
)


@lru_cache(maxsize=CELLS)
def real_cell(seed: int) -> RealCell:
    """Cell ``seed``: of ten, eight are open, the fourth is blocked and the eighth is cluttered."""
    rng = np.random.default_rng([20261, seed])
    drawn = draw(rng, PAIRS[seed % len(PAIRS)])
    drawn, couplings = coupled(rng, drawn)
    kind = {3: "blocked", 7: "cluttered"}.get(seed % 10, "open")
    cell = with_obstacles(rng, drawn, heed=kind != "cluttered")
    cell = with_yaws(rng, drawn, with_floor(rng, drawn, cell))
    name = f"cell {seed:02d}"
    cell = replace(cell, couplings=couplings, name=name)
    if kind == "blocked":
        how = seed // 10 % len(BLOCKED)
        return RealCell(name, kind, blocked(rng, drawn, cell, how), None, BLOCKED[how])
    return RealCell(name, kind, cell, drawn.known if kind == "open" else None)


def real_cells(count: int = CELLS) -> Iterator[RealCell]:
    """The first ``count`` cells."""
    return map(real_cell, range(count))


def quick_cells() -> Iterator[RealCell]:
    """The first ten: eight open, one blocked, one cluttered."""
    return real_cells(10)
