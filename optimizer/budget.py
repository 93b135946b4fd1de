"""How hard to prove where nobody says: about as hard as was searched, counted in boxes.

A time would make the word of an answer depend on how busy the machine is. Boxes do not: the same cell and settings end
with the same proof everywhere. What a box and a search cost is known well enough to count the one in the other.
"""

from __future__ import annotations

from duocell.models.cell.cell import Cell
from duocell.optimizer.settings import CertificateSettings

GAP = 1e-3
"""Relative gap of an automatic proof."""
LEAST, MOST = 0.3, 10.0
"""s that an automatic proof is worth at least and at most."""
NOTHING_FOUND = 4.0
"""Times as much where no layout is known: such a search went through all its rounds, and only a proof can answer."""
BOX, BOX_POSE = 40e-6, 2.5e-6
"""s for bounding one box of one arm: measured were 26 to 46 µs at 10 to 13 poses and 1.3 to 1.4 ms at 512."""
CELL_BOX, CELL_BOX_POSE = 350e-6, 50e-6
"""s for bounding and testing one box of an arm among its surroundings: measured were 0.6 to 0.8 ms at 6 to 9 poses, 0.9
to 1.2 ms at 13 and 2.6 ms at 41, everything included."""
ARM, ARM_POSE = 0.03, 0.3e-3
"""s for searching one arm: measured were 0.02 to 0.05 s at 10 poses and 0.16 s at 512."""
TOGETHER, TOGETHER_POSE = 1.5, 0.03
"""s for searching arms that meet each other or their surroundings: measured were 2 s at 13 poses."""
AMONG = 0.3
"""s in place of `TOGETHER` for one arm among its surroundings: measured were 0.2 to 1.4 s at 10 poses."""


def search_time(cell: Cell, found: bool = True) -> float:
    """About how long the search of a cell takes [s], from its size alone; ``found``: it ended with a layout."""
    poses = len(cell.task)
    alone = len(cell.arms) * (ARM + ARM_POSE * poses)
    together = AMONG if found and len(cell.arms) == 1 else TOGETHER
    return alone + (together + TOGETHER_POSE * poses if cell.coupled else 0.0)


def boxes_for(seconds: float, poses: int, coupled: bool = False) -> int:
    """How many boxes are bounded in a time, for a task of so many poses; ``coupled``: and tested for collisions."""
    box, pose = (CELL_BOX, CELL_BOX_POSE) if coupled else (BOX, BOX_POSE)
    return max(int(seconds / (box + pose * poses)), 1)


def automatic(cell: Cell, time_left: float, found: bool = True) -> CertificateSettings:
    """The proof that is tried unasked; ``time_left`` [s] cuts it, and it is worth more where nothing was ``found``."""
    worth = min(max(search_time(cell, found), LEAST) * (1.0 if found else NOTHING_FOUND), MOST)
    return CertificateSettings(GAP, time_left, boxes_for(worth, len(cell.task), cell.coupled))
