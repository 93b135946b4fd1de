"""Bounds of tied arms against samples: is any layout that keeps the ties cheaper than the bound of its pair of boxes?

``python -m bench.soundness.tied_soundness [--count N] [--first SEED] [--seconds S] [--file PATH]``. Every number is a
cell of `bench.draws.cells` with a coupling, or, from `bench.trials.coupled_tasks.RIGID` on, two arms on one stand.
Places that keep its ties are drawn, boxes from 1 mm to 0.3 m around them, and yaws that keep a mirror or a stand; what
such layouts cost is computed from their joints, and whether they are usable is asked of Coal.
"""

from __future__ import annotations

import sys
from collections import Counter
from math import cos, sin

import numpy as np

from bench.draws.cells import CELLS, real_cell
from bench.trials.coupled_tasks import RIGID, coupled_task
from bench.trials.trial import Record, draw_of, options_of, run
from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, Rigid, SameHeight
from duocell.models.robot.arm import TURN
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.nodes import Nodes
from duocell.optimizer.certificate.pairs.pair_tree import PairTree
from duocell.optimizer.certificate.proposals import moved_yaw
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem
from duocell.optimizer.verification.scene import Scene

PAIRS, PLACES = 60, 4000
"""Pairs of boxes of a cell, and places among which usable ones are looked for."""
SMALLEST, LARGEST = -3.0, -0.5
"""Decimal logarithms of the half sides [m]."""
TURNED = 0.6
"""rad; standard deviation of yaws about those that suit the arms best."""


def attempt(number: int, pairs: int = PAIRS) -> Record:
    """One cell: pairs, those whose bound is above the sum of both arms' own, and what is wrong."""
    cell = coupled_task(number).cell if number >= RIGID else real_cell(number % CELLS).cell
    rng = draw_of("tied_soundness", number)
    counts: Counter[str] = Counter()
    problems = [reduced_problem(cell, arm) for arm in cell.arms]
    if not cell.couplings or any(problem is None for problem in problems):
        return {}
    scene = Scene.of(cell)
    trees = [ArmTree(scene, k, problem, known=True) for k, problem in enumerate(problems) if problem is not None]
    if any(tree.region.empty for tree in trees):
        return {}
    drawn = _drawn(trees, cell.couplings, rng, pairs)
    for tree, (boxes, _) in zip(trees, drawn, strict=True):
        tree.nodes = Nodes(boxes)
        ids = np.arange(len(boxes))
        tree.evaluate(ids, np.inf, search=False)
        tree.nodes.code[ids] = np.where(np.isinf(tree.nodes.geometric[ids]), tree.nodes.code[ids], 0)
    fine = np.flatnonzero(np.isfinite(trees[0].nodes.geometric) & np.isfinite(trees[1].nodes.geometric))
    pair = PairTree(scene, (trees[0], trees[1]), (0, 1))
    bound = np.array(trees[0].nodes.geometric[fine] + trees[1].nodes.geometric[fine])
    plain = bound.copy()
    pair.bound_ties(fine, fine, bound, np.ones(len(fine), dtype=np.bool_), 1e12)
    counts["pairs"], counts["raised"] = len(fine), int(np.sum(bound > plain * (1.0 + 1e-9)))
    for at, lower in zip(fine, bound, strict=True):
        points = [points[at] for _, points in drawn]
        objective = scene.objective(points)
        counts["samples"] += 1
        counts["tight"] += int(lower > 0.95 * objective)
        if objective < lower * (1.0 - 1e-9) - 1e-9:
            counts["below"] += 1
            counts["wrong"] += int(
                scene.contact_violations([points])[0] <= KEPT and scene.floor_violation(points) <= KEPT
            )
    return dict(counts)


def _drawn(
    trees: list[ArmTree], couplings: tuple[Coupling, ...], rng: np.random.Generator, count: int
) -> list[tuple[Boxes, list[ArmSolution]]]:
    """Boxes of both arms, and layouts in them that keep the ties."""
    first = rng.uniform(trees[0].region.low, trees[0].region.high, (PLACES, 3))
    second = rng.uniform(trees[1].region.low, trees[1].region.high, (PLACES, 3))
    yaws = np.zeros((PLACES, 2))
    for coupling in couplings:
        if isinstance(coupling, Rigid):
            second, yaws = _on_one_stand(coupling, first, trees[0], rng)
        else:
            first, second = _tied(coupling, first, second)
    bounds = trees[1].problem.arm.base.bounds[:3]
    inside = np.all((second >= bounds[:, 0] - 1e-9) & (second <= bounds[:, 1] + 1e-9), axis=1)
    found = [evaluate(tree.problem, places) for tree, places in zip(trees, (first, second), strict=True)]
    fine = [part.violation <= 0.0 for part in found]
    rows = np.flatnonzero(inside & np.any(fine[0], axis=0) & np.any(fine[1], axis=0))
    rows = rows[rng.permutation(len(rows))[:count]]
    layouts: list[list[ArmSolution]] = [[], []]
    for row in rows:
        for k, places in enumerate((first, second)):
            posture = int(rng.choice(np.flatnonzero(fine[k][:, row])))
            joints, yaw = found[k].joints[:, posture, row].T, float(found[k].yaw[posture, row])
            layouts[k].append(ArmSolution(places[row], yaw, joints, ALL_SIGNS[posture]))
    pairs = zip(rows, zip(*layouts, strict=True), strict=True)
    turned = (_turned(trees, couplings, pair, yaws[row], rng) for row, pair in pairs)
    kept = [pair for pair in turned if pair is not None]
    return [(_boxes(tree, [pair[k] for pair in kept], rng), [pair[k] for pair in kept]) for k, tree in enumerate(trees)]


