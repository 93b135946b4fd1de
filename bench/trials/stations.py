"""Station tasks, with a plain random search beside duocell: ``python -m bench.trials.stations``.

The random search draws bases and takes the first that has a branch which reaches all stations and hits nothing, by
kinematics of its own and by Coal. duocell must solve whatever it solves, and whatever the task was made around.
"""

from __future__ import annotations

from dataclasses import dataclass
from time import process_time

import numpy as np

from bench.draws.station_draw import NAME, StationTask, bodies_at, is_clean, own_station_task, station_task
from bench.judges.dense_check import dense_check
from bench.searches.own_stands import own_stands
from bench.trials.trial import Record, ask, draw_of, options_of, run, table
from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings

RANDOM_SECONDS = 10.0
"""CPU s of the random search."""
BATCH = 64
SETTINGS = Settings(time_limit=120.0)
STEPS = 5e-3, 0.02
"""m and rad; steps of the dense check, where nothing moves inside a segment."""


@dataclass(frozen=True, eq=False)
class Found:
    """What a random search found: stand (4,) and joints (m, 6), None without; bases tried, CPU s."""

    stand: Floats | None
    joints: Floats | None
    tried: int
    seconds: float


def random_search(task: StationTask, seconds: float, rng: np.random.Generator, most: int | None = None) -> Found:
    """Draw bases in the region until one serves all stations.

    Args:
        task: what has to be done; of the layout that it was made around nothing is used.
        seconds: CPU time after which it gives up.
        rng: of the bases.
        most: bases after which it gives up.
    """
    began, own, base = process_time(), own_station_task(task), task.cell.arms[0].base
    bounds = np.array([[side.low, side.high] for side in (base.x, base.y, base.z, base.yaw)])
    tried = 0
    while process_time() - began < seconds and (most is None or tried < most):
        stands = rng.uniform(bounds[:, 0], bounds[:, 1], (BATCH, 4))
        made = own_stands(own, stands[:, :3], stands[:, 3])
        for k in np.flatnonzero(made.usable.any(axis=0)):
            bodies = bodies_at(task.cell, stands[k])
            for branch in np.flatnonzero(made.usable[:, k]):
                joints = made.joints[branch, k]
                if is_clean(task.cell, bodies, joints[::2]):
                    return Found(stands[k], joints, tried + int(k) + 1, process_time() - began)
        tried += BATCH
    return Found(None, None, tried, process_time() - began)


def attempt(seed: int, settings: Settings = SETTINGS) -> Record:
    """duocell and the random search on one task."""
    task = station_task(seed)
    found = random_search(task, RANDOM_SECONDS, draw_of(NAME + " random", seed))
    answer = ask(task.cell, settings)
    faults = [] if answer.layout is None else faults_of(task.cell, answer.layout)
    return answer.record | {
        "kind": task.kind,
        "random": found.stand is not None,
        "tried": found.tried,
        "random_cpu": found.seconds,
        "faults": faults,
    }


def faults_of(cell: Cell, layout: Layout) -> list[str]:
    """What the dense check says against a usable layout."""
    if not layout.usable:
        return []
    placement = layout.placements[0]
    stand = np.array([[*placement.position, placement.yaw]])
    return dense_check(cell, stand, [placement.joints], *STEPS).faults


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    print(summary(run(options_of(__doc__, 300, arguments), attempt, say)))
    return 0


def say(record: Record) -> str:
    """One line about a record."""
    first = "-" if record["first"] is None else f"{_first(record):.2f}"
    beside = f"{record['random_cpu']:.2f} s, {record['tried']} bases" if record["random"] else "no"
    what = f"{record['seed']:4d} {record['kind']:6} {record['word']:10} first {first} s cpu {record['cpu']:.2f} s"
    return f"{what}  random {beside}  {verdict(record)}"


def verdict(record: Record) -> str:
    """What is wrong; every task has a layout, whether the random search found one or not."""
    if record["word"] == "error":
        return f"ERROR {record['detail']}"
    if record["word"] == "infeasible":
        return "WRONG NO"
    if record["faults"]:
        return f"UNSOUND {record['faults'][0]}"
    if record["objective"] is None:
        return "MISSED, random has it" if record["random"] else "missed by both"
    return ""


def summary(records: list[Record]) -> str:
    """The table: who solved what, by kind."""
    rows = []
    for kind in [*dict.fromkeys(record["kind"] for record in records), "all"]:
        some = [record for record in records if kind in (record["kind"], "all")]
        solved = [record["objective"] is not None for record in some]
        beside = [record["random"] for record in some]
        said = [verdict(record) for record in some]
        counts = [sum(word.startswith(w) for word in said) for w in ("WRONG NO", "MISSED", "UNSOUND", "ERROR")]
        firsts = [_first(record) for record in some if record["first"] is not None]
        first = float(np.median(firsts)) if firsts else None
        cpu = [float(np.median([record[name] for record in some])) for name in ("cpu", "random_cpu")]
        rows.append([kind, len(some), sum(solved), sum(beside), *counts, first, *cpu])
    head = ["kind", "tasks", "solved", "random", "wrong no", "only random", "unsound", "error"]
    return table([*head, "first usable CPU s, median", "CPU s, median", "random CPU s, median"], rows)


def _first(record: Record) -> float:
    """CPU s until the first usable layout: the time on the clock, less what others had of the processor."""
    share = record["cpu"] / max(record["seconds"], 1e-9)
    return float(record["first"] * min(share, 1.0))


if __name__ == "__main__":
    raise SystemExit(main())
