"""Arms that have no layout among their surroundings even without the others: asked when a first look finds nothing."""

from __future__ import annotations

import time
from collections.abc import Sequence

import numpy as np

from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.cell_proof import ArmPart
from duocell.optimizer.certificate.words import reasons_of_arm
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.verification.scene import Scene

BOXES = 2000
"""Of one arm's tree at most: what takes more is left to the proof that follows the search."""


def impossible_alone(scene: Scene, problems: Sequence[ReducedProblem], deadline: float) -> tuple[Reason, ...]:
    """Proofs that an arm has no layout by itself, in words; empty where none was found.

    Args:
        scene: the cell. problems: reduced problems of all its arms, in order.
        deadline: `time.perf_counter` value, soft.
    """
    for index, problem in enumerate(problems):
        tree = ArmTree(scene, index, problem)
        while not tree.empty and tree.alone is None and tree.boxes < BOXES and time.perf_counter() < deadline:
            check_stop()
            if not tree.work_off(np.inf, by_size=True):
                break
        if tree.empty:
            return reasons_of_arm(scene.cell, problem.arm, ArmPart(np.inf, tree.boxes, tree))
    return ()
