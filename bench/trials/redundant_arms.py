"""Arms without a reduced problem against long searches.

``python -m bench.trials.redundant_arms [--count N] [--file PATH]``

Every task is one arm of the catalogue that has seven joints or an offset wrist, which some drawn path is known to do.
``--kind`` asks for others (`bench.draws.redundant_draw.KINDS`): joints without end and without weight, hundreds of
poses at one place, or a base on a slope. The answer is held against the best of several long searches that share
little with it: eight times as many seeds, other draws, many more local solves, and paths followed from a thousand
random postures; of a dwell, on few poses that have the weight of all, and then on the whole. A better layout counts
only if it passes a test of its own: Pinocchio's kinematics, limits, steps, region; and if the arm can be followed
between its poses. Records are continued where they stopped.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from time import perf_counter, process_time

import numpy as np

from bench.draws.redundant_draw import KINDS, arms_without_reduction, drawn_cell
from bench.trials.trial import WORSE, Record, add_options, draw_of, is_worse, options_from, run, table
from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.unreduced import PARAMETERS
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.settings import Settings
from duocell.optimizer.single_arm.continuation import continue_paths
from duocell.optimizer.single_arm.local import solve_locally
from duocell.optimizer.single_arm.passable import best_passable
from duocell.optimizer.single_arm.redundant.unreduced import Optimum, search_unreduced
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.arm_path import check_arm_path

LONG = replace(PARAMETERS, seeds=2048, spread_kept=512, middle_kept=160, polished=16, polished_endless=24, worth=1.4)
SEEDS = (11, 12)
FOLLOWED, STARTS = 1024, 24
TOLERANCE = 1e-6
"""m and rad."""
HELD, HELD_POSES = 1e-3, 4
"""m between poses of a dwell; so many at either end of it are looked at by themselves, the others as one."""
WHOLE = 20
"""Layouts of the few poses that are solved on all."""


@dataclass(frozen=True, slots=True)
class Judged:
    """Optima of the long searches, best first, and their CPU time [s]."""

    optima: list[Optimum]
    seconds: float


def objective_if_usable(cell: Cell, arm: Arm, position: Floats, yaw: float, joints: Floats) -> float:
    """E of a layout (joints (m, n) rad), infinite if it breaks anything."""
    reached = arm.base_in_world(position, yaw) @ flange_poses(arm.robot, joints) @ arm.tool
    wanted = cell.task.poses @ cell.grasps(arm)
    away = float(np.max(np.linalg.norm(reached[:, :3, 3] - wanted[:, :3, 3], axis=1)))
    turned = float(np.max(np.abs(reached[:, :3, :3] - wanted[:, :3, :3])))
    beyond = float(np.max(np.maximum(arm.lower - joints, joints - arm.upper)))
    step = float(np.max(np.abs(np.diff(joints, axis=0))[cell.task.joined], initial=0.0)) - cell.max_joint_step
    region = arm.base.bounds[:3]
    outside = float(np.max(np.maximum(region[:, 0] - position, position - region[:, 1])))
    turns = (yaw - arm.base.yaw.low) % (2.0 * np.pi)
    aside = max(turns - arm.base.yaw.width, 0.0) if turns < 2.0 * np.pi - TOLERANCE else 0.0
    if max(away, turned, beyond, step, outside, aside) > TOLERANCE:
        return np.inf
    return float(cell.task.weights @ ((joints - arm.reference) ** 2 @ arm.weights))


def judge(cell: Cell, arm: Arm) -> Judged:
    """What long searches find."""
    began = process_time()
    few, rows = with_few_poses(cell)
    found = sorted(_searched(few, arm), key=lambda optimum: optimum[0])
    if len(few.task) < len(cell.task):
        values = np.array([value for value, _ in found])
        new = np.flatnonzero(np.diff(values, prepend=0.0) > WORSE * values)[:WHOLE]
        starts = [replace(found[k][1], joints=found[k][1].joints[rows]) for k in new]
        found = sorted((end for start in starts for end in _solved(cell, arm, start)), key=lambda optimum: optimum[0])
    return Judged(found, process_time() - began)


def with_few_poses(cell: Cell) -> tuple[Cell, Ints]:
    """The cell with one pose for the inner ones of a dwell, and which pose (m,) stands for each."""
    poses, weights = cell.task.poses, cell.task.weights
    near = np.linalg.norm(np.diff(poses[:, :3, 3], axis=0), axis=1) < HELD
    near &= np.max(np.abs(np.diff(poses[:, :3, :3], axis=0)), axis=(1, 2)) < HELD
    before, after = np.concatenate([[False], near]), np.concatenate([near, [False]])
    inner = before & after
    for _ in range(HELD_POSES - 1):
        inner &= np.concatenate([[False], inner[:-1]]) & np.concatenate([inner[1:], [False]])
    new = ~(inner & np.concatenate([[False], inner[:-1]]))
    rows = np.cumsum(new) - 1
    kept = np.array([np.flatnonzero(rows == k)[np.sum(rows == k) // 2] for k in range(int(rows[-1]) + 1)])
    return replace(cell, task=Task(poses[kept], weights=np.bincount(rows, weights).astype(np.float64))), rows


def _searched(cell: Cell, arm: Arm) -> list[Optimum]:
    """Usable optima of the long searches."""
    box = search_box(cell, arm)
    found = [
        optimum
        for seed in SEEDS
        for optimum in search_unreduced(cell, arm, box, seed, np.inf, lambda c, p, _: _solved(c, arm, p), LONG).optima
    ]
    yaw = np.array([[0.0, 0.0]]) if arm.base.yaw_free else arm.base.bounds[3:]
    paths = continue_paths(cell, arm, np.concatenate([box, yaw]), 77, FOLLOWED)
    paths.sort(key=lambda path: (path.violation > 0.0, path.violation, path.objective))
    for path in paths[:STARTS]:
        found += _solved(cell, arm, ArmSolution(path.position, path.yaw, path.joints, path.signs))
    return found


def _solved(cell: Cell, arm: Arm, start: ArmSolution) -> list[Optimum]:
    """The usable optimum that is reached from a start, if there is one."""
    point = solve_locally(cell, arm, start, perf_counter() + 30.0).points[0]
    value = objective_if_usable(cell, arm, point.position, point.yaw, point.joints)
    return [(value, point)] if np.isfinite(value) else []


def known_to_pass(cell: Cell, arm: Arm, optima: list[Optimum]) -> float | None:
    """The least objective of optima, best first, between whose poses the arm can be followed, if need be repaired."""
    free = next((value for value, point in optima if check_arm_path(cell, arm, point).free), np.inf)
    repaired = best_passable(cell, arm, optima, free, np.inf)
    best = free if repaired is None else repaired[0]
    return best if np.isfinite(best) else None


def attempt(seed: int, kind: str) -> Record:
    """One task."""
    rng = draw_of("redundant arms" + f" {kind}" * (kind != "path"), seed)
    arms = arms_without_reduction(kind == "endless")
    cell = drawn_cell(rng, arms[seed % len(arms)], kind)
    arm = cell.arms[0]
    busy = process_time()
    search = search_arm(cell, arm, Settings(), perf_counter() + 600.0)
    cpu = process_time() - busy
    objective: float | None = None
    if search.best is not None:
        best = search.best
        objective = objective_if_usable(cell, arm, best.position, best.yaw, best.joints)
    judged = judge(cell, arm)
    known = min((value for value, _ in judged.optima), default=None)
    if is_worse(objective, known):
        known = known_to_pass(cell, arm, judged.optima)
    return {
        "robot": arm.robot.name,
        "poses": len(cell.task),
        "objective": objective,
        "known": known,
        "cpu": cpu,
        "judged": judged.seconds,
    }


def line_of(record: Record) -> str:
    """For the terminal."""
    worse = " MISS" if is_worse(record["objective"], record["known"]) else ""
    found, known = record["objective"] or np.inf, record["known"] or np.inf
    share = found / known if np.isfinite(found) else np.inf
    return (
        f"{record['seed']:5d} {record['robot']:14s} {record['poses']:3d} poses {found:10.4f} {share:8.5f} of the "
        f"judge's, {record['cpu']:.3f} s, judge {record['judged']:.1f} s{worse}"
    )


def main() -> int:
    """Run the trial."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, 200)
    parser.add_argument("--kind", choices=KINDS, default=KINDS[0], help="of the tasks")
    given = parser.parse_args()
    records = run(options_from(given), lambda seed: attempt(seed, given.kind), line_of)
    misses = [record for record in records if is_worse(record["objective"], record["known"])]
    seconds = np.array([record["cpu"] for record in records])
    head = ("tasks", "misses > 0.1 %", "without a layout", "median s", "p95 s")
    without = sum(record["objective"] is None for record in records)
    row = (len(records), len(misses), without, float(np.median(seconds)), float(np.quantile(seconds, 0.95)))
    print("\n" + table(head, [row]))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
