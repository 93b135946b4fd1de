"""``python -m bench [timings|cells|peers|thesis ...] [--quick] [--docs]``: measures, prints, stores in build/bench/."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from collections.abc import Sequence
from dataclasses import asdict, replace
from functools import partial
from pathlib import Path
from time import perf_counter
from typing import Any

from bench.comparison import cell_tables, chart, report, tables
from bench.comparison.real_cells import CellResult, run_beam, run_cell
from bench.comparison.run import FORMS, TaskResult, run_task
from bench.comparison.tasks import all_tasks, quick_tasks
from bench.comparison.thesis import thesis_table
from bench.draws.cells import quick_cells, real_cells
from bench.timings import plain
from duocell.optimizer.settings import Settings

OUTPUT = Path("build/bench")
PAGE, PICTURE = Path("docs/benchmarks.md"), "benchmarks.png"
CHARTED = "line"
"""Task of the chart."""
PARTS = ("timings", "cells", "peers", "thesis")
"""In the order of the page's sections."""
SEARCH_LIMIT = 60.0
"""s, for each exhaustive search."""


def main() -> int:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="default: all of them")
    parser.add_argument("--quick", action="store_true", help="few tasks, cells and runs: minutes, not an hour")
    parser.add_argument("--scale", type=float, default=1.0, metavar="F", help="multiply all time limits by F")
    parser.add_argument("--docs", action="store_true", help=f"write what was measured into {PAGE} too")
    options = parser.parse_args()
    warnings.simplefilter("ignore")  # peers warn about bounds and precision while they search
    OUTPUT.mkdir(parents=True, exist_ok=True)
    made = {"timings": _timings, "cells": _cells, "peers": _peers, "thesis": _thesis}
    flags = [*(["--quick"] if options.quick else []), *([f"--scale {options.scale:g}"] if options.scale != 1.0 else [])]
    sections = []
    for title, part in zip(report.ORDER, PARTS, strict=True):
        if part in (options.parts or PARTS):
            command = f'make bench ARGS="{" ".join([part, *flags, "--docs"])}"'
            sections.append(report.section(title, made[part](options), command))
            (OUTPUT / f"{part}.md").write_text(sections[-1])
    if options.docs:
        PAGE.write_text(report.merged(PAGE.read_text() if PAGE.exists() else "", sections))
        if "peers" in (options.parts or PARTS):
            (PAGE.parent / PICTURE).write_bytes((OUTPUT / PICTURE).read_bytes())
    return 0


def _timings(options: argparse.Namespace) -> str:
    timings = plain.plain(3 if options.quick else 10, lambda timing: _say(timing.row()))
    _store("timings", timings)
    return report.promised(plain.table(timings))


def _cells(options: argparse.Namespace) -> str:
    limit = SEARCH_LIMIT * options.scale * (0.3 if options.quick else 1.0)
    results: list[CellResult] = []
    settings = Settings(time_limit=Settings().time_limit * options.scale)
    for real in quick_cells() if options.quick else real_cells():
        results.append(run_cell(real, limit, not options.quick, settings))
        _say(results[-1].row())
        _store("cells", results)
    beam = run_beam(1 if options.quick else 5)
    _say("\n".join(["", cell_tables.summary(results), "", cell_tables.remarks(results), "", cell_tables.beam(beam)]))
    _store("beam", beam)
    return report.cells(results, beam, settings.time_limit, limit)


def _peers(options: argparse.Namespace) -> str:
    return report.comparison(_compare(options.quick, options.scale), PICTURE)


def _thesis(options: argparse.Namespace) -> str:
    table = thesis_table(2.0 if options.quick else 10.0)
    _say(table)
    return report.thesis(table)


def _compare(quick: bool, scale: float) -> list[TaskResult]:
    """Run the comparison and store it after every task."""
    began = perf_counter()
    results: list[TaskResult] = []
    tasks = [replace(task, budget=scale * task.budget) for task in (quick_tasks() if quick else all_tasks())]
    for number, task in enumerate(tasks, start=1):
        results.append(run_task(task, 1.0 if quick else 10.0, partial(_progress, task.name)))
        _progress("", "")
        _say(f"[{number}/{len(tasks)}] {task.name}: {perf_counter() - began:.0f} s so far")
        _store("results", results)
    chart.draw(next(result for result in results if result.task == CHARTED), OUTPUT / PICTURE)
    for form in FORMS:
        _say(f"\npeers on the {form} problem\n" + tables.comparison(results, form))
    _say("\n" + tables.tasks(results) + "\n" + tables.remarks(results))
    return results


def _store(name: str, records: Sequence[Any]) -> None:
    """Keep records (dataclasses) as JSON."""
    (OUTPUT / f"{name}.json").write_text(json.dumps([asdict(record) for record in records], indent=1))


def _say(text: str) -> None:
    print(text, flush=True)


def _progress(task: str, what: str) -> None:
    """One line that is overwritten, on terminals only."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{task} {what}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
