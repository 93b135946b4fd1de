"""The page of the benchmark: every number in it was just measured."""

from __future__ import annotations

import os
import platform
from collections.abc import Sequence
from importlib.metadata import version

from bench import tables
from bench.run import TaskResult

ENGINES = ("numpy", "scipy", "casadi", "pin", "cma", "optuna")

COMPARISON = """\
## Against what people use instead

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

Task by task:

{tasks}

{remarks}
![objective against time]({chart})
"""

THESIS = """\
## The source's procedure on its own examples

The end points of its paths are lost in the scan; these are the project's two acceptance cases, shaped after them.
Every arm starts from both sides of the path, in the posture nearest to the reference there.

{thesis}
"""


def page(sections: Sequence[str], command: str) -> str:
    """The whole page.

    Args:
        sections: Markdown.
        command: that made them.
    """
    head = (
        "# Benchmarks\n\n"
        f"Made by `{command}` on {machine()}.\n"
        "Every number on this page was measured in that run; the raw records are in `build/bench/results.json`.\n"
    )
    return "\n".join([head, *sections]).rstrip() + "\n"


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
    remarks = tables.remarks(results)
    return COMPARISON.format(
        full=tables.comparison(results, "full"),
        reduced=tables.comparison(results, "reduced"),
        tasks=tables.tasks(results),
        remarks=f"Remarks:\n\n{remarks}\n" if remarks else "",
        chart=chart,
    )


def thesis(table: str) -> str:
    """Section of the source's examples."""
    return THESIS.format(thesis=table)


def promised(table: str) -> str:
    """Section of the promised timings."""
    text = "Wall-clock, warm unless said otherwise, whatever else the machine was doing."
    return f"## Promised timings\n\n{text}\n\n{table}\n"
