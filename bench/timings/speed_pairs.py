"""Old and new interleaved: ``python -m bench.timings.speed_pairs CHECKOUT [--pairs N] [--tasks NAME ...]``.

Every measurement is a process of its own, in the other checkout and in this one by turns, both with this interpreter.
The cells are made here and handed over, so both are asked the same, without certificate; `line` is asked with the
automatic certificate too, here only. CPU time is taken inside, after a first call that is not counted.
"""

from __future__ import annotations

import argparse
import json
import os
import pickle
import subprocess
import sys
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory

import numpy as np
import pinocchio as pin

from bench.comparison.tasks import thesis_line
from bench.draws.beam import beam_cell
from bench.draws.cells import real_cell
from bench.draws.known_cells import case
from bench.timings.plain import pair
from bench.trials.trial import Record, append, table
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task

HERE = Path(__file__).resolve().parents[2]
CHOSEN = (1, 4, 8, 11, 12)
"""Of the hundred cells."""
WORKER = """
import importlib, json, pathlib, pickle, sys, time
rooted = pathlib.Path("src/duocell").is_dir()
def module(name):
    root, *rooms, last = name.removeprefix("duocell.").split(".")
    ways = [".".join([root, *rooms[k:], last]) for k in range(len(rooms) + 1)]
    for way in ways:
        try:
            return importlib.import_module(("duocell." if rooted else "") + way)
        except ModuleNotFoundError:
            continue
    raise ModuleNotFoundError(name)
class Reader(pickle.Unpickler):
    def find_class(self, name, member):
        ours = name.split('.')[0] == 'duocell'
        return getattr(module(name), member) if ours else super().find_class(name, member)
optimize = module("duocell.optimizer.optimize").optimize
Settings = module("duocell.optimizer.settings").Settings
with open(sys.argv[1], "rb") as file:
    warm, cell = Reader(file).load()
count, auto = int(sys.argv[2]), sys.argv[3] == "auto"
settings = Settings(time_limit=300.0) if auto else Settings(time_limit=300.0, certificate=None)
optimize(warm, settings)
cpu, wall = [], []
for _ in range(count):
    began, busy = time.perf_counter(), time.process_time()
    layout = optimize(cell, settings)
    cpu.append(time.process_time() - busy)
    wall.append(time.perf_counter() - began)
first = getattr(layout.search, "first_feasible_time", None)
first = None if first is None else first * cpu[-1] / wall[-1]
answer = {"word": layout.outcome.value, "objective": layout.objective, "first": first}
print(json.dumps({"cpu": sorted(cpu)[count // 2], "wall": sorted(wall)[count // 2], **answer}))
"""
"""Runs in either checkout: cell in a file, number of calls, "auto" for the automatic certificate. Older versions have
the same modules in fewer rooms and without a common root."""


@dataclass(frozen=True, slots=True)
class Compared:
    """What is measured: name, the cell, the one for the first call, and how many calls a process times."""

    name: str
    make: Callable[[], Cell]
    warm: Callable[[], Cell]
    calls: int = 1


def compared() -> list[Compared]:
    """All of them, in order."""
    line, iiwa = lambda: thesis_line(10), lambda: pair("iiwa14")
    chance = [Compared(f"cell {n:02d}", _numbered(n), line) for n in CHOSEN]
    return [
        Compared("line", line, line, 5),
        Compared("iiwa14 pair", iiwa, iiwa, 3),
        Compared("beam cell", beam_cell, line),
        Compared("door cell", lambda: case("door_cell"), line),
        *chance,
        Compared("beam, 1,000 poses", lambda: with_poses(beam_cell(), 1000), line),
    ]


def _numbered(number: int) -> Callable[[], Cell]:
    return lambda: real_cell(number).cell


def with_poses(cell: Cell, count: int) -> Cell:
    """The cell with ``count`` poses along the way of its object, as many between any two as their distance asks for."""
    poses = cell.task.poses
    turns = [pin.log3(a[:3, :3].T @ b[:3, :3]) for a, b in pairwise(poses)]
    length = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) + 0.3 * np.linalg.norm(turns, axis=1)
    way = np.concatenate([[0.0], np.cumsum(np.maximum(length, 1e-9))])
    made = np.tile(np.eye(4), (count, 1, 1))
    for k, at in enumerate(np.linspace(0.0, way[-1], count)):
        i = min(int(np.searchsorted(way, at, side="right")) - 1, len(turns) - 1)
        share = (at - way[i]) / (way[i + 1] - way[i])
        made[k, :3, :3] = poses[i, :3, :3] @ pin.exp3(share * turns[i])
        made[k, :3, 3] = (1.0 - share) * poses[i, :3, 3] + share * poses[i + 1, :3, 3]
    return replace(cell, task=Task(made))


