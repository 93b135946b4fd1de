"""Random tasks of one arm: the same for a seed, possible, and judged by what is independent of the answer."""

from __future__ import annotations

import numpy as np
import pytest

from bench.random_arms.draw import KINDS, draw
from bench.random_arms.judge import Known, Trial
from bench.random_arms.long_search import long_search
from bench.random_arms.table import table
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.settings import CertificateSettings
from tests.support.present import present


@pytest.mark.parametrize("kind", KINDS)
def test_a_draw_depends_on_kind_and_seed_alone(kind: str) -> None:
    one, again, other = draw(kind, 3), draw(kind, 3), draw(kind, 4)
    assert np.array_equal(one.task.poses, again.task.poses)
    assert np.array_equal(one.arms[0].base.bounds, again.arms[0].base.bounds)
    assert one.arms[0].robot.name == again.arms[0].robot.name
    assert not np.array_equal(one.task.poses, other.task.poses)
    assert (kind == "dwell") == (len(one.task) > 100)
    assert (one.arms[0].min_conditioning is not None) == (kind in ("conditioning", "way-points"))


def test_the_long_search_agrees_with_the_proof() -> None:
    cell = draw("random", 0)
    problem = present(reduced_problem(cell, cell.arms[0]))
    proof = certify(problem, None, CertificateSettings(gap=1e-3, time_limit=60.0))
    found = long_search(problem, search_box(cell, cell.arms[0]), 0, 1)
    assert proof.proved
    assert present(proof.lower_bound) <= found <= (1.0 + 1e-3) * present(proof.objective)


def test_the_table_tells_misses_from_refusals() -> None:
    known = Known(10.0, 9.99, False, "proof")
    trials = [
        Trial("thin", k, "ur10e", objective, False, 0.1, 2, known) for k, objective in enumerate((10.0, 11.0, None))
    ]
    assert [trial.missed for trial in trials] == [False, True, False]
    assert [trial.refused for trial in trials] == [False, False, True]
    assert "1 [('t', 1)] | 1.1 x | 1 |" in table(trials)
    assert Trial.of(trials[1].record) == trials[1]
