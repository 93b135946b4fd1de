"""Arms without a reduced problem against long searches: ``python -m bench.redundant_arms [--count N] [--file PATH]``.

Every task is one arm of the catalogue that has seven joints or an offset wrist (`--endless`: one with joints without
end and without weight), which some drawn path is known to do. The answer is held against the best of several long
searches that share little with it: eight times as many seeds, other draws, many more local solves, and paths followed
from a thousand random postures. A better layout counts only if it passes a test of its own: Pinocchio's kinematics,
limits, steps, region. Records are continued where they stopped.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace
from time import perf_counter, process_time

import numpy as np

from bench.redundant_draw import arms_without_reduction, drawn_cell
from bench.trial import Record, add_options, draw_of, is_worse, options_from, run, table
from models.arm import Arm
from models.arrays import Floats
from models.cell import Cell
from models.kinematics import flange_poses
from optimizer.box import search_box
from optimizer.continuation import continue_paths
from optimizer.local import solve_locally
from optimizer.program import ArmPoint
from optimizer.search import search_arm
from optimizer.settings import Settings
from optimizer.single_arm.redundant.parameters import PARAMETERS
from optimizer.single_arm.redundant.unreduced import Optimum, search_unreduced

LONG = replace(PARAMETERS, seeds=2048, spread_kept=512, middle_kept=160, polished=16, polished_endless=24, worth=1.4)
SEEDS = (11, 12)
FOLLOWED, STARTS = 1024, 24
TOLERANCE = 1e-6
"""m and rad."""


@dataclass(frozen=True, slots=True)
class Judged:
    """Best of the long searches, infinite without any, and their CPU time [s]."""

    objective: float
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
    """The best that long searches find."""
    began, box = process_time(), search_box(cell, arm)

    def solve(start: ArmPoint) -> list[Optimum]:
        result = solve_locally(cell, arm, start, perf_counter() + 30.0)
        point = result.points[0]
        value = objective_if_usable(cell, arm, point.position, point.yaw, point.joints)
        return [(value, point)] if np.isfinite(value) else []

    found = [
        optimum for seed in SEEDS for optimum in search_unreduced(cell, arm, box, seed, np.inf, solve, LONG).optima
    ]
    yaw = np.array([[0.0, 0.0]]) if arm.base.yaw_free else arm.base.bounds[3:]
    paths = continue_paths(cell, arm, np.concatenate([box, yaw]), 77, FOLLOWED)
    paths.sort(key=lambda path: (path.violation > 0.0, path.violation, path.objective))
    for path in paths[:STARTS]:
        found += solve(ArmPoint(path.position, path.yaw, path.joints, path.signs))
    return Judged(min((value for value, _ in found), default=np.inf), process_time() - began)


def attempt(seed: int, endless: bool) -> Record:
    """One task."""
    rng = draw_of("redundant arms" + " endless" * endless, seed)
    arms = arms_without_reduction(endless)
    cell = drawn_cell(rng, arms[seed % len(arms)])
    arm = cell.arms[0]
    busy = process_time()
    search = search_arm(cell, arm, Settings(), perf_counter() + 600.0)
    cpu = process_time() - busy
    objective: float | None = None
    if search.best is not None:
        best = search.best
        objective = objective_if_usable(cell, arm, best.position, best.yaw, best.joints)
    known = judge(cell, arm)
    return {
        "robot": arm.robot.name,
        "poses": len(cell.task),
        "objective": objective,
        "known": None if np.isinf(known.objective) else known.objective,
        "cpu": cpu,
        "judged": known.seconds,
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
    parser.add_argument("--endless", action="store_true", help="arms with joints without end")
    given = parser.parse_args()
    records = run(options_from(given), lambda seed: attempt(seed, given.endless), line_of)
    misses = [record for record in records if is_worse(record["objective"], record["known"])]
    seconds = np.array([record["cpu"] for record in records])
    head = ("tasks", "misses > 0.1 %", "without a layout", "median s", "p95 s")
    without = sum(record["objective"] is None for record in records)
    row = (len(records), len(misses), without, float(np.median(seconds)), float(np.quantile(seconds, 0.95)))
    print("\n" + table(head, [row]))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
