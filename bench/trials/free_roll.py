"""Single arms with a free roll against brute force: ``python -m bench.trials.free_roll [--count N]``.

A tool that is symmetric, or whose roll nobody minds, is carried along a line by an arm that may stand anywhere in a
square. `bench.judges.roll_grid` tries bases, yaws, rolls and postures of a grid; the best of them is also brought to
its optimum from there, which is the harder judge: it says whether a better basin was missed.
"""

from __future__ import annotations

import time
from functools import lru_cache

import numpy as np

from bench.judges.roll_grid import OnGrid, best_on_grid
from bench.trials.trial import Record, ask, draw_of, is_worse, options_of, run, table
from duocell.models.base.pose import rotation_about, rotation_from_rpy, rotation_x, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import line
from duocell.models.kinematics.kinematics import reach
from duocell.models.robot.arm import Arm, BaseRegion, Interval, range_weights
from duocell.models.robot.freedom import SIZE, Frame, Freedom
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.verify import check

NAME = "free_roll"
ROBOTS = ("ur5e", "ur10e", "puma560", "irb120", "kr6_r900", "gp8")
"""Two families of closed forms; those that the catalogue does not have are left out."""
STRAIGHT = 0.25
"""Share of the tools whose axis is that of the last joint."""


def free_roll(count: int, steps: float = np.inf) -> Freedom:
    """A free roll about z of the TCP at so many poses."""
    lower, upper = np.zeros((count, SIZE)), np.zeros((count, SIZE))
    lower[:, -1], upper[:, -1] = -np.inf, np.inf
    axes, frames = np.broadcast_to(np.eye(3), (count, 3, 3)), np.full(count, int(Frame.TOOL))
    return Freedom(lower, upper, np.zeros(count), axes, frames, np.append(np.full(SIZE - 1, np.inf), steps))


@lru_cache(maxsize=16)
def free_roll_cell(seed: int) -> Cell:
    """Task ``seed``: 4 to 10 poses of one arm."""
    rng = draw_of(NAME, seed)
    made = robot(ROBOTS[int(rng.integers(len(ROBOTS)))])
    scale = reach(made)
    down = rotation_from_rpy([np.pi + rng.uniform(-0.7, 0.7), rng.uniform(-0.7, 0.7), rng.uniform(-np.pi, np.pi)])
    start = scale * np.array([*rng.uniform(-0.2, 0.2, 2), rng.uniform(-0.1, 0.4)])
    heading = rng.uniform(-np.pi, np.pi)
    travel = scale * rng.uniform(0.1, 0.7) * np.array([np.cos(heading), np.sin(heading), rng.uniform(-0.2, 0.2)])
    turned = down @ rotation_about(rng.normal(size=3), rng.uniform(0.0, 1.2))
    count = int(rng.integers(4, 11))
    task = line(transform(down, start), transform(turned, start + travel), count)
    bent = 0.0 if rng.random() < STRAIGHT else rng.uniform(0.2, 1.2)
    offset = np.zeros(3) if bent == 0.0 else np.array([*rng.uniform(-0.08, 0.08, 2), 0.0])
    tool = transform(rotation_z(rng.uniform(-np.pi, np.pi)) @ rotation_x(bent), offset + np.array([0.0, 0.0, 0.15]))
    side = Interval(-0.9 * scale, 0.9 * scale)
    arm = Arm(
        name="arm",
        robot=made,
        tool=tool,
        grasp=np.eye(4),
        base=BaseRegion(side, side, Interval(0.0, 0.0)),
        lower=made.lower,
        upper=made.upper,
        reference=made.reference,
        weights=range_weights(made.lower, made.upper),
        freedom=free_roll(count),
    )
    return Cell(task, (arm,), name=f"{NAME} {seed}")


def attempt(seed: int, bases: int = 21, yaws: int = 24, rolls: int = 36) -> Record:
    """duocell and the grid on one task."""
    cell = free_roll_cell(seed)
    arm = cell.arms[0]
    answer = ask(cell, Settings(time_limit=120.0))
    grid = best_on_grid(cell, bases, yaws, rolls)
    polished = None
    if grid.point is not None:
        solved = solve_locally(cell, arm, grid.point, time.perf_counter() + 60.0)
        if solved.status.has_point and _can_be_gone(cell, solved.points[0]):
            polished = objective_of(cell, arm, solved.points[0].joints)
        if not _can_be_gone(cell, grid.point):
            grid = OnGrid(np.inf, None)
    certificate = None if answer.layout is None else answer.layout.certificate
    bound = None if certificate is None else certificate.lower_bound
    known = [
        value for value in (grid.objective, polished, answer.objective) if value is not None and np.isfinite(value)
    ]
    return answer.record | {
        "robot": arm.robot.name,
        "straight": bool(abs(arm.tool[2, 2]) > 1.0 - 1e-12),
        "grid": grid.objective if np.isfinite(grid.objective) else None,
        "polished": polished,
        "bound": bound,
        "worse": is_worse(answer.objective, grid.objective if np.isfinite(grid.objective) else None),
        "missed": is_worse(answer.objective, polished),
        "unsound": bound is not None and bool(known) and bound > min(known) * (1.0 + 1e-6),
    }


def _can_be_gone(cell: Cell, point: ArmSolution) -> bool:
    """True if a point passes the check, and the path between its poses can be gone."""
    return check(cell, cell.arms[0], point).usable and check_arm_path(cell, cell.arms[0], point).free


def say(record: Record) -> str:
    """One line."""
    values = ", ".join(f"{name} {record[name]}" for name in ("word", "objective", "grid", "polished", "bound"))
    marks = " ".join(name.upper() for name in ("worse", "missed", "unsound") if record[name])
    return f"{record['seed']:4d} {record['robot']}: {values}, {record['cpu']:.2f} s {marks}"


def summary(records: list[Record]) -> str:
    """What the trial gives."""
    both = [one for one in records if one["objective"] is not None and one["grid"] is not None]
    ratios = [one["objective"] / max(one["grid"], 1e-9) for one in both]
    rows = [
        ("tasks", len(records)),
        ("answered", sum(one["objective"] is not None for one in records)),
        ("grid has a layout", sum(one["grid"] is not None for one in records)),
        ("grid has one, duocell none", sum(one["grid"] is not None and one["objective"] is None for one in records)),
        ("above the grid by more than 0.1 %", sum(one["worse"] for one in records)),
        ("above what the grid leads to by more than 0.1 %", sum(one["missed"] for one in records)),
        ("certificates above something known", sum(one["unsound"] for one in records)),
        ("proved optimal", sum(one["word"] == "optimal" for one in records)),
        ("said to be impossible though the grid has a layout", sum(_denied(one) for one in records)),
        ("median share of the grid's cost", float(np.median(ratios)) if ratios else None),
        ("median CPU s", float(np.median([one["cpu"] for one in records])) if records else None),
    ]
    return table(["", "free roll"], rows)


def _denied(record: Record) -> bool:
    return record["word"] == "infeasible" and record["grid"] is not None


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    print(summary(run(options_of(__doc__, 200, arguments), attempt, say)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
