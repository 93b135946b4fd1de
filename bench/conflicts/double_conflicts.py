"""What is said where one change is not enough.

``python -m bench.conflicts.double_conflicts [--count N] [--first SEED] [--file PATH]``

Into a cell of which a layout is known two constraints of different kinds are planted that this layout breaks. duocell
is asked why there is none, every change that is told is made as it is told, and the changed cell is solved anew.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import permutations
from time import perf_counter, process_time

import numpy as np

from bench.conflicts.planted_conflicts import KINDS, plant
from bench.draws.cells import real_cell
from bench.trials.trial import Record, options_of, run, table
from duocell.models.cell.cell import Cell
from duocell.models.geometry.shapes import Body
from duocell.optimizer.infeasibility.changes.candidates import candidates
from duocell.optimizer.infeasibility.changes.remedy import Remedy
from duocell.optimizer.infeasibility.explain import explain
from duocell.optimizer.infeasibility.requirements import everything
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.findings import Explanation
from duocell.optimizer.settings import Settings

PAIRS = tuple(permutations([kind for kind in KINDS if kind != "clearance"], 2))
AND = ", and "
"""Between two changes that are told together."""


def doubled(seed: int) -> tuple[tuple[str, str], Cell]:
    """Two kinds, and cell ``seed`` with both planted."""
    kinds = PAIRS[7 * seed % len(PAIRS)]
    number = 3 * seed
    while True:
        number += 1
        made = real_cell(number)
        if made.known is not None:
            stands = zip(made.known.stands, made.known.joints, strict=True)
            known = tuple(ArmSolution(stand[:3], float(stand[3]), q) for stand, q in stands)
            cell = plant(kinds[0], made.cell, known).cell
            return kinds, plant(kinds[1], cell, known).cell


def changed(cell: Cell, what: str) -> Cell | None:
    """The cell with a change made as its words tell it; None where no change has these words."""
    for words in what.split("; ")[0].split(AND):
        found = _moved(cell, words) or next(_told(cell, words), None)
        if found is None:
            return None
        cell = found
    return cell


def _moved(cell: Cell, words: str) -> Cell | None:
    """An obstacle put where the words say."""
    match = re.fullmatch(r"move (.+) by \d+ mm towards \(.+\), to \((.+)\)", words)
    if match is None:
        return None
    place = np.array([float(number) for number in match[2].split(", ")])
    moved = []
    for obstacle in cell.surroundings.obstacles:
        pose = obstacle.pose.copy()
        if obstacle.name == match[1]:
            pose[:3, 3] = place
        moved.append(Body(obstacle.name, pose, obstacle.shape))
    return replace(cell, surroundings=replace(cell.surroundings, obstacles=tuple(moved)))


def _told(cell: Cell, words: str) -> Iterator[Cell]:
    """Cells of changes that have these words for some amount."""
    for remedy in candidates(cell, everything(cell)):
        amount = _amount(remedy, words)
        if amount is not None:
            yield remedy.change(amount)


def _amount(remedy: Remedy, words: str) -> float | None:
    amounts = remedy.exact * np.arange(1, round(remedy.most / remedy.exact) + 1)
    return next((float(amount) for amount in (*amounts, remedy.most) if remedy.words(float(amount)) == words), None)


def attempt(seed: int) -> Record:
    """Explain one cell, and solve it with every change that is told."""
    kinds, cell = doubled(seed)
    layout = optimize(cell, Settings(time_limit=120.0))
    record: Record = {"kinds": list(kinds), "word": layout.outcome.value, "told": [], "right": 0, "behind": []}
    if layout.usable:
        return record | {"cpu": None}
    began = process_time()
    found = explain(cell, layout, 0, perf_counter() + 120.0)
    seconds = process_time() - began
    if not isinstance(found, Explanation):
        return record | {"cpu": seconds, "told": ["a layout"], "right": 1}
    told = [one.what for one in found.relaxations if one.pointer != "/task/poses"]
    cells = [changed(cell, what) for what in told]
    right = sum(one is not None and optimize(one, Settings(time_limit=120.0)).usable for one in cells)
    said = {"told": told, "right": right, "set": list(found.blocking), "behind": list(found.behind)}
    return record | said | {"cpu": seconds, "irreducible": found.irreducible}


def say(record: Record) -> str:
    """One line about a record."""
    seconds = "" if record["cpu"] is None else f"{record['cpu']:.1f} s"
    counts = f"{record['right']} of {len(record['told'])} right"
    kinds = f"{' + '.join(record['kinds']):24} {record['word']:10}"
    return f"{record['seed']:4d} {kinds} {counts}  {seconds} {record['told'][:1]}"


def summary(records: list[Record]) -> str:
    """The table; cells that have a layout all the same count for nothing."""
    some = [record for record in records if record["cpu"] is not None]
    told = sum(len(record["told"]) for record in some)
    rows = [
        [
            len(some),
            sum(bool(record["told"]) for record in some),
            sum(bool(record["told"] or record["behind"]) for record in some),
            told,
            sum(record["right"] for record in some),
            float(np.median([record["cpu"] for record in some])) if some else None,
        ]
    ]
    return table(["blocked", "a remedy", "or what is behind", "told", "solved anew", "CPU s, median"], rows)


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    print(summary(run(options_of(__doc__, 40, arguments), attempt, say)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
