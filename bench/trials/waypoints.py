"""Way-points made along a path that an arm is known to follow: ``python -m bench.trials.waypoints``.

Every "no" is wrong. One arm, 4, 16 or 32 poses a few centimetres apart, the ground, self clearance, conditioning and
short joint steps: the path is drawn in the joints first, checked here, and only its poses are told.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from bench.judges.dense_bodies import DenseBodies
from bench.trials.trial import Record, ask, draw_of, options_of, run, table
from duocell.models.base.arrays import Floats
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, HalfSpace
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses, jacobians
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights
from duocell.optimizer.settings import Settings

NAME = "waypoints"
ROBOTS = ("ur10e", "franka_panda", "iiwa14", "gen3")
COUNTS, CONDITIONED = (4, 16, 32), (0.05, 0.1)
STEP, SHORTER = 0.2, 0.15
"""rad; the joint step that is allowed, and the one that drawn paths keep."""
SLACK = 1.2
"""Drawn paths are better conditioned than is asked for by this factor."""
ABOVE = 0.01
"""m; what drawn paths keep of the ground and of themselves."""
WRIST = 0.05
"""What drawn paths keep from a straight wrist: sine of its angle, six-jointed arms only."""


@dataclass(frozen=True, eq=False)
class WayTask:
    """A task and the path it was made around: cell of one arm, joints (m, n) rad from the origin at yaw 0."""

    cell: Cell
    joints: Floats


def way_task(seed: int) -> WayTask:
    """Task ``seed``: robots in turn, numbers of poses next, conditioning and clearances by chance."""
    rng = draw_of(NAME, seed)
    chosen, count = robot(ROBOTS[seed % 4]), COUNTS[seed // 4 % 3]
    asked = CONDITIONED[seed // 12 % 2]
    lower, upper = np.maximum(chosen.lower, -np.pi), np.minimum(chosen.upper, np.pi)
    side = Interval(-3.0, 3.0)
    region = BaseRegion(side, side, Interval(0.0, 0.0), FREE_YAW)
    weights = range_weights(chosen.lower, chosen.upper)
    hand = np.eye(4)
    clearances = Clearances(arm_obstacle=0.0, self_collision=0.0 if rng.random() < 0.5 else None)
    ground = Surroundings((Body("ground", np.eye(4), HalfSpace()),), clearances=clearances)
    while True:
        joints = _path(rng, lower, upper, count)
        if joints is None:
            continue
        poses = flange_poses(chosen, joints)
        arm = Arm("arm", chosen, hand, hand, region, chosen.lower, chosen.upper, chosen.reference, weights)
        cell = Cell(Task(poses), (replace(arm, min_conditioning=asked),), STEP, f"{chosen.name} {count}", ground)
        if _clean(cell, joints, asked):
            return WayTask(cell, joints)


def attempt(seed: int) -> Record:
    """duocell on one task."""
    task = way_task(seed)
    cell = task.cell
    asked = {"robot": cell.arms[0].robot.name, "poses": len(cell.task), "conditioning": cell.arms[0].min_conditioning}
    return ask(cell, Settings(time_limit=120.0)).record | asked


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    print(summary(run(options_of(__doc__, 100, arguments), attempt, say)))
    return 0


def say(record: Record) -> str:
    """One line about a record."""
    wrong = "" if record["objective"] is not None else f"WRONG: {record['detail']}"
    what = f"{record['robot']:13} {record['poses']:3d} poses, conditioning {record['conditioning']}"
    return f"{record['seed']:4d} {what} {record['word']:10} {record['cpu']:6.2f} s {wrong}"


def summary(records: list[Record]) -> str:
    """The table: answers by robot."""
    rows = []
    for name in [*dict.fromkeys(record["robot"] for record in records), "all"]:
        some = [record for record in records if name in (record["robot"], "all")]
        words = [sum(r["word"] == word for r in some) for word in ("infeasible", "unknown", "error")]
        rows.append([name, len(some), *words, float(np.median([r["cpu"] for r in some]))])
    return table(["robot", "tasks", "wrong no", "unknown", "error", "CPU s, median"], rows)


def _path(rng: np.random.Generator, lower: Floats, upper: Floats, count: int) -> Floats | None:
    """(count, n) joints: a walk whose direction turns slowly, inside the limits."""
    dof = len(lower)
    q = lower + (upper - lower) * rng.uniform(0.15, 0.85, dof)
    drift, rows = rng.normal(0.0, 0.03, dof), [q]
    for _ in range(count - 1):
        drift = np.clip(0.9 * drift + rng.normal(0.0, 0.012, dof), -SHORTER, SHORTER)
        rows.append(rows[-1] + drift)
    joints = np.array(rows)
    return joints if np.all((joints > lower + 0.02) & (joints < upper - 0.02)) else None


def _clean(cell: Cell, joints: Floats, asked: float) -> bool:
    """True if the path is well conditioned, off its wrist's singularity, and clear of the ground and itself."""
    arm = cell.arms[0]
    length = characteristic_length(arm.robot)
    ways = [np.linspace(a, b, 5)[:-1] for a, b in pairwise(joints)]
    between = np.concatenate([*ways, joints[-1:]])
    if np.min(conditioning(arm.robot, arm.tool, between, length)) < SLACK * asked:
        return False
    if arm.dof == 6:  # the axes of joints 4 and 6 in the world are columns of the Jacobian
        columns = jacobians(arm.robot, between, arm.tool)[:, 3:]
        if np.min(np.linalg.norm(np.cross(columns[:, :, 3], columns[:, :, 5]), axis=1)) < WRIST:
            return False
    bodies = DenseBodies(cell, np.eye(4)[None])
    kept = {"arm_obstacle": ABOVE, "self": ABOVE}
    return not any(bodies.nearest(bodies.place([q], np.eye(4)), kept) for q in between)


if __name__ == "__main__":
    raise SystemExit(main())