def measure(checkout: Path, file: Path, calls: int, auto: bool) -> Record:
    """One process in one checkout."""
    environment = os.environ | {"PYTHONPATH": str(checkout / "src")}
    command = [sys.executable, "-c", WORKER, str(file), str(calls), "auto" if auto else "none"]
    done = subprocess.run(command, cwd=checkout, env=environment, capture_output=True, text=True, check=False)
    if done.returncode:
        return {"word": "error", "detail": done.stderr.strip().splitlines()[-1:]}
    found: Record = json.loads(done.stdout.splitlines()[-1])
    return found


def _plain(cell: Cell) -> Cell:
    """The cell without the named frames of its robots, which older versions do not have and nothing here needs."""
    arms = [replace(arm, robot=replace(arm.robot, flanges=(), mounting_face=None)) for arm in cell.arms]
    return replace(cell, arms=tuple(arms))


def compare(old: Path, task: Compared, pairs: int, note: Callable[[Record], None]) -> list[Record]:
    """One task: both by turns, who is first alternates; ``note`` is told of every measurement."""
    records: list[Record] = []
    ways = [("old", old, False), ("new", HERE, False), *([("auto", HERE, True)] if task.name == "line" else [])]
    with TemporaryDirectory() as folder:
        file = Path(folder) / "cell.pickle"
        file.write_bytes(pickle.dumps((_plain(task.warm()), _plain(task.make()))))
        for number in range(pairs):
            for who, checkout, auto in ways if number % 2 == 0 else reversed(ways):
                found = measure(checkout, file, task.calls, auto)
                records.append({"task": task.name, "pair": number, "who": who, **found})
                note(records[-1])
    return records


def summary(records: Sequence[Record]) -> str:
    """Medians of old and new, and the median of the ratios within the pairs."""
    rows = []
    for name in dict.fromkeys(record["task"] for record in records):
        mine = {who: [r for r in records if (r["task"], r["who"]) == (name, who)] for who in ("old", "new", "auto")}
        pairs: dict[int, dict[str, float]] = {r["pair"]: {} for r in records if r["task"] == name}
        for record in records:
            if record["task"] == name and "cpu" in record:
                pairs[record["pair"]][record["who"]] = record["cpu"]
        ratios = [both["new"] / both["old"] for both in pairs.values() if {"old", "new"} <= set(both)]
        times = [_median(mine[who], "cpu") for who in ("old", "new")]
        rows.append(
            [name, len(pairs), *times, median(ratios) if ratios else None, _answer(mine["old"]), _answer(mine["new"])]
        )
        rows[-1] += [_median(mine["new"], "first"), _median(mine["auto"], "cpu")]
    head = [
        "task",
        "pairs",
        "old CPU s",
        "new CPU s",
        "new / old",
        "old answer",
        "new answer",
        "new, first usable, CPU s",
    ]
    return table([*head, "with automatic certificate, CPU s"], rows)


def _median(records: Sequence[Record], key: str) -> float | None:
    values = [record[key] for record in records if record.get(key) is not None]
    return float(median(values)) if values else None


def _answer(records: Sequence[Record]) -> str:
    """Words and objectives that were given."""
    given = {(r["word"], None if r.get("objective") is None else f"{r['objective']:.6g}") for r in records}
    return ", ".join(f"{word} {value or ''}".strip() for word, value in sorted(given, key=str))


def main(arguments: list[str] | None = None) -> int:
    """Measure."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    names = [task.name for task in compared()]
    parser.add_argument("old", type=Path, metavar="CHECKOUT", help="of the version that is compared with")
    parser.add_argument("--pairs", type=int, help="of every task; 30 of line and 3 of the others if not given")
    parser.add_argument("--tasks", nargs="+", choices=names, default=names, metavar="NAME", help=", ".join(names))
    parser.add_argument("--file", type=Path, metavar="PATH", help="measurements are appended to it")
    given = parser.parse_args(arguments)

    def note(record: Record) -> None:
        append(given.file, record)
        print(json.dumps(record), flush=True)

    records: list[Record] = []
    for task in compared():
        if task.name in given.tasks:
            count = given.pairs or (30 if task.name == "line" else 3)
            records += compare(given.old.resolve(), task, count, note)
    print(summary(records))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
