"""Exclusions against samples: is any layout usable in a box that a test excludes, or cheaper than the bound of one?

``python -m bench.soundness.soundness [--count N] [--first SEED] [--seconds S] [--file PATH]``. Every number is a cell:
even ones are of the hundred of `bench.draws.cells`, odd ones are drawn (tilted mounts, task sequences, all shapes,
`min_conditioning`). For each arm, boxes from 0.3 mm to 0.3 m around places that the arm reaches are bounded and
tested; members of them, half of them corners, some with another yaw, are asked for by closed form and Coal; so are
pairs of boxes of two arms that contact excludes. What is inscribed, moved and expanded on one side is placed and
measured on the other.
"""

from __future__ import annotations

import sys
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bench.draws.soundness_cells import soundness_cell
from bench.trials.trial import Record, draw_of, options_of, run, table
from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.causes import TOLERANCE
from duocell.optimizer.certificate.exclusion.exclude import Exclusion
from duocell.optimizer.certificate.nodes import Nodes
from duocell.optimizer.certificate.pairs.contact import Contact
from duocell.optimizer.certificate.pairs.store import PairStore
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate, evaluate_signed, reduced_problem
from duocell.optimizer.verification.scene import Scene, own_violations

BOXES, SAMPLES = 200, 16
"""Boxes per arm, and members sampled of each."""
PAIRS = 4
"""Pairs of boxes of two arms, per box of one of them."""
PLACES = 1500
"""Places among which those in reach are looked for."""
SMALLEST, LARGEST = -3.5, -0.5
"""Decimal logarithms of the half sides [m]."""
TURNED = 0.3
"""rad; standard deviation of other yaws."""


@dataclass(frozen=True, eq=False, slots=True)
class Member:
    """A base in a box, with its path: the number of the box, and the objective."""

    box: int
    point: ArmSolution
    objective: float


@dataclass(frozen=True, eq=False, slots=True)
class Trial:
    """Boxes of one arm and what the tests say of them.

    Attributes:
        tree: of the arm. boxes: N of them. geometric: (N,) bounds of joints and limits alone. found: by the tests.
    """

    tree: ArmTree
    boxes: Boxes
    geometric: Floats
    found: Exclusion

    def members(self, rng: np.random.Generator, samples: int) -> Iterator[Member]:
        """Bases of boxes that are excluded or whose bound was raised, with paths that limits and steps allow."""
        problem, boxes = self.tree.problem, self.boxes
        told = (self.found.code > 0) | (self.found.bound > self.geometric * (1.0 + 1e-9))
        for number in range(samples):
            shares = rng.uniform(-1.0, 1.0, boxes.half.shape)
            if number % 2:
                shares = rng.choice([-1.0, 0.0, 1.0], boxes.half.shape)
            places = boxes.centre + boxes.half * shares
            paths = evaluate_signed(problem, places, np.array(ALL_SIGNS)[boxes.posture])
            turn = TURNED * float(rng.normal()) if number % 4 == 0 else 0.0
            for k in np.flatnonzero((paths.violation[0] <= 0.0) & told):
                joints = paths.joints[:, 0, k].T.copy()
                joints[:, 0] += turn
                yaw = float(paths.yaw[0, k]) - problem.sigma * turn
                point = ArmSolution(places[k], yaw, joints, ALL_SIGNS[boxes.posture[k]])
                if _allowed(problem, point):
                    yield Member(int(k), point, _objective(problem, joints))


def trial_of(scene: Scene, index: int, rng: np.random.Generator, count: int = BOXES) -> Trial | None:
    """Bound and test random boxes of one arm; None where it has no closed form or reaches nothing."""
    problem = reduced_problem(scene.cell, scene.cell.arms[index])
    tree = None if problem is None else ArmTree(scene, index, problem, known=True)
    boxes = None if tree is None else _boxes(tree, count, rng)
    if tree is None or boxes is None:
        return None
    bounds = tree.bounder.bounds(boxes, np.inf)
    kept = np.isfinite(bounds.lower)
    boxes, lower = boxes[kept], bounds.lower[kept]
    return Trial(tree, boxes, lower, tree.excluder(boxes, lower, np.inf))


def violations(trial: Trial, members: list[Member]) -> Counter[str]:
    """Counts by kind of cause: "samples" of it, and "wrong" ones, which are usable or too cheap all the same."""
    counts: Counter[str] = Counter()
    if not members:
        return counts
    amounts = own_violations(trial.tree.check.scene, [member.point for member in members])
    for member, violation in zip(members, amounts, strict=True):
        code = int(trial.found.code[member.box])
        kind = trial.tree.excluder.causes.all[code].kind if code else "raised"
        counts[f"{kind} samples"] += 1
        usable = violation <= KEPT and _conditioned(trial.tree.problem, member.point)
        if usable and (code > 0 or member.objective < trial.found.bound[member.box] * (1.0 - 1e-9)):
            counts[f"{kind} wrong"] += 1
    return counts


def attempt(number: int, boxes: int = BOXES, samples: int = SAMPLES) -> Record:
    """All arms of one cell."""
    rng = draw_of("soundness", number)
    scene = Scene.of(soundness_cell(number, rng))
    counts: Counter[str] = Counter()
    for index in range(len(scene.cell.arms)):
        trial = trial_of(scene, index, rng, boxes)
        if trial is not None:
            counts["boxes"] += len(trial.boxes)
            counts["excluded"] += int(np.sum(trial.found.code > 0))
            counts += violations(trial, list(trial.members(rng, samples)))
    return dict(counts + pair_violations(scene, rng, boxes, samples))


