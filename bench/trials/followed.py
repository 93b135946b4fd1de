"""Whether a dense judge can follow the answers to random tasks of one arm: ``python -m bench.trials.followed``.

Tasks are those of `bench.random_arms.draw`, kind by kind in turn, every second one with only the ends and perhaps the
middle of its way as poses, twice as far apart: between few poses there is more to get lost in. Every answer is followed
from pose to pose by Pinocchio and Newton's method in steps of a millimetre and half a degree; where that gets lost, the
steps were perhaps too long for a joint that turns fast beside a singularity, so the way is gone again in steps a tenth
and a hundredth as long. What is lost in all of them cannot be followed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bench.judges.dense_check import ANGLE, LENGTH, base_in_world
from bench.judges.dense_path import Lost, follow, object_steps
from bench.random_arms.draw import KINDS, draw
from bench.trials.trial import Record, ask, options_of, run, table
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings

PATIENT = 600.0
"""s of wall time that a task may take."""
COUNT = 200
FINER = 1.0, 0.1, 0.01
"""Lengths of the steps, in parts of the usual ones."""
CHOSEN = tuple(kind for kind in KINDS if kind != "dwell")
"""Hundreds of poses a millimetre apart leave nothing between them to be lost in."""
BEYOND = 1e-5
"""rad that a joint may be outside of its limits between the poses."""


def task_of(seed: int) -> tuple[str, Cell]:
    """The kind and the cell of a task; odd numbers have few poses, far apart."""
    kind = CHOSEN[seed // 2 % len(CHOSEN)]
    cell = draw(kind, seed // 2 // len(CHOSEN))
    if seed % 2 == 0:
        return kind, cell
    few = 2 if seed % 4 == 1 else 3
    ends = np.unique(np.linspace(cell.task.segments[0].start, cell.task.segments[0].stop - 1, few).round().astype(int))
    poses = cell.task.poses[ends].copy()
    poses[:, :3, 3] += poses[:, :3, 3] - poses[0, :3, 3]
    return f"{kind}, few poses", replace(cell, task=Task(poses), max_joint_step=np.pi)


def lost_on_the_way(cell: Cell, layout: Layout) -> tuple[Lost, float] | None:
    """Where a layout of arms with six joints cannot be followed, and the step [m] it was seen with; None if nowhere."""
    found: tuple[Lost, float] | None = None
    for share in FINER:
        lost = _lost(cell, layout, share)
        if lost is None:
            return None
        found = lost, share * LENGTH
    return found


def _lost(cell: Cell, layout: Layout, share: float) -> Lost | None:
    """The first place that is lost in steps of one length; a joint beyond its limits counts as lost."""
    for arm, placement in zip(cell.arms, layout.placements, strict=True):
        base = base_in_world(arm, np.array([*placement.position, placement.yaw]))
        for segment in cell.task.segments:
            steps = object_steps(cell.task.poses[segment], share * LENGTH, share * ANGLE)
            rows, lost = follow(arm, base, steps, placement.joints[segment])
            if lost is not None:
                return replace(lost, pose=lost.pose + segment.start)
            beyond = np.max(np.maximum(arm.lower - rows, rows - arm.upper), axis=1)
            k = int(np.argmax(beyond))
            if beyond[k] > BEYOND:
                return Lost(arm.name, int(steps.step[k]) + segment.start, float(steps.fraction[k]), float(beyond[k]))
    return None


def attempt(seed: int) -> Record:
    """One task answered and followed: kind, robot, what was answered, and where the arm gets lost."""
    kind, cell = task_of(seed)
    answer = ask(cell, Settings(time_limit=PATIENT, certificate="auto"))
    record: Record = {"kind": kind, "robot": cell.arms[0].robot.name, **answer.record, "lost": None, "step": None}
    if answer.layout is not None and answer.layout.usable:
        record["singular"] = answer.layout.placements[0].singularity_distances
        found = lost_on_the_way(cell, answer.layout)
        if found is not None:
            lost, step = found
            record |= {"lost": [lost.pose, lost.fraction, lost.off], "step": step}
    return record


def say(record: Record) -> str:
    """One line of a record."""
    lost = "followed" if record["lost"] is None else f"LOST at {record['lost']}"
    return f"{record['seed']} {record['kind']} {record['robot']} {record['word']} {record['objective']} {lost}"


def summary(records: Sequence[Record]) -> str:
    """The share of the answers that could not be followed, kind by kind and over all."""
    rows = []
    for kind in [*sorted({record["kind"] for record in records}), "all"]:
        some = [record for record in records if kind in ("all", record["kind"])]
        answered = [record for record in some if record["objective"] is not None]
        lost = [record["seed"] for record in answered if record["lost"] is not None]
        share = f"{len(lost)} of {len(answered)}"
        rows.append([kind, len(some), share, ", ".join(map(str, lost)), float(sum(r["cpu"] for r in some))])
    return table(["kind", "tasks", "not followed", "which", "CPU s"], rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Answer and follow what is asked for; 1 if something cannot be followed."""
    records = run(options_of(__doc__, COUNT, arguments), attempt, say)
    print(summary(records))
    return int(any(record["lost"] is not None for record in records))


if __name__ == "__main__":
    raise SystemExit(main())
