"""What the trials share: a seeded draw per task, records that are continued where they stopped, and a table.

A trial is a command ``python -m bench.ROOM.NAME [--count N] [--first SEED] [--seconds S] [--file PATH]``. Every task
has a number; its draw depends on the trial's name and this number alone. Records are lines of JSON, appended as they
are made, so a trial that was stopped goes on where it was; a number that is in the file is not tried again.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter, process_time
from typing import Any
from zlib import crc32

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings

Record = dict[str, Any]
"""One line of a trial: plain JSON, with the number of the task under ``seed``."""
WORSE = 1e-3
"""Relative; an objective that is this much above a known one is not the best."""


@dataclass(frozen=True, slots=True)
class Options:
    """What a trial is asked for: numbers ``first`` to ``first + count - 1``, at most about ``seconds`` of them."""

    count: int
    first: int = 0
    seconds: float | None = None
    file: Path | None = None


@dataclass(frozen=True, slots=True)
class Answer:
    """duocell's answer to one task.

    Attributes:
        word: its outcome, or "error". objective: E, or None.
        seconds: wall time. cpu: CPU time, s. first: s until its first usable layout, None where it does not say.
        detail: of an error, or its first reason. layout: all of it; None after an error.
    """

    word: str
    objective: float | None
    seconds: float
    cpu: float
    first: float | None
    detail: str
    layout: Layout | None

    @property
    def record(self) -> Record:
        """What is kept of it."""
        names = ("word", "objective", "seconds", "cpu", "first", "detail")
        return {name: getattr(self, name) for name in names}


def draw_of(trial: str, seed: int) -> np.random.Generator:
    """The random numbers of one task of a trial."""
    return np.random.default_rng([crc32(trial.encode()), seed])


def ask(cell: Cell, settings: Settings | None = None) -> Answer:
    """Solve a cell; an error is an answer too."""
    began, busy = perf_counter(), process_time()
    try:
        layout = optimize(cell, settings)
    except Exception as error:
        spent = perf_counter() - began, process_time() - busy
        return Answer("error", None, *spent, None, f"{type(error).__name__}: {error}"[:300], None)
    seconds, cpu = perf_counter() - began, process_time() - busy
    first = getattr(layout.search, "first_feasible_time", None)
    detail = layout.reasons[0].detail if layout.reasons else ""
    return Answer(layout.outcome.value, layout.objective, seconds, cpu, first, detail, layout)


def is_worse(objective: float | None, known: float | None, share: float = WORSE) -> bool:
    """True if something is known and the objective is missing or more than ``share`` above it."""
    return known is not None and (objective is None or objective > known * (1.0 + share) + 1e-9)


def options_of(text: str | None, count: int, arguments: Sequence[str] | None = None) -> Options:
    """Read the command line of a trial; ``text`` explains it, ``count`` is the default number of tasks."""
    parser = argparse.ArgumentParser(description=text, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, count)
    return options_from(parser.parse_args(arguments))


def add_options(parser: argparse.ArgumentParser, count: int) -> None:
    """The options that all trials have."""
    parser.add_argument("--count", type=int, default=count, help=f"tasks; {count} if not given")
    parser.add_argument("--first", type=int, default=0, metavar="SEED", help="number of the first task")
    parser.add_argument("--seconds", type=float, metavar="S", help="begin no further task after S seconds")
    parser.add_argument("--file", type=Path, metavar="PATH", help="records; what stands there is not tried again")


def options_from(given: argparse.Namespace) -> Options:
    """The options of `add_options`."""
    return Options(given.count, given.first, given.seconds, given.file)


def run(options: Options, attempt: Callable[[int], Record], say: Callable[[Record], str] | None = None) -> list[Record]:
    """Try the numbers asked for.

    Args:
        options: which of them, and where records are kept.
        attempt: record of one number, plain JSON without ``seed``.
        say: one line for the terminal about a record; None to be silent.

    Returns:
        The records of these numbers in order, those of earlier runs among them.
    """
    known = {record["seed"]: record for record in read(options.file)}
    began = perf_counter()
    wanted = range(options.first, options.first + options.count)
    for seed in wanted:
        if seed in known:
            continue
        if options.seconds is not None and perf_counter() - began > options.seconds:
            break
        known[seed] = {"seed": seed, **attempt(seed)}
        append(options.file, known[seed])
        if say is not None:
            print(say(known[seed]), flush=True)
    return [known[seed] for seed in wanted if seed in known]


def read(file: Path | None) -> list[Record]:
    """The records of a file; none where there is no file. A line cut off by the end of a run is passed over."""
    if file is None or not file.exists():
        return []
    records = []
    for line in file.read_text(encoding="utf-8").splitlines():
        try:
            records.append(json.loads(line))
        except json.JSONDecodeError:
            continue
    return records


def append(file: Path | None, record: Mapping[str, Any]) -> None:
    """Keep a record, on a line of its own whatever the last run left."""
    if file is None:
        return
    file.parent.mkdir(parents=True, exist_ok=True)
    with file.open("a+b") as stream:
        if stream.tell() and not _ends_a_line(file):
            stream.write(b"\n")
        stream.write(json.dumps(record).encode() + b"\n")


def _ends_a_line(file: Path) -> bool:
    return file.read_bytes().endswith(b"\n")


def table(head: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """A table in Markdown; numbers with four digits, None as a dash."""
    lines = ["| " + " | ".join(head) + " |", "|" + "---|" * len(head)]
    return "\n".join([*lines, *("| " + " | ".join(map(_cell, row)) + " |" for row in rows)])


def _cell(value: object) -> str:
    if value is None:
        return "–"
    return f"{value:.4g}" if isinstance(value, float) else str(value)
