"""Two arms tied by one of the couplings, nothing else in the cell: ``python -m bench.trials.coupled_tasks``.

A layout is drawn first and the coupling is made to hold there, so every task has one. Seeds below `RIGID` take five
kinds in turn, those from there on are of two arms on one stand. Judge is `bench.searches.long_search`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import atan2

import numpy as np

from bench.draws.cell_draw import PAIRS, REACH, Known
from bench.searches.long_search import budget, long_search
from bench.searches.own_stands import own_stands, own_task
from bench.trials.trial import Record, ask, draw_of, is_worse, options_of, run, table
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_about, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, Rigid, SameHeight
from duocell.models.cell.task import Task, line
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import FREE_YAW, Arm, BaseRegion, Interval, range_weights
from duocell.optimizer.settings import Settings

NAME = "coupled_tasks"
KINDS = ("same_z", "distance", "direction", "mirror", "rail")
RIGID = 100_000
"""The first seed of two arms on one stand."""


@dataclass(frozen=True, eq=False)
class CoupledTask:
    """A cell of two tied arms and the layout that was drawn with it."""

    kind: str
    cell: Cell
    known: Known


def coupled_task(seed: int) -> CoupledTask:
    """Task ``seed``."""
    rng = draw_of(NAME, seed)
    kind = "rigid" if seed >= RIGID else KINDS[seed % len(KINDS)]
    while True:
        found = _try(rng, kind)
        if found is not None:
            return found


def attempt(seed: int) -> Record:
    """duocell and the long search on one task."""
    task = coupled_task(seed)
    answer = ask(task.cell, Settings(time_limit=120.0))
    found = long_search(task.cell, budget(answer.cpu), draw_of(NAME + " judge", seed))
    record = answer.record | {"kind": task.kind, "robots": [arm.robot.name for arm in task.cell.arms]}
    return record | {
        "long": found.objective,
        "looked": found.looked,
        "worse": is_worse(answer.objective, found.objective),
    }


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    records = run(options_of(__doc__, 200, arguments), attempt, say)
    print(summary(records))
    return 0


def say(record: Record) -> str:
    """One line about a record."""
    robots = "+".join(record["robots"])
    values = f"{record['word']:10} {_number(record['objective'])} long {_number(record['long'])}"
    return f"{record['seed']:4d} {record['kind']:10} {robots:24} {values} {record['cpu']:6.2f} s  {verdict(record)}"


def verdict(record: Record) -> str:
    """What is wrong with an answer that is held against a long search; "" if nothing."""
    if record["word"] == "infeasible":
        return "WRONG NO"
    if record["word"] in ("error", "unknown"):
        return str(record["word"]).upper()
    return f"WORSE x {record['objective'] / max(record['long'], 1e-12):.4f}" if record["worse"] else ""


def summary(records: list[Record]) -> str:
    """The table: what went wrong, by kind."""
    rows = []
    for kind in [*dict.fromkeys(record["kind"] for record in records), "all"]:
        some = [record for record in records if kind in (record["kind"], "all")]
        said = [verdict(record) for record in some]
        worst = max((r["objective"] / r["long"] for r in some if r["objective"] and r["long"]), default=None)
        counts = [sum(word.startswith(w) for word in said) for w in ("WORSE", "WRONG NO", "UNKNOWN", "ERROR")]
        shorter = sum(is_worse(r["long"], r["objective"]) for r in some)
        rows.append([kind, len(some), *counts, worst, shorter, float(np.median([r["cpu"] for r in some]))])
    head = ["kind", "tasks", "> 0.1 % worse", "wrong no", "unknown", "error", "worst x", "long search worse"]
    return table([*head, "CPU s, median"], rows)


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


# --- the draw ---------------------------------------------------------------------------------------------------------


def _try(rng: np.random.Generator, kind: str) -> CoupledTask | None:
    names = PAIRS[rng.integers(len(PAIRS))]
    scale = min(REACH[name] for name in names)
    path = _path(rng, scale)
    level = None
    drawn: list[tuple[Arm, Floats]] = []
    for name, title in zip(names, ("main", "follower"), strict=True):
        made = _arm(rng, path, name, title, level)
        if made is None:
            return None
        drawn.append(made)
        level = float(made[1][2]) if kind in ("same_z", "mirror", "rail") else None
    arms, stands = tuple(arm for arm, _ in drawn), np.array([stand for _, stand in drawn])
    apart = stands[1, :2] - stands[0, :2]
    if np.linalg.norm(apart) < 0.1 * scale:
        return None
    if kind == "mirror":  # the arm stays where it is, its base turns under it
        stands[1, 3] = 2.0 * (atan2(apart[1], apart[0]) + 0.5 * np.pi) - stands[0, 3]
    joints = []
    for index, stand in enumerate(stands):
        found = own_stands(own_task(Cell(path, arms), index), stand[None, :3], stand[3:])
        if not found.usable.any():
            return None
        joints.append(found.joints[int(np.argmax(found.usable[:, 0])), 0])
    cell = Cell(path, tuple(_set_free(rng, arm, stand, kind) for arm, stand in zip(arms, stands, strict=True)))
    return CoupledTask(kind, replace(cell, couplings=(_tie(rng, kind, stands),)), Known(stands, tuple(joints)))


def _path(rng: np.random.Generator, scale: float) -> Task:
    start = transform(rotation_z(rng.uniform(-np.pi, np.pi)), [*rng.uniform(-1.0, 1.0, 2), rng.uniform(0.1, 0.6)])
    turn = rotation_about(rng.normal(size=3), rng.uniform(0.0, 1.0))
    travel = rng.normal(size=3) * np.array([1.0, 1.0, 0.5])
    travel *= scale * rng.uniform(0.1, 0.5) / np.linalg.norm(travel)
    end = transform(start[:3, :3] @ turn, start[:3, 3] + travel)
    return line(start, end, int(rng.integers(3, 16)))


def _arm(rng: np.random.Generator, path: Task, name: str, title: str, level: float | None) -> tuple[Arm, Floats] | None:
    """An arm that holds the part in the middle of the path, in a comfortable posture, and its base (x, y, z, yaw).

    ``level``: height of the base if it is given; None back if the part is then too far from the hand.
    """
    chosen, reach = robot(name), REACH[name]
    lower, upper = np.maximum(chosen.lower, -np.pi), np.minimum(chosen.upper, np.pi)
    q = lower + (upper - lower) * rng.uniform(0.2, 0.8, chosen.dof)
    yaw = rng.uniform(-np.pi, np.pi)
    hand = transform(rotation_z(yaw), np.zeros(3)) @ flange_poses(chosen, q)[0]
    middle = path.poses[len(path) // 2]
    stand = middle[:3, 3] + rng.uniform(-0.1, 0.1, 3) * reach - hand[:3, 3]
    if level is not None:
        if abs(level - stand[2]) > 0.35 * reach:
            return None
        stand[2] = level
    hand[:3, 3] += stand
    reference = np.clip(q + rng.normal(0.0, 0.4, chosen.dof), lower, upper)
    here = [Interval(float(v), float(v)) for v in stand]
    region = BaseRegion(here[0], here[1], here[2], FREE_YAW)
    weights = range_weights(chosen.lower, chosen.upper)
    grasp = inverse(middle) @ hand
    arm = Arm(title, chosen, np.eye(4), grasp, region, chosen.lower, chosen.upper, reference, weights)
    return arm, np.array([*stand, yaw])


def _set_free(rng: np.random.Generator, arm: Arm, stand: Floats, kind: str) -> Arm:
    """The arm with a region about the base that was drawn."""
    reach = REACH[arm.robot.name]
    x, y = (_about(rng, float(v), 1.6 * reach) for v in stand[:2])
    z = arm.base.z
    if kind == "same_z" or rng.random() < 0.25:
        z = _about(rng, float(stand[2]), 0.5 * reach)
    yaw = FREE_YAW
    if rng.random() < 0.2:
        yaw = _about(rng, float(stand[3]), rng.uniform(0.5, 3.0))
    return replace(arm, base=BaseRegion(x, y, z, yaw))


def _about(rng: np.random.Generator, value: float, width: float) -> Interval:
    """An interval that holds a value somewhere in its middle half."""
    low = value - width * rng.uniform(0.25, 0.75)
    return Interval(float(low), float(low + width))


def _tie(rng: np.random.Generator, kind: str, stands: Floats) -> Coupling:
    """The coupling that the drawn bases obey."""
    apart = stands[1, :2] - stands[0, :2]
    far, angle = float(np.hypot(*apart)), atan2(apart[1], apart[0])
    match kind:
        case "same_z":
            return SameHeight((0, 1))
        case "distance":
            slack = rng.uniform(0.0, 0.2, 2) * far
            return Distance((0, 1), far - float(slack[0]), far + float(slack[1]))
        case "direction":
            return Direction((0, 1), angle)
        case "rail":
            return Rail((0, 1), angle, (float(stands[0, 0]), float(stands[0, 1])) if rng.random() < 0.5 else None)
        case "rigid":
            return _stand(rng, stands)
        case _:
            middle = 0.5 * (stands[0, :2] + stands[1, :2])
            return Mirror((0, 1), (float(middle[0]), float(middle[1])), angle + 0.5 * np.pi)


def _stand(rng: np.random.Generator, stands: Floats) -> Rigid:
    """The second base in the frame of the first; as it is, or in a box about it."""
    x, y, z = rotation_z(stands[0, 3]).T @ (stands[1, :3] - stands[0, :3])
    turn = float(stands[1, 3] - stands[0, 3])
    exact = rng.random() < 0.5
    widths = np.zeros(4) if exact else rng.choice([0.0, 1.0], 4) * rng.uniform(0.02, 0.4, 4)
    sides = (_about(rng, float(v), w) for v, w in zip((x, y, z, turn), widths, strict=True))
    return Rigid((0, 1), *sides)


if __name__ == "__main__":
    raise SystemExit(main())
