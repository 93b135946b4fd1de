"""Tasks and six images of each, in which the answer must be the same: ``python -m bench.trials.invariance``.

Single arms with a closed form, arms without, tied arms and cells with obstacles take turns. The word and, to 1e-6 of
it, the objective must be those of the task as it was drawn.
"""

from __future__ import annotations

import numpy as np

from bench.draws.cells import CELLS, real_cell
from bench.draws.images import images
from bench.draws.redundant_draw import arms_without_reduction, drawn_cell
from bench.random_arms import draw as single
from bench.trials.coupled_tasks import coupled_task
from bench.trials.trial import Record, ask, draw_of, options_of, run, table
from duocell.models.cell.cell import Cell
from duocell.optimizer.settings import Settings

NAME = "invariance"
SAME = 1e-6
"""Relative difference of objectives that are the same."""
KINDS = ("single", "seven", "coupled", "cell")
SETTINGS = Settings(time_limit=900.0)


def task_of(seed: int) -> Cell:
    """Task ``seed``; the kinds take turns."""
    kind, number = KINDS[seed % len(KINDS)], seed // len(KINDS)
    if kind == "single":
        kinds = tuple(single.KINDS)
        return single.draw(kinds[number % len(kinds)], number // len(kinds))
    if kind == "seven":
        robots = arms_without_reduction(endless=False)
        return drawn_cell(draw_of(NAME, seed), robots[number % len(robots)])
    return coupled_task(number).cell if kind == "coupled" else real_cell(number % CELLS).cell


def attempt(seed: int) -> Record:
    """One task and its images."""
    cell = task_of(seed)
    drawn = ask(cell, SETTINGS)
    record: Record = {
        "kind": KINDS[seed % len(KINDS)],
        "name": cell.name,
        "robots": [arm.robot.name for arm in cell.arms],
        "word": drawn.word,
        "objective": drawn.objective,
        "cpu": drawn.cpu,
        "images": {},
    }
    for name, image in images(cell, draw_of(NAME + " images", seed)).items():
        answer = ask(image, SETTINGS)
        record["images"][name] = {"word": answer.word, "objective": answer.objective, "detail": answer.detail}
    return record


def differences(record: Record) -> list[str]:
    """What is not the same in which image."""
    found = []
    for name, image in record["images"].items():
        if image["word"] != record["word"]:
            found.append(f"{name}: {record['word']} -> {image['word']}")
        elif change(record["objective"], image["objective"]) > SAME:
            found.append(f"{name}: {record['objective']:.9g} -> {image['objective']:.9g}")
    return found


def change(one: float | None, other: float | None) -> float:
    """Relative difference of two objectives; infinite where one is missing."""
    if one is None or other is None:
        return 0.0 if one is other else np.inf
    return abs(one - other) / max(abs(one), abs(other), 1e-9)


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    print(summary(run(options_of(__doc__, 200, arguments), attempt, say)))
    return 0


def say(record: Record) -> str:
    """One line about a record."""
    what = f"{record['seed']:4d} {record['kind']:7} {'+'.join(record['robots']):24} {record['word']:10}"
    return f"{what} {record['cpu']:6.2f} s  {'; '.join(differences(record))}"


def summary(records: list[Record]) -> str:
    """The table: what changed, by kind."""
    rows = []
    for kind in [*dict.fromkeys(record["kind"] for record in records), "all"]:
        some = [record for record in records if kind in (record["kind"], "all")]
        pairs = [(r, image) for r in some for image in r["images"].values()]
        words = sum(r["word"] != image["word"] for r, image in pairs)
        values = [change(r["objective"], image["objective"]) for r, image in pairs]
        finite = [value for value in values if np.isfinite(value)]
        changed = sum(value > SAME for value in values)
        tasks = sum(bool(differences(record)) for record in some)
        rows.append([kind, len(some), len(pairs), tasks, words, changed, max(finite, default=0.0)])
    return table(["kind", "tasks", "images", "tasks that change", "words", "objectives", "most"], rows)


if __name__ == "__main__":
    raise SystemExit(main())
