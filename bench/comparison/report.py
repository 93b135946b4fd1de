"""The page of the benchmark, section by section: each says by what command and on what machine it was measured."""

from __future__ import annotations

import os
import platform
import re
from collections.abc import Sequence
from importlib.metadata import version

from bench.comparison import cell_tables, tables
from bench.comparison.real_cells import BeamResult, CellResult
from bench.comparison.run import TaskResult

ENGINES = ("numpy", "scipy", "casadi", "pin", "cma", "optuna")

HEAD = """\
# Benchmarks

Every number on this page was measured by the command that its section names; the raw records are in `build/bench/`.
"""
ORDER = (
    "Promised timings",
    "Real cells",
    "Against what people use instead",
    "The source's procedure on its own examples",
)
"""Titles of the sections."""

COMPARISON = """\
Same objective, same tasks, same machine, one thread. *Solved* means within 0.1 % of the best objective known for the
task (proved where the second table says so), in one posture, inside all limits. Times are CPU seconds until that
quality; a method that missed it on half of its tasks or more is shown with the time it was given. Ours is measured to
its end, verification included; the peers are stopped by somebody who knows the optimum, which no user does.

Peers on the full problem, as their users would pose it: x, y (z) and yaw of both arms in one vector, the inverse
kinematics of every pose for every candidate, the best posture, 1,000 per metre or radian of violation added. The
inverse kinematics are ours, one vectorised call for a path. The grid is made arm by arm, as maps are. The methods of
the source work on E(Γ) of one posture and are listed here too.

{full}

Peers on our reduced objective (one arm at a time, its position only, yaw and turns in closed form, candidates in
batches): a comparison of search methods alone.

{reduced}

{faster}Task by task:

{tasks}

{remarks}
![objective against time]({chart})
"""

CELLS = """\
A hundred seeded cells (`bench/draws/cells.py`): two arms of mixed makes, 3 to 8 obstacles, 5 to 20 poses, a beam or
plate that both hold, floor polygons, pedestals and couplings in some. Eighty are *open*: obstacles were put around a
layout that works, most of them where a layout would be if it were not for them. Ten are *cluttered*: obstacles were
thrown in without looking. Ten are *blocked* for a known reason. Times are of the first call of each cell, compiling
included; duocell's own limit was {own_limit:.0f} s.

Every layout is judged by the dense check (`bench/judges/dense_check.py`): the path in steps of 1 mm and 0.5°, followed
by Newton's method with Pinocchio, every pair of bodies by Coal, floor by Shapely, none of it shared with duocell. Every
refusal is held against an exhaustive search (`bench/judges/exhaustive.py`): lattices of 60 mm (100 mm for large arms)
for both bases, all eight postures, all pairs, best first, at most {limit:.0f} s.

{summary}

{remarks}

{beam}
"""

FASTER = """\
Some method was faster than duocell on the reduced objective of: {tasks}.
Each of these was the fastest of six on its task, was stopped at the known optimum, and its answer was not checked. On
tasks of many poses most of our time goes into IPOPT's programs over the joints of all poses, which they do without.
"""

THESIS = """\
The end points of its paths are lost in the scan; these are the project's two acceptance cases, shaped after them.
Every arm starts from both sides of the path, in the posture nearest to the reference there.

{thesis}
"""


def section(title: str, text: str, command: str) -> str:
    """A section of the page with its title and where its numbers come from.

    Args:
        title: one of `ORDER`.
        text: Markdown.
        command: that measured it.
    """
    if title not in ORDER:
        raise ValueError(f"{title!r} is no section of the page")
    return f"## {title}\n\nMade by `{command}` on {machine()}.\n\n{text.strip()}\n"


def merged(page: str, sections: Sequence[str]) -> str:
    """The page with some sections replaced or added, the others as they are.

    Args:
        page: Markdown made by this function before, or nothing.
        sections: as `section` makes them.
    """
    known: dict[str, str] = {}
    for text in [*re.split(r"^(?=## )", page, flags=re.MULTILINE), *sections]:
        title = text.partition("\n")[0].removeprefix("## ")
        if title in ORDER:
            known[title] = text.strip() + "\n"
    return "\n".join([HEAD, *(known[title] for title in ORDER if title in known)])


def machine() -> str:
    """What the numbers were measured on."""
    versions = ", ".join(f"{name} {version(name)}" for name in ENGINES)
    load = os.getloadavg()[0]
    return (
        f"{len(os.sched_getaffinity(0))} cores ({platform.machine()}), load average {load:.1f} at the end, "
        f"Python {platform.python_version()}, {versions}"
    )


def comparison(results: Sequence[TaskResult], chart: str) -> str:
    """Section of the comparison; ``chart`` is the picture's address as seen from the page."""
    remarks, faster = tables.remarks(results), tables.faster(results)
    return COMPARISON.format(
        full=tables.comparison(results, "full"),
        reduced=tables.comparison(results, "reduced"),
        faster=f"{FASTER.format(tasks=faster)}\n" if faster else "",
        tasks=tables.tasks(results),
        remarks=f"Remarks:\n\n{remarks}\n" if remarks else "",
        chart=chart,
    )


def cells(results: Sequence[CellResult], beam: Sequence[BeamResult], own_limit: float, search_limit: float) -> str:
    """Section of the real cells; limits of duocell and of each exhaustive search in s."""
    return CELLS.format(
        own_limit=own_limit,
        limit=search_limit,
        summary=cell_tables.summary(results),
        remarks=cell_tables.remarks(results),
        beam=cell_tables.beam(beam),
    )


def thesis(table: str) -> str:
    """Section of the source's examples."""
    return THESIS.format(thesis=table)


def promised(table: str) -> str:
    """Section of the promised timings."""
    return f"Wall-clock, warm unless said otherwise, whatever else the machine was doing.\n\n{table}"
