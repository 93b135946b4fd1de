"""``python -m bench.random_arms.invariance``: the answer where the world is turned or moved, or the poses are reversed.

Every task of `bench.random_arms.draw` is asked for six times over: turned by 90, 180 and 270 degrees with everything
that names an axis, moved by up to 10 m along every axis, with its poses in reverse, and all of it together. The largest
relative difference of the objective is told for every task where it is more than 1e-6.
"""

from __future__ import annotations

from dataclasses import replace
from time import perf_counter

import numpy as np

from bench.random_arms.draw import KINDS, draw
from bench.trials.trial import Record, options_of, run, table
from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.robot.arm import BaseRegion, Interval
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.search import search_arm

FARTHEST = 10.0
"""m"""
ALIKE = 1e-6
"""Relative difference of objectives that are the same."""
SEARCH_TIME = 600.0
"""s, out of the way on a busy machine."""


def moved(cell: Cell, quarter: int, shift: tuple[float, float, float]) -> Cell:
    """A cell of one arm in a world that is turned by quarter turns about the vertical, then shifted [m]."""
    arm = cell.arms[0]
    turn = np.round(rotation_z(quarter * np.pi / 2))
    corners = arm.base.bounds[:3].T @ turn.T + shift
    x, y, z = (
        Interval(float(low), float(high)) for low, high in zip(corners.min(axis=0), corners.max(axis=0), strict=True)
    )
    yaw, mount = arm.base.yaw, turn @ arm.mount
    if arm.upright:
        mount = arm.mount
        if not arm.base.yaw_free:
            yaw = Interval(yaw.low + quarter * np.pi / 2, yaw.high + quarter * np.pi / 2)
    task = replace(cell.task, poses=transform(turn, np.asarray(shift)) @ cell.task.poses)
    return replace(cell, task=task, arms=(replace(arm, base=BaseRegion(x, y, z, yaw), mount=mount),))


def reversed_poses(cell: Cell) -> Cell:
    """A cell with its poses, and so its segments, in reverse."""
    task = cell.task
    starts = tuple(len(task) - segment.stop for segment in reversed(task.segments))
    return replace(cell, task=Task(task.poses[::-1], starts, task.names[::-1], task.weights[::-1]))


def variants(cell: Cell, rng: np.random.Generator) -> dict[str, Cell]:
    """The cell and its six images."""
    x, y, z = (float(v) for v in rng.uniform(-FARTHEST, FARTHEST, 3))
    images = {f"turned {90 * k}": moved(cell, k, (0.0, 0.0, 0.0)) for k in (1, 2, 3)}
    both = reversed_poses(moved(cell, 1, (x, y, z)))
    return {
        "as it is": cell,
        **images,
        "moved": moved(cell, 0, (x, y, z)),
        "reversed": reversed_poses(cell),
        "all of it": both,
    }


def attempt(seed: int) -> Record:
    """One task of every kind in turn."""
    kind = list(KINDS)[seed % len(KINDS)]
    cell = draw(kind, seed // len(KINDS))
    found = {}
    for name, image in variants(cell, np.random.default_rng([5, seed])).items():
        best = search_arm(image, image.arms[0], Settings(), perf_counter() + SEARCH_TIME)
        found[name] = float(best.objective) if best.best is not None else None
    known = [value for value in found.values() if value is not None]
    spread = (max(known) / max(min(known), 1e-9) - 1.0 if len(known) == len(found) else np.inf) if known else 0.0
    return {"task": cell.name, "robot": cell.arms[0].robot.name, "spread": spread, "found": found}


def main() -> int:
    """Run it and print a table."""
    records = run(options_of(__doc__, 60), attempt, lambda r: str(r) if r["spread"] > ALIKE else ".")
    rows = []
    for kind in KINDS:
        spreads = [r["spread"] for r in records if r["task"].startswith(f"{kind} ")]
        rows.append((kind, len(spreads), sum(s > ALIKE for s in spreads), max(spreads, default=0.0)))
    print(table(("kind", "tasks", "changed", "most"), rows))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
