"""Whole layouts out of thousands of placements per arm: those that keep everything first, cheapest first."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.coupled.candidates.candidates import ArmCandidates
from duocell.optimizer.coupled.candidates.extender import Extender, Layouts, first_layouts
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.coupled.candidates.loose import LooseTies
from duocell.optimizer.coupled.candidates.placement_filter import PlacementFilter
from duocell.optimizer.coupled.candidates.placements import placements_at
from duocell.optimizer.coupled.candidates.unknowns import TiedUnknowns
from duocell.optimizer.parameters.coupled import COUPLED, Pairing
from duocell.optimizer.reduction.box import search_box


def sample_layouts(
    followed: Followed,
    density: float,
    seed: int,
    pairing: Pairing = COUPLED.full,
    closely: bool = False,
    positions: tuple[int, int, int, int] = COUPLED.positions,
) -> tuple[Layouts, int]:
    """Layouts without sure violations, those without any first; and how many placements were tried.

    Args:
        followed: the cell.
        density: how many times ``positions``. seed: of the samples.
        pairing: how far pairs of placements are looked through.
        closely: take only placements that their arm can follow all the way between the poses.
        positions: of the bases at density 1, by number of free coordinates of an arm.
    """
    scene, problems = followed.scene, followed.problems
    boxes = boxes_of(followed)
    unknowns = TiedUnknowns.of(scene.cell, boxes)
    count, spacing = _counted(boxes, density, positions)
    samples = unknowns.sampled(count, seed)
    arms: list[ArmCandidates] = []
    layouts: Layouts | None = None
    for index, (problem, own) in enumerate(zip(problems, samples, strict=True)):
        tests = PlacementFilter(scene, index, problem.problem, closely)
        arms.append(ArmCandidates(problem, placements_at(problem, own), tests))
        ties = LooseTies.of(scene.cell.couplings, problems[: index + 1], unknowns, spacing)
        if layouts is None:
            layouts = first_layouts(arms[0], ties, len(problems) == 1)
        else:
            layouts = Extender(scene, arms, ties, pairing).extended(layouts)
        if not len(layouts):
            break
    tried = sum(
        len(own.positions) * int(np.sum(problem.problem.postures))
        for own, problem in zip(samples, problems, strict=True)
    )
    if layouts is None:
        raise AssertionError("a cell without arms")
    return layouts, tried


def _counted(boxes: Floats, density: float, positions: tuple[int, int, int, int]) -> tuple[int, float]:
    """How many positions per arm, and about how far [m] they are apart."""
    width = boxes[..., 1] - boxes[..., 0]
    free = np.sum(width > 0.0, axis=1)
    most = int(np.argmax(free))
    count = max(1, round(positions[int(free[most])] * density)) if free[most] else 1
    sides = width[most][width[most] > 0.0]
    return count, float(np.prod(sides) / count) ** (1.0 / len(sides)) if len(sides) else 0.0


def boxes_of(followed: Followed) -> Floats:
    """(A, 3, 2) m, where the bases may stand."""
    return np.array([search_box(followed.scene.cell, problem.arm) for problem in followed.problems])
