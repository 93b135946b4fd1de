"""Global search of one arm that has no reduced problem: seven joints, no closed form, or a tilted first axis.

Two nets are cast. Bases are scored on a few poses by the branches of each pose alone, and the best get a continuous
path by `optimizer.layers`; and paths are followed from many random postures by `optimizer.continuation`. The local
solver does the rest: it moves every joint, so a redundant arm's freedom is used fully although only samples of it are
tried here.
"""

from __future__ import annotations

import time
from dataclasses import dataclass

import numpy as np

from models.arm import Arm
from models.arrays import Floats
from models.cell import Cell
from models.chain import chain_of
from models.inverse import quickly_enumerated
from optimizer.box import spread
from optimizer.continuation import continue_paths
from optimizer.layers import LayeredPath, best_path, layers_at, node_costs
from optimizer.watch import check_stop

SCORED = {0: 1, 1: 16, 2: 32, 3: 64, 4: 128}
"""Bases scored on a few poses, by number of free coordinates."""
PATHS = 6
"""Best bases that get a path through the layers of all poses."""
FOLLOWED = 256
"""Random postures followed along the task."""
SAME_PLACE, SAME_JOINTS = 0.1, 0.5
"""m and rad: paths nearer than this to each other count as one start."""
LONG_TASK = 100
"""Poses from which on only a quarter as many postures are followed."""
UNREACHED = 1e3
"""Score of a pose without a branch."""
ROUNDS = 3


@dataclass(frozen=True, eq=False, slots=True)
class GeneralScreen:
    """Paths, best first, and how many bases were scored."""

    paths: list[LayeredPath]
    evaluated: int


def screen_general(cell: Cell, arm: Arm, box: Floats, seed: int, deadline: float = np.inf) -> GeneralScreen:
    """Search bases in a box.

    Args:
        cell: task and step limit.
        arm: the arm.
        box: (3, 2) m from `optimizer.box.search_box`.
        seed: of the point set.
        deadline: `time.perf_counter` value after which nothing more is looked at.

    Returns:
        Paths, those that respect all limits first, then by objective.
    """
    sigma = chain_of(arm.robot).vertical_sign
    yaw = np.array([[0.0, 0.0]]) if sigma else arm.base.bounds[3:]
    region = np.concatenate([box, yaw])
    found: list[LayeredPath] = []
    evaluated = 0
    for round_ in range(ROUNDS):
        followed = (FOLLOWED if len(cell.task) < LONG_TASK else FOLLOWED // 4) * 2**round_
        found += continue_paths(cell, arm, region, seed + round_, followed, deadline)
        evaluated += followed
        if quickly_enumerated(arm.robot) and time.perf_counter() < deadline:
            places = _best_places(cell, arm, region, seed + round_, 2**round_, deadline)
            evaluated += len(places)
            for place in places[:PATHS]:
                check_stop()
                if time.perf_counter() < deadline:
                    found.append(best_path(cell, arm, place[:3], float(place[3])))
        if any(path.violation == 0.0 for path in found) or time.perf_counter() > deadline:
            break
    return GeneralScreen(sorted(found, key=lambda p: (p.violation > 0.0, p.violation, p.objective)), evaluated)


def _best_places(cell: Cell, arm: Arm, region: Floats, seed: int, factor: int, deadline: float) -> Floats:
    """(k, 4) places spread over the region, best first by the cost of a few poses alone."""
    poses = np.concatenate([np.unique(np.linspace(job.start, job.stop - 1, 3).round()) for job in cell.task.jobs])
    skip_first = bool(chain_of(arm.robot).vertical_sign)
    places = spread(region, SCORED[int(np.sum(region[:, 1] > region[:, 0]))] * factor, seed)
    scores = np.full(len(places), np.inf)
    for index, place in enumerate(places):
        check_stop()
        if time.perf_counter() > deadline:
            break
        scores[index] = _score(cell, arm, place, poses, skip_first)
    return places[np.argsort(scores, kind="stable")]


def different(paths: list[LayeredPath]) -> list[LayeredPath]:
    """Paths in order, without those that stand and bend about as an earlier one does: they end in the same optimum."""
    kept: list[LayeredPath] = []
    for path in paths:
        if not any(
            float(np.max(np.abs(path.position - other.position))) < SAME_PLACE
            and float(np.max(np.abs(path.joints - other.joints))) < SAME_JOINTS
            for other in kept
        ):
            kept.append(path)
    return kept


def _score(cell: Cell, arm: Arm, place: Floats, poses: Floats, skip_first: bool) -> float:
    """Optimistic cost of a base: each pose in its best branch, whatever its neighbours do."""
    score = 0.0
    weights = cell.task.weights[poses.astype(int)] / cell.task.weight_scale
    for layer, weight in zip(layers_at(cell, arm, place[:3], float(place[3]), poses), weights, strict=True):
        score += float(np.min(node_costs(arm, layer, skip_first, float(weight)))) if len(layer) else UNREACHED
    return score