def pair_violations(scene: Scene, rng: np.random.Generator, count: int, samples: int) -> Counter[str]:
    """Counts for pairs of boxes of the first two arms: pairs, those excluded, samples of these, and wrong ones."""
    trees = [_planted(scene, index, count, rng) for index in (0, 1)] if len(scene.cell.arms) > 1 else [None]
    counts: Counter[str] = Counter()
    if scene.model is None or any(tree is None for tree in trees):
        return counts
    one, other = (tree for tree in trees if tree is not None)
    contact = Contact.of(PairStore.of(one), PairStore.of(other), scene.model, scene.required)
    first, second = (rng.integers(0, len(tree.nodes), PAIRS * count) for tree in (one, other))
    apart = contact.slack(first, second) < -TOLERANCE
    counts["pairs"], counts["pairs excluded"] = len(first), int(np.sum(apart))
    for number in range(samples):
        points = [_placed(tree, ids[apart], number, rng) for tree, ids in ((one, first), (other, second))]
        layouts = [[a, b] for a, b in zip(*points, strict=True) if a is not None and b is not None]
        violations = scene.contact_violations(layouts)
        counts["arm_arm samples"] += len(layouts)
        counts["arm_arm wrong"] += int(np.sum(violations <= KEPT))
    return counts


def _planted(scene: Scene, index: int, count: int, rng: np.random.Generator) -> ArmTree | None:
    """A tree whose nodes are random boxes within reach."""
    problem = reduced_problem(scene.cell, scene.cell.arms[index])
    tree = None if problem is None else ArmTree(scene, index, problem, known=True)
    boxes = None if tree is None else _boxes(tree, count, rng)
    if tree is None or boxes is None:
        return None
    tree.nodes = Nodes(boxes)
    return tree


def _placed(tree: ArmTree, ids: Ints, number: int, rng: np.random.Generator) -> list[ArmSolution | None]:
    """Bases in boxes with their paths; None where a path is not usable."""
    boxes = tree.nodes.boxes(ids)
    shares = rng.uniform(-1.0, 1.0, boxes.half.shape)
    if number % 2:
        shares = rng.choice([-1.0, 0.0, 1.0], boxes.half.shape)
    places = boxes.centre + boxes.half * shares
    paths = evaluate_signed(tree.problem, places, boxes.signs)
    usable = paths.violation[0] <= 0.0
    return [
        ArmSolution(places[k], float(paths.yaw[0, k]), paths.joints[:, 0, k].T, ALL_SIGNS[boxes.posture[k]])
        if usable[k]
        else None
        for k in range(len(boxes))
    ]


def _boxes(tree: ArmTree, count: int, rng: np.random.Generator) -> Boxes | None:
    """Boxes around places that work as far as joints are concerned."""
    region, problem = tree.region, tree.problem
    if region.empty:
        return None
    places = rng.uniform(region.low, region.high, (PLACES, 3))
    postures, rows = np.nonzero(evaluate(problem, places).violation == 0.0)
    if not len(rows):
        return None
    pick = rng.integers(0, len(rows), count)
    sides = 10.0 ** rng.uniform(SMALLEST, LARGEST, (count, 1)) * rng.uniform(0.2, 1.0, (count, 3))
    half = sides * (region.high > region.low)
    return Boxes(places[rows[pick]] + half * rng.uniform(-1.0, 1.0, (count, 3)), half, postures[pick])


def _allowed(problem: ReducedProblem, point: ArmSolution) -> bool:
    """True if a turned base keeps the limits of joint 1 and of its yaw."""
    arm, first = problem.arm, point.joints[:, 0]
    limited = bool(np.isfinite(arm.lower[0]) and np.isfinite(arm.upper[0]))
    inside = not limited or bool(np.all((first >= arm.lower[0]) & (first <= arm.upper[0])))
    return inside and arm.base.yaw_outside(point.yaw) <= 1e-9


def _objective(problem: ReducedProblem, joints: Floats) -> float:
    """E of one arm from its joints (m, 6)."""
    each = (joints - problem.arm.reference) ** 2 @ problem.arm.weights
    return float(np.sum(each if problem.weights is None else each * problem.weights))


def _conditioned(problem: ReducedProblem, point: ArmSolution) -> bool:
    arm = problem.arm
    if arm.min_conditioning is None:
        return True
    values = conditioning_of(chain_of(arm.robot), arm.tool, point.joints, characteristic_length(arm.robot))
    return bool(np.min(values) >= arm.min_conditioning - KEPT)


def _say(record: Record) -> str:
    wrong = {name: count for name, count in record.items() if name.endswith("wrong")}
    samples = sum(count for name, count in record.items() if name.endswith("samples"))
    return (
        f"{record['seed']}: {record.get('excluded', 0)} of {record.get('boxes', 0)} boxes, {samples} samples, {wrong}"
    )


def main() -> int:
    """Run the trial."""
    records = run(options_of(__doc__, 200), attempt, _say)
    counts: Counter[str] = Counter()
    for record in records:
        counts += Counter({name: count for name, count in record.items() if name != "seed"})
    kinds = sorted({name.rsplit(" ", 1)[0] for name in counts if name.endswith((" samples", " wrong"))})
    print(table(("cause", "samples", "wrong"), [(k, counts[f"{k} samples"], counts[f"{k} wrong"]) for k in kinds]))
    return int(any(counts[f"{kind} wrong"] for kind in kinds))


if __name__ == "__main__":
    sys.exit(main())
