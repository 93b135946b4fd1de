"""Whether what blocks a cell is named, and a change told that undoes it.

``python -m bench.conflicts.planted_conflicts [--count N] [--first SEED] [--file PATH]``

Into a cell of which a layout is known one constraint is planted that this layout breaks by a known amount. Where that
leaves no layout, duocell is asked why: is the planted constraint in the set, and is a change told that is no more than
a fifth above the one that the known layout needs?
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from time import perf_counter, process_time

import numpy as np

from bench.draws.cells import real_cell
from bench.trials.trial import Record, options_of, run, table
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Distance
from duocell.models.cell.floor import Floor
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import Arm, Interval
from duocell.optimizer.infeasibility.changes.candidates import candidates
from duocell.optimizer.infeasibility.changes.remedy import Remedy
from duocell.optimizer.infeasibility.explain import explain
from duocell.optimizer.infeasibility.requirements import Kind, Requirement, Selection
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.findings import Explanation
from duocell.optimizer.settings import Settings
from duocell.optimizer.verification.scene import Scene

KINDS = ("clearance", "floor", "region", "conditioning", "step", "coupling", "obstacle")
NEAR = 1.2
"""A change told may be so many times the one that the known layout needs."""
HALVINGS = 12


@dataclass(frozen=True, eq=False)
class Planted:
    """A cell with a planted constraint.

    Attributes:
        kind: of `KINDS`. cell: the cell. known: layout that breaks nothing but the planted constraint.
        requirement: the planted one. words: it is named if one of what blocks begins like this. pointer: of its change.
    """

    kind: str
    cell: Cell
    known: tuple[ArmSolution, ...]
    requirement: Requirement
    words: str
    pointer: str


def planted(seed: int) -> Planted:
    """Cell ``seed``; kinds take turns."""
    kind, number = KINDS[seed % len(KINDS)], 2 * seed
    while True:
        number += 1
        made = real_cell(number)
        if made.known is not None and (kind != "clearance" or made.cell.surroundings.obstacles):
            points = zip(made.known.stands, made.known.joints, strict=True)
            return plant(kind, made.cell, tuple(ArmSolution(stand[:3], float(stand[3]), q) for stand, q in points))


def plant(kind: str, cell: Cell, known: tuple[ArmSolution, ...]) -> Planted:
    """A constraint of a kind that a known layout breaks."""
    arm, point, around = cell.arms[0], known[0], cell.surroundings
    middle = cell.task.poses[:, :2, 3].mean(axis=0)
    match kind:
        case "clearance":
            asked = replace(around.clearances, arm_obstacle=(around.clearances.arm_obstacle or 0.0) + 0.25)
            cell = replace(cell, surroundings=replace(around, clearances=asked))
            return Planted(kind, cell, known, Requirement(Kind.OBSTACLE), "obstacle", "/clearance/arm_obstacle")
        case "floor":
            (x0, x1), (y0, y1) = arm.base.bounds[:2] + np.array([[-0.3, 0.3]])
            square = np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])
            cell = replace(cell, surroundings=replace(around, floor=Floor(None, (square,), 0.0)))
            return Planted(kind, cell, known, Requirement(Kind.FLOOR), "floor", "/floor")
        case "region":
            away = np.sign(point.position[0] - middle[0]) or 1.0
            x = sorted(float(point.position[0] + away * shift) for shift in (0.8, 0.9))
            cell = _with_arm(cell, replace(arm, base=replace(arm.base, x=Interval(*x))))
            return Planted(kind, cell, known, Requirement(Kind.REGION), "base region", "/arms/0/base")
        case "conditioning":
            length = characteristic_length(arm.robot)
            kept = float(np.min(conditioning_of(chain_of(arm.robot), arm.tool, point.joints, length)))
            cell = _with_arm(cell, replace(arm, min_conditioning=3.0 * kept + 0.1))
            return Planted(
                kind, cell, known, Requirement(Kind.CONDITIONING), "min_conditioning", "/arms/0/min_conditioning"
            )
        case "step":
            steps = [np.max(np.abs(np.diff(p.joints, axis=0))) for p in known]
            cell = replace(cell, max_joint_step=0.2 * float(max(steps)))
            return Planted(kind, cell, known, Requirement(Kind.STEP), "max_joint_step", "/max_joint_step")
        case "coupling":
            apart = float(np.linalg.norm(known[0].position[:2] - known[1].position[:2]))
            distance = Distance((0, 1), 0.0, 0.1 * apart)
            cell = replace(cell, couplings=(*cell.couplings, distance))
            k = len(cell.couplings) - 1
            return Planted(kind, cell, known, Requirement(Kind.COUPLING, k), "coupling distance", f"/coupling/{k}")
        case _:
            hand = cell.flange_targets(arm)[len(cell.task) // 2][:3, 3]
            box = Body("planted", transform(np.eye(3), hand), Box(np.array([0.1, 0.1, 0.1])))
            k = len(around.obstacles)
            cell = replace(cell, surroundings=replace(around, obstacles=(*around.obstacles, box)))
            pointer = f"/obstacles/{k}/pose/position"
            return Planted(kind, cell, known, Requirement(Kind.OBSTACLE, k), "obstacle planted", pointer)


def _with_arm(cell: Cell, arm: Arm) -> Cell:
    return replace(cell, arms=(arm, *cell.arms[1:]))


def needed(made: Planted, remedy: Remedy) -> float | None:
    """The smallest amount for which the known layout is clean, be it more than may be told; None where none is."""

    def works(amount: float) -> bool:
        cell = remedy.change(amount)
        return clean(Scene.of(cell), made.known)

    high = next((times * remedy.most for times in (1.0, 2.0, 4.0) if works(times * remedy.most)), None)
    if high is None:
        return None
    low = 0.0
    for _ in range(HALVINGS):
        low, high = (low, 0.5 * (low + high)) if works(0.5 * (low + high)) else (0.5 * (low + high), high)
    return high


def remedy_of(made: Planted) -> Remedy | None:
    """The change of the planted constraint."""
    arms = frozenset(Requirement(Kind.ARM, a) for a in range(len(made.cell.arms)))
    some = candidates(made.cell, Selection(arms | {made.requirement}, 0, len(made.cell.task) - 1))
    found = next((remedy for remedy in some if remedy.pointer == made.pointer), None)
    return found if found is None or found.fitted is None else found.fitted(made.known)


def amount_of(what: str, remedy: Remedy) -> float:
    """The amount that a sentence tells."""
    numbers = re.findall(
        r"(\d+(?:\.\d+)?) ?(mm|rad)?", re.sub(r"^let \S+|^move .* by|^(drop|remove|leave|allow s).*", "", what)
    )
    if not numbers:
        return remedy.most
    value, unit = numbers[0]
    number = float(value) * (1e-3 if unit == "mm" else 1.0)
    if remedy.pointer.endswith("min_conditioning") or remedy.pointer.startswith("/clearance"):
        return remedy.required - number
    return number - (np.pi - remedy.most) if remedy.pointer == "/max_joint_step" else number


def attempt(seed: int) -> Record:
    """Explain one cell."""
    made = planted(seed)
    layout = optimize(made.cell, Settings(time_limit=120.0))
    record: Record = {"kind": made.kind, "word": layout.outcome.value, "named": None, "works": None, "near": None}
    if layout.usable:
        return record | {"cpu": None, "told": [], "set": [], "needed": None, "amount": None}
    began = process_time()
    found = explain(made.cell, layout, 0, perf_counter() + 120.0)
    seconds = process_time() - began
    if not isinstance(found, Explanation):
        return record | {"cpu": seconds, "told": ["a layout"], "set": [], "needed": None, "amount": None}
    remedy = remedy_of(made)
    least = None if remedy is None else needed(made, remedy)
    told = [r.what for r in found.relaxations if r.pointer == made.pointer]
    amount = amount_of(told[0], remedy) if told and remedy is not None else None
    return record | {
        "named": any(words.startswith(made.words) for words in found.blocking),
        "works": bool(found.relaxations),
        "near": amount is not None and least is not None and amount <= NEAR * least + 1e-3,
        "cpu": seconds,
        "set": list(found.blocking),
        "told": [r.what for r in found.relaxations],
        "needed": least,
        "amount": amount,
    }


def say(record: Record) -> str:
    """One line about a record."""
    seconds = "" if record["cpu"] is None else f"{record['cpu']:.1f} s"
    words = " ".join(name for name in ("named", "works", "near") if record[name])
    return f"{record['seed']:4d} {record['kind']:12} {record['word']:10} {words:18} {seconds}  {record['told'][:1]}"


def summary(records: list[Record]) -> str:
    """The table, by kind; cells that have a layout all the same count for nothing."""
    rows = []
    for kind in [*dict.fromkeys(record["kind"] for record in records), "all"]:
        some = [r for r in records if kind in (r["kind"], "all") and r["cpu"] is not None]
        counts = [sum(bool(r[name]) for r in some) for name in ("named", "works", "near")]
        rows.append([kind, len(some), *counts, float(np.median([r["cpu"] for r in some])) if some else None])
    return table(["kind", "blocked", "named", "a remedy", "within a fifth", "CPU s, median"], rows)


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    print(summary(run(options_of(__doc__, 60, arguments), attempt, say)))
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
