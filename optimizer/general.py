"""Global search of one arm that has no reduced problem: seven joints, no closed form, or a tilted first axis.

A wide net of bases is scored on a few poses by the branches of each pose alone, the best get a continuous path by
`optimizer.layers`, and the local solver does the rest: it moves every joint, so a redundant arm's freedom is used
fully although only samples of it are tried here.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arm import Arm
from models.arrays import Floats
from models.cell import Cell
from models.chain import chain_of
from optimizer.box import spread
from optimizer.layers import LayeredPath, best_path, layers_at, node_costs

SCORED = {0: 1, 1: 32, 2: 64, 3: 256, 4: 512}
"""Bases scored on a few poses, by number of free coordinates."""
PATHS = 12
"""Best bases that get a whole path."""
UNREACHED = 1e3
"""Score of a pose without a branch."""
ROUNDS = 3


@dataclass(frozen=True, eq=False, slots=True)
class GeneralScreen:
    """Paths, best first, and how many bases were scored."""

    paths: list[LayeredPath]
    evaluated: int


def screen_general(cell: Cell, arm: Arm, box: Floats, seed: int) -> GeneralScreen:
    """Search bases in a box.

    Args:
        cell: task and step limit.
        arm: the arm.
        box: (3, 2) m from `optimizer.box.search_box`.
        seed: of the point set.

    Returns:
        Paths, those that respect all limits first, then by objective.
    """
    sigma = chain_of(arm.robot).vertical_sign
    yaw = np.array([[0.0, 0.0]]) if sigma else arm.base.bounds[3:]
    region = np.concatenate([box, yaw])
    poses = np.unique(np.linspace(0, len(cell.task) - 1, 3).round())
    count = SCORED[int(np.sum(region[:, 1] > region[:, 0]))]
    found: list[LayeredPath] = []
    evaluated = 0
    for round_ in range(ROUNDS if count > 1 else 1):
        places = spread(region, count, seed + round_)
        evaluated += len(places)
        scores = np.array([_score(cell, arm, place, poses, bool(sigma)) for place in places])
        order = np.argsort(scores, kind="stable")[:PATHS]
        found += [best_path(cell, arm, places[i, :3], float(places[i, 3])) for i in order]
        if any(path.violation == 0.0 for path in found):
            break
        count *= 2
    return GeneralScreen(sorted(found, key=lambda p: (p.violation > 0.0, p.violation, p.objective)), evaluated)


def _score(cell: Cell, arm: Arm, place: Floats, poses: Floats, skip_first: bool) -> float:
    """Optimistic cost of a base: each pose in its best branch, whatever its neighbours do."""
    score = 0.0
    for layer in layers_at(cell, arm, place[:3], float(place[3]), poses):
        score += float(np.min(node_costs(arm, layer, skip_first))) if len(layer) else UNREACHED
    return score
