"""Bounds at singular wrists against samples: is any usable path cheaper than the bound of its box?

``python -m bench.soundness.singular_soundness [--count N] [--first SEED] [--seconds S] [--file PATH]``. Every number
is a task of an arm with three parallel axes, singularities avoided or allowed in turn, every fifth a task sequence.
Boxes hold bases at which the wrist is in its singularity at a pose, or near it; half of the samples are beside such
lines.
"""

from __future__ import annotations

import sys

import numpy as np

from bench.draws.singular_draw import members_near_curves, singular_boxes, singular_problem
from bench.trials.trial import Record, draw_of, options_of, run, table
from duocell.optimizer.certificate.bounds.box_bounds import BoxBounder
from duocell.optimizer.reduction.reduced import evaluate_signed

ROBOTS = ("ur10e", "ur5e", "ur3e", "nova5", "cr5", "z1")
BOXES, SAMPLES = 200, 24


def attempt(seed: int) -> Record:
    """One task: usable samples, boxes with some, boxes whose bound one of them contradicts."""
    rng = draw_of("singular_soundness", seed)
    problem = singular_problem(ROBOTS[seed % len(ROBOTS)], rng, bool(seed // 6 % 2), 2 if seed % 5 == 4 else 1)
    boxes = singular_boxes(problem, rng, BOXES)
    lower = BoxBounder.of(problem).bounds(boxes, np.inf).lower
    best, samples = np.full(BOXES, np.inf), 0
    for number in range(SAMPLES):
        paths = evaluate_signed(problem, members_near_curves(problem, boxes, rng, number % 2 == 0), boxes.signs)
        usable = paths.violation[0] == 0.0
        samples += int(np.sum(usable))
        best = np.minimum(best, np.where(usable, paths.objective[0], np.inf))
    found = np.isfinite(best)
    wrong = int(np.sum(lower > best * (1.0 + 1e-9) + 1e-9))
    close = int(np.sum(lower[found] > 0.9 * best[found]))
    return {"seed": seed, "samples": samples, "boxes": int(np.sum(found)), "close": close, "wrong": wrong}


def _say(record: Record) -> str:
    return f"{record['seed']}: {record['samples']} samples in {record['boxes']} boxes, {record['wrong']} wrong"


def main() -> int:
    """Run the trial."""
    records = run(options_of(__doc__, 200), attempt, _say)
    names = ("samples", "boxes", "close", "wrong")
    totals = {name: sum(record[name] for record in records) for name in names}
    print(table(names, [tuple(totals[name] for name in names)]))
    return int(totals["wrong"] > 0)


if __name__ == "__main__":
    sys.exit(main())
