"""Proofs for less of a cell, from the boxes of proofs for more of it: the same as if they were begun anew."""

from __future__ import annotations

import numpy as np

from bench.conflicts.planted_conflicts import planted
from bench.draws.cells import real_cell
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.requirements import Kind, selection_of
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.infeasibility.subset_proof import SubsetProof
from duocell.optimizer.verification.scene import Scene

OBSTACLE = 6
"""Number of a planted conflict."""
LONG = 300.0
"""s worth; no test waits for it."""


def run(proof: SubsetProof) -> SubsetProof:
    proof.run(Effort(LONG, np.inf))
    return proof


def test_what_is_inherited_decides_as_a_proof_that_is_begun_anew() -> None:
    cell = real_cell(93).cell
    proof = run(SubsetProof(cell, selection_of(cell, (0,))))
    assert proof.infeasible
    for requirement in [one for one in proof.selection.requirements if one.kind in (Kind.OBSTACLE, Kind.STEP)]:
        inherited = run(proof.without([requirement]))
        anew = run(SubsetProof(cell, proof.selection.without(requirement)))
        assert inherited.infeasible == anew.infeasible
        for found in (inherited, anew):
            assert found.layout is None or clean(Scene.of(found.cell), found.layout)
        if proof.weight(requirement) == 0:
            assert inherited.infeasible
            assert inherited.trees[0].boxes == 0  # nothing had to be looked at again


def test_without_what_was_planted_a_known_layout_is_not_excluded() -> None:
    made = planted(OBSTACLE)
    proof = run(SubsetProof(made.cell, selection_of(made.cell, (0,))))
    assert proof.infeasible
    some = [one for one in proof.selection.requirements if one.kind in (Kind.OBSTACLE, Kind.SELF) and proof.weight(one)]
    assert made.requirement in some
    for requirement in some:
        smaller = proof.without([requirement])
        smaller.run(Effort(0.1, np.inf))
        assert not (smaller.infeasible and requirement == made.requirement)
        assert smaller.layout is None or clean(Scene.of(smaller.cell), smaller.layout)
