"""Proofs of tasks whose usable bases are slivers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.trials.coupled_tasks import coupled_task
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.reduction.reduced import evaluate_signed, reduced_problem
from duocell.optimizer.settings import CertificateSettings
from tests.support.present import present


def test_what_ends_a_proof_is_found_where_usable_bases_are_slivers_and_the_known_answer_is_poor() -> None:
    """The largest joint step cuts them thin. Twenty thousand boxes were bounded in vain, too many of them at once."""
    drawn = coupled_task(9).cell
    cell = replace(drawn, arms=drawn.arms[1:], couplings=())
    problem = present(reduced_problem(cell, cell.arms[0]))
    proof = certify(problem, 22.819, CertificateSettings(1e-3, 600.0, 30_000))
    assert proof.proved
    assert proof.found is not None
    paths = evaluate_signed(problem, proof.found.position[None], np.array([proof.found.signs]))
    assert paths.violation[0, 0] <= 1e-9
    assert paths.objective[0, 0] == pytest.approx(proof.found.objective)
    assert proof.found.objective < 16.13  # the best base of a grid of 7 mm
