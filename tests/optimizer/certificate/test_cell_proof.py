"""Bounds of cells are below layouts that work and come near to the best; cells without a layout are proved to be so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.draws.cells import real_cell
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import BaseRegion, Interval
from duocell.optimizer.certificate.cell_proof import CellProof, prove_cell
from duocell.optimizer.certificate.leaves import excluded_shares
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.sqp.refine import Refined
from duocell.optimizer.verification.scene import Scene


def _proof(cell: Cell, known: list[Refined], settings: CertificateSettings) -> CellProof:
    problems = [problem for arm in cell.arms if (problem := reduced_problem(cell, arm)) is not None]
    return prove_cell(Scene.of(cell), problems, known, settings)


def _known(seed: int) -> Refined:
    """The layout that a cell was drawn around."""
    real = real_cell(seed)
    assert real.known is not None
    points = tuple(
        ArmSolution(stand[:3], float(stand[3]), joints)
        for stand, joints in zip(real.known.stands, real.known.joints, strict=True)
    )
    objective = Scene.of(real.cell).objective(points)
    return Refined(points, objective, 0.0, True, None, 0)


def test_a_cell_is_bounded_below_its_layouts() -> None:
    known, cell = _known(8), real_cell(8).cell
    proof = _proof(cell, [known], CertificateSettings(gap=0.5, time_limit=60.0, boxes=3000))
    assert 0.0 < proof.lower <= known.objective
    best = Refined((), 65.603, 0.0, True, None, 0)
    near = _proof(cell, [best], CertificateSettings(gap=0.02, time_limit=60.0, boxes=6000))
    assert 0.98 * best.objective * (1.0 - 1e-6) <= near.lower <= best.objective
    assert near.ended


def test_the_proof_is_the_same_every_time() -> None:
    cell, best = real_cell(24).cell, Refined((), 1.0e3, 0.0, True, None, 0)
    settings = CertificateSettings(gap=0.01, time_limit=600.0, boxes=500)
    one, other = (_proof(cell, [best], settings) for _ in range(2))
    assert (one.lower, one.boxes) == (other.lower, other.boxes)


def test_an_arm_behind_a_wall_makes_a_cell_infeasible() -> None:
    proof = _proof(real_cell(93).cell, [], CertificateSettings(gap=0.01, time_limit=60.0, boxes=3000))
    assert proof.infeasible
    (arm,) = [part for part in proof.arms if np.isinf(part.lower)]
    assert any(cause.kind == "obstacle" for cause, _ in excluded_shares(arm.tree))


def test_arms_that_would_stand_in_each_other_are_excluded_by_pairs() -> None:
    real = real_cell(9)
    assert real.known is not None
    place = real.known.stands[0, :3]
    arm = replace(real.cell.arms[0], base=BaseRegion(*(Interval(float(v) - 0.01, float(v) + 0.01) for v in place)))
    around = replace(real.cell.surroundings, obstacles=(), floor=None, part=None)
    twice = replace(real.cell, arms=(arm, replace(arm, name="twin")), surroundings=around, couplings=())
    proof = _proof(twice, [], CertificateSettings(0.01, 60.0, 3000))
    assert proof.infeasible
    assert all(np.isfinite(part.lower) for part in proof.arms)
    assert proof.pairs[0].apart > 0
