"""The trial of calibrated arms: its tasks are what they should be, its verdicts too, and a few of them are tried."""

from __future__ import annotations

import numpy as np
import pytest

from bench.trials.calibrated_arms import attempt, fault_of, own_best, planted
from duocell.models.kinematics.nominal import nominal
from duocell.optimizer.nlp.measure import objective_of
from duocell.optimizer.verification.verify import check


@pytest.mark.parametrize("seed", [1, 4, 6])
def test_what_is_planted_is_usable_on_the_true_arm(seed: int) -> None:
    task = planted(seed)
    assert check(task.cell, task.arm, task.point).usable
    assert nominal(task.arm.robot) is not None
    cost = objective_of(task.cell, task.arm, task.point.joints)
    assert own_best(task, [task.point]) <= cost * (1.0 + 1e-9)


def test_what_is_spoilt_is_not_usable_as_it_was() -> None:
    task = planted(2)
    assert task.spoilt
    assert not check(task.cell, task.arm, task.point).usable


def test_bounds_that_are_beaten_and_wrong_refusals_are_faults() -> None:
    right = {"word": "feasible", "objective": 2.0, "lower": 1.9, "known": 2.0, "spoilt": False, "detail": ""}
    assert fault_of(right) == ""
    assert "lower bound" in fault_of(right | {"known": 1.8})
    assert "infeasible" in fault_of(right | {"word": "infeasible", "objective": None, "lower": None})
    assert (
        fault_of(right | {"word": "infeasible", "objective": None, "lower": None, "known": None, "spoilt": True}) == ""
    )
    assert "error" in fault_of(right | {"word": "error"})


@pytest.mark.parametrize("seed", [3, 5])
def test_a_few_of_its_tasks(seed: int) -> None:
    record = attempt(seed)
    assert record["fault"] == ""
    assert record["drawn"]
    assert record["lower"] is not None or record["word"] == "infeasible"
    assert record["known"] is None or np.isfinite(record["known"])
