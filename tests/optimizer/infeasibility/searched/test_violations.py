"""What a layout breaks, against a slow judge and a layout that is known to break nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.draws.cell_draw import Known
from bench.draws.cells import real_cell
from bench.judges.dense_check import dense_check
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Surroundings
from duocell.optimizer.infeasibility.requirements import Kind
from duocell.optimizer.infeasibility.searched.partial_path import PartialPath, extended
from duocell.optimizer.infeasibility.searched.violations import violations
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from tests.support.present import present


@pytest.mark.parametrize("seed", [0, 4, 5])
def test_a_layout_that_is_known_to_work_breaks_nothing(seed: int) -> None:
    real = real_cell(seed)
    assert real.known is not None
    paths = known_paths(real.cell, real.known)
    assert violations(real.cell, paths) == ()
    points = [path.point for path in paths.values()]
    middle = {
        a: extended(real.cell, arm, replace(p, joints=p.joints[1:3]), 1, 2)
        for a, (arm, p) in enumerate(zip(real.cell.arms, points, strict=True))
    }
    for a, path in middle.items():
        assert (path.first, path.last, path.lost) == (0, len(real.cell.task) - 1, ())
        assert path.point.joints == pytest.approx(points[a].joints, abs=1e-6)


def known_paths(cell: Cell, known: Known) -> dict[int, PartialPath]:
    return {
        a: PartialPath(ArmSolution(stand[:3], float(stand[3]), q, None), 0, len(q) - 1, ())
        for a, (stand, q) in enumerate(zip(known.stands, known.joints, strict=True))
    }


@pytest.mark.parametrize("seed", [0, 4, 12, 16])
def test_what_is_broken_is_what_a_dense_check_finds(seed: int) -> None:
    """The best layout of arms that know of nothing around them: the same classes, floor, couplings as a slow judge."""
    cell = real_cell(seed).cell
    best = optimize(replace(cell, surroundings=Surroundings(), couplings=()))
    paths = {
        a: PartialPath(ArmSolution(p.position, p.yaw, p.joints, None), 0, len(cell.task) - 1, ())
        for a, p in enumerate(best.placements)
    }
    found = violations(cell, paths)
    stands = np.array([[*path.point.position, path.point.yaw] for path in paths.values()])
    verdict = dense_check(cell, stands, [path.point.joints for path in paths.values()], 0.01, 0.05)
    kinds = {frozenset(e.kind for e in v.requirements) for v in found}
    asked = cell.surroundings.clearances
    pairs = {
        "arm_arm": (frozenset({Kind.ARM}), asked.arm_arm),
        "arm_part": (frozenset({Kind.ARM, Kind.PART}), asked.arm_part),
        "arm_obstacle": (frozenset({Kind.ARM, Kind.OBSTACLE}), asked.arm_obstacle),
        "self": (frozenset({Kind.ARM, Kind.SELF}), asked.self_collision),
    }
    for word, (requirements, required) in pairs.items():
        nearest = verdict.nearest.get(word)
        if nearest is not None and abs(nearest.distance - present(required)) > 0.004:
            assert (requirements in kinds) == (nearest.distance < present(required)), word
    assert (frozenset({Kind.ARM, Kind.FLOOR}) in kinds) == (verdict.floor_gap < 0.0)
    coupled = any(Kind.COUPLING in kind for kind in kinds)
    assert coupled == (verdict.coupling_excess > 1e-6)