def _turned(
    trees: list[ArmTree],
    couplings: tuple[Coupling, ...],
    pair: tuple[ArmSolution, ...],
    yaws: Floats,
    rng: np.random.Generator,
) -> tuple[ArmSolution, ...] | None:
    """A layout whose yaws keep a mirror, or are those of one stand (2,), if there is one; None where they cannot."""
    mirrors = [coupling for coupling in couplings if isinstance(coupling, Mirror)]
    if mirrors:
        off = 2.0 * mirrors[0].angle - pair[0].yaw - pair[1].yaw
        off -= TURN * round(off / TURN)
        share = 0.5 * off + TURNED * float(rng.normal())
        turns = share, off - share
    elif any(isinstance(coupling, Rigid) for coupling in couplings):
        by = yaws - np.array([point.yaw for point in pair])
        turns = tuple(by - TURN * np.round(by / TURN))
    else:
        return pair
    turned = []
    for tree, point, turn in zip(trees, pair, turns, strict=True):
        arm = tree.problem.arm
        if arm.base.yaw_outside(point.yaw + turn) > 1e-9:
            return None
        turned.append(moved_yaw(tree.problem, point, turn))
        path = turned[-1].joints[:, 0]
        if np.any(path < arm.lower[0]) or np.any(path > arm.upper[0]):
            return None
    return tuple(turned)


def _boxes(tree: ArmTree, points: list[ArmSolution], rng: np.random.Generator) -> Boxes:
    places = np.array([point.position for point in points]).reshape(-1, 3)
    half = 10.0 ** rng.uniform(SMALLEST, LARGEST, (len(points), 1)) * rng.uniform(0.2, 1.0, (len(points), 3))
    half = half * (tree.region.high > tree.region.low)
    posture = np.array([ALL_SIGNS.index(point.signs) for point in points if point.signs is not None], dtype=np.int64)
    return Boxes(places + half * rng.uniform(-1.0, 1.0, half.shape), half, posture)


def _on_one_stand(rigid: Rigid, first: Floats, tree: ArmTree, rng: np.random.Generator) -> tuple[Floats, Floats]:
    """Places (n, 3) of the second arm, and yaws (n, 2) of both: those of the first are about one that suits it."""
    found = evaluate(tree.problem, first)
    suits = np.where(found.violation <= 0.0, found.yaw, np.nan)
    posture = np.argmax(np.isfinite(suits), axis=0)
    yaw = np.nan_to_num(suits[posture, np.arange(len(first))]) + TURNED * rng.normal(size=len(first))
    x, y, z, turn = (rng.uniform(side.low, side.high, len(first)) for side in (rigid.x, rigid.y, rigid.z, rigid.yaw))
    shift = [np.cos(yaw) * x - np.sin(yaw) * y, np.sin(yaw) * x + np.cos(yaw) * y, z]
    return first + np.stack(shift, axis=1), np.column_stack([yaw, yaw + turn])


def _tied(coupling: Coupling, first: Floats, second: Floats) -> tuple[Floats, Floats]:
    """Places (n, 3) of two arms, moved so that they keep a coupling."""
    angle = getattr(coupling, "angle", 0.0)
    across = np.array([-sin(angle), cos(angle)])
    first, second = first.copy(), second.copy()
    one, other = (first, second) if coupling.arms.index(0) < coupling.arms.index(1) else (second, first)
    if isinstance(coupling, SameHeight | Rail | Mirror):
        other[:, 2] = one[:, 2]
    if isinstance(coupling, Rail) and coupling.point is not None:
        one[:, :2] -= np.outer((one[:, :2] - coupling.point) @ across, across)
    if isinstance(coupling, Rail | Direction):
        other[:, :2] -= np.outer((other[:, :2] - one[:, :2]) @ across, across)
    if isinstance(coupling, Mirror):
        aside = (one[:, :2] - coupling.point) @ across
        other[:, :2] = one[:, :2] - 2.0 * np.outer(aside, across)
    if isinstance(coupling, Distance):
        apart = other[:, :2] - one[:, :2]
        size = np.linalg.norm(apart, axis=1, keepdims=True)
        other[:, :2] = one[:, :2] + apart / size * np.clip(size, coupling.minimum, coupling.maximum)
    return first, second


def _say(record: Record) -> str:
    return f"{record['seed']}: " + ", ".join(f"{name} {value}" for name, value in record.items() if name != "seed")


def main() -> int:
    """Run the trial."""
    records = run(options_of(__doc__, 2 * CELLS), attempt, _say)
    counts: Counter[str] = Counter()
    for record in records:
        counts += Counter({name: value for name, value in record.items() if name != "seed"})
    print(dict(counts))
    return int(counts["wrong"] > 0)


if __name__ == "__main__":
    sys.exit(main())
