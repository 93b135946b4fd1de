"""Tasks of one arm that are only just possible, to break a "no" or a bound: ``python -m bench.trials.tight_arms``.

A task of `bench.random_arms` is sampled with kinematics of its own (`bench.searches.own_stands`); one of the usable
stands is kept, and region, yaw, limits, joint step and conditioning are drawn together about it, with little or
nothing to spare. A layout that costs no more than the best of further own samples is then known; no "infeasible" and
no larger bound is right. Whether an arm can go on between the poses is not asked here, so that no answer may mean just
that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bench.random_arms.draw import KINDS, draw
from bench.searches.own_stands import conditioning, own_stands, own_task
from bench.trials.trial import Record, ask, draw_of, options_of, run, table
from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval
from duocell.optimizer.settings import Settings

NAME = "tight arms"
CHOSEN = tuple(kind for kind in KINDS if kind != "dwell")
PLACES, CLOSER, ROUNDS = 600, 100, 8
"""Places of the first look, and of each of the closer ones about the best, in a radius that halves."""
MARGINS = 0.0, 1e-9, 1e-6, 1e-3, 0.03
"""What is left beside the stand that is kept: m, rad, or a share of a joint step or a conditioning."""
SHORT = 60
"""Most poses."""
SETTINGS = Settings(time_limit=600.0)
ROUNDED = 1e-6


@dataclass(frozen=True, eq=False, slots=True)
class Tight:
    """A task with what is known of it: its kind, the cell, the best cost that own samples have."""

    kind: str
    cell: Cell
    known: float


def tight_task(seed: int) -> Tight:
    """Task ``seed``; the kinds take turns."""
    rng = draw_of(NAME, seed)
    kind = CHOSEN[seed % len(CHOSEN)]
    while True:
        cell = draw(kind, int(rng.integers(10**6)))
        made = _tightened(cell, rng) if len(cell.task) <= SHORT else None
        if made is not None:
            return Tight(kind, *made)


def _tightened(cell: Cell, rng: np.random.Generator) -> tuple[Cell, float] | None:
    arm = replace(cell.arms[0], avoid_singularities=bool(rng.random() < 0.7), min_conditioning=None)
    if rng.random() < 0.3:
        low, high = np.maximum(arm.lower, -np.pi), np.minimum(arm.upper, np.pi)
        arm = replace(arm, reference=low + (high - low) * rng.uniform(0.2, 0.8, arm.dof))
    cell = replace(cell, arms=(arm,))
    try:
        task = own_task(cell, 0)
    except ValueError:
        return None
    sides = arm.base.bounds[:3]
    places = rng.uniform(sides[:, 0], sides[:, 1], (PLACES, 3))
    seen = own_stands(task, places)
    usable = np.argwhere(seen.usable)
    if not len(usable):
        return None
    branch, k = usable[rng.integers(len(usable))]
    joints = seen.joints[branch, k]
    tight = _about(cell, arm, places[k], float(seen.yaw[branch, k]), joints, rng)
    own = own_task(replace(tight, arms=(replace(tight.arms[0], min_conditioning=None),)), 0)
    if rng.random() < 0.5:
        least = float(np.min(conditioning(own, joints[None])))
        kept = replace(tight.arms[0], min_conditioning=least * (1.0 - float(rng.choice(MARGINS))) - 1e-12)
        if least > 0.01:
            tight = replace(tight, arms=(kept,))
    cost = float(seen.objective[branch, k])
    return tight, min(cost, _closer(tight, places[k], rng))


def _about(cell: Cell, arm: Arm, place: Floats, yaw: float, joints: Floats, rng: np.random.Generator) -> Cell:
    """The cell with region, yaw, limits and joint step drawn together about a stand."""
    margins = rng.choice(MARGINS, (4, 2))
    old = arm.base.bounds[:3]
    low, high = np.maximum(old[:, 0], place - margins[:3, 0]), np.minimum(old[:, 1], place + margins[:3, 1])
    kept = rng.random(3) < 0.4
    low, high = np.where(kept, old[:, 0], low), np.where(kept, old[:, 1], high)
    turn = FREE_YAW if arm.base.yaw_free else arm.base.yaw
    if rng.random() < 0.6:
        turn = Interval(yaw - float(margins[3, 0]), yaw + float(margins[3, 1]))
    x, y, z = (Interval(float(a), float(b)) for a, b in zip(low, high, strict=True))
    base = BaseRegion(x, y, z, turn)
    some, beside = rng.random(arm.dof) < 0.4, rng.choice(MARGINS, (2, arm.dof))
    lower = np.where(some, np.maximum(arm.lower, joints.min(axis=0) - beside[0]), arm.lower)
    upper = np.where(some, np.minimum(arm.upper, joints.max(axis=0) + beside[1]), arm.upper)
    step = max(
        (float(np.max(np.abs(np.diff(joints[segment], axis=0)), initial=0.0)) for segment in cell.task.segments),
        default=0.0,
    )
    most = cell.max_joint_step
    if rng.random() < 0.4 and step > 1e-3:
        most = min(step * (1.0 + float(rng.choice(MARGINS))) + 1e-12, most)
    reference = np.clip(arm.reference, lower, upper)
    return Cell(cell.task, (replace(arm, base=base, lower=lower, upper=upper, reference=reference),), most)


def _closer(cell: Cell, place: Floats, rng: np.random.Generator) -> float:
    """The least cost of a usable stand near a place; infinite where rounding leaves none."""
    task, sides = own_task(cell, 0), cell.arms[0].base.bounds[:3]
    best, radius = np.inf, 0.5 * (sides[:, 1] - sides[:, 0])
    for _ in range(ROUNDS):
        near = np.clip(place + radius * rng.uniform(-1.0, 1.0, (CLOSER, 3)), sides[:, 0], sides[:, 1])
        near[0] = place
        seen = own_stands(task, near)
        cost = np.where(seen.usable, seen.objective, np.inf)
        k = int(np.argmin(np.min(cost, axis=0)))
        if np.min(cost) < best:
            best, place = float(np.min(cost)), near[k]
        radius = 0.5 * radius
    return best


def attempt(seed: int) -> Record:
    """One task, asked for with the automatic certificate."""
    task = tight_task(seed)
    answer = ask(task.cell, SETTINGS)
    proof = None if answer.layout is None else answer.layout.certificate
    bound = None if proof is None else proof.lower_bound
    return answer.record | {"kind": task.kind, "known": task.known, "bound": bound}


def verdict(record: Record) -> str:
    """What is wrong, or worth a look."""
    if record["word"] == "error":
        return f"ERROR {record['detail']}"
    if record["word"] == "infeasible":
        return "WRONG NO"
    if record["bound"] is not None and record["bound"] > record["known"] * (1.0 + ROUNDED) + ROUNDED:
        return "WRONG BOUND"
    if record["objective"] is None:
        return "nothing found"
    return "dearer" if record["objective"] > record["known"] * 1.001 + ROUNDED else ""


def say(record: Record) -> str:
    """One line about a record."""
    what = f"{record['seed']:4d} {record['kind']:12} {record['word']:10} {record['objective']} known {record['known']}"
    return f"{what} bound {record['bound']} cpu {record['cpu']:.2f}  {verdict(record)}"


def summary(records: Sequence[Record]) -> str:
    """The table, kind by kind and over all."""
    rows = []
    for kind in [*dict.fromkeys(record["kind"] for record in records), "all"]:
        some = [record for record in records if kind in (record["kind"], "all")]
        said = [verdict(record) for record in some]
        words = ("WRONG NO", "WRONG BOUND", "nothing found", "dearer", "ERROR")
        counts = [sum(one.startswith(word) for one in said) for word in words]
        optimal = sum(record["word"] == "optimal" for record in some)
        rows.append([kind, len(some), optimal, *counts])
    return table(["kind", "tasks", "optimal", "wrong no", "wrong bound", "nothing found", "dearer", "error"], rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trial; 1 if something is wrong."""
    records = run(options_of(__doc__, 300, arguments), attempt, say)
    print(summary(records))
    return int(any(verdict(record).isupper() or verdict(record).startswith("WRONG") for record in records))


if __name__ == "__main__":
    raise SystemExit(main())
