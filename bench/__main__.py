"""``python -m bench [timings|peers|thesis ...] [--quick] [--docs]``: measures, prints, and stores in build/bench/."""

from __future__ import annotations

import argparse
import json
import sys
import warnings
from dataclasses import asdict, replace
from pathlib import Path
from time import perf_counter

from bench import chart, plain, report, tables
from bench.run import FORMS, TaskResult, run_task
from bench.tasks import all_tasks, quick_tasks
from bench.thesis import thesis_table

OUTPUT = Path("build/bench")
PAGE, PICTURE = Path("docs/benchmarks.md"), "benchmarks.png"
CHARTED = "line"
"""Task of the chart."""
PARTS = ("timings", "peers", "thesis")


def main() -> int:
    """Run what is asked for."""
    parser = argparse.ArgumentParser(prog="python -m bench", description=__doc__)
    parser.add_argument("parts", nargs="*", choices=[*PARTS, []], help="default: all of them")
    parser.add_argument("--quick", action="store_true", help="few tasks and runs: about two minutes instead of fifteen")
    parser.add_argument("--scale", type=float, default=1.0, metavar="F", help="multiply the time the searches get by F")
    parser.add_argument("--docs", action="store_true", help=f"write {PAGE} too")
    options = parser.parse_args()
    parts = options.parts or list(PARTS)
    warnings.simplefilter("ignore")  # peers warn about bounds and precision while they search
    OUTPUT.mkdir(parents=True, exist_ok=True)
    sections = []
    if "timings" in parts:
        timings = plain.plain(3 if options.quick else 10, lambda timing: _say(timing.row()))
        (OUTPUT / "timings.json").write_text(json.dumps([asdict(timing) for timing in timings], indent=1))
        sections.append(report.promised(plain.table(timings)))
    if "peers" in parts:
        sections.append(report.comparison(_compare(options.quick, options.scale), PICTURE))
    if "thesis" in parts:
        table = thesis_table(2.0 if options.quick else 10.0)
        _say(table)
        sections.append(report.thesis(table))
    arguments = " ".join([*(argument for argument in sys.argv[1:] if argument != "--docs"), "--docs"])
    text = report.page(sections, f'make bench ARGS="{arguments}"')
    (OUTPUT / PAGE.name).write_text(text)
    if options.docs:
        PAGE.write_text(text)
        if "peers" in parts:
            (PAGE.parent / PICTURE).write_bytes((OUTPUT / PICTURE).read_bytes())
    return 0


def _compare(quick: bool, scale: float) -> list[TaskResult]:
    """Run the comparison and store it after every task."""
    began = perf_counter()
    results: list[TaskResult] = []
    tasks = [replace(task, budget=scale * task.budget) for task in (quick_tasks() if quick else all_tasks())]
    for number, task in enumerate(tasks, start=1):
        results.append(run_task(task, 1.0 if quick else 10.0, lambda what, t=task.name: _progress(t, what)))
        _progress("", "")
        _say(f"[{number}/{len(tasks)}] {task.name}: {perf_counter() - began:.0f} s so far")
        (OUTPUT / "results.json").write_text(json.dumps([asdict(result) for result in results], indent=1))
    chart.draw(next(result for result in results if result.task == CHARTED), OUTPUT / PICTURE)
    for form in FORMS:
        _say(f"\npeers on the {form} problem\n" + tables.comparison(results, form))
    _say("\n" + tables.tasks(results) + "\n" + tables.remarks(results))
    return results


def _say(text: str) -> None:
    print(text, flush=True)


def _progress(task: str, what: str) -> None:
    """One line that is overwritten, on terminals only."""
    if sys.stderr.isatty():
        print(f"\r\x1b[K{task} {what}", end="", file=sys.stderr, flush=True)


if __name__ == "__main__":
    raise SystemExit(main())
