"""Recombined paths: the cheapest one through the layers, on the task, and other turns where they are better."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np
import pytest

from duocell.models.robot.arm import TURN
from duocell.optimizer.parameters.unreduced import PARAMETERS
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.single_arm.redundant.ranking import figures
from duocell.optimizer.single_arm.redundant.recombination import (
    LEAP_PENALTY,
    _Layer,
    _shortest,
    distinct_bases,
    recombined,
)
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, unreduced_problem
from tests.support.given.tasks import possible


def test_the_path_is_the_cheapest_of_all() -> None:
    rng, endless, allowed = np.random.default_rng(1), np.array([False, True]), 0.4
    layers = [_Layer(rng.uniform(-4.0, 4.0, (2, 4)), rng.uniform(0.0, 300.0, 4)) for _ in range(4)]

    def cost(choice: Sequence[int]) -> float:
        total = sum(float(layer.costs[k]) for layer, k in zip(layers, choice, strict=True))
        for j in range(3):
            step = layers[j].joints[:, choice[j]] - layers[j + 1].joints[:, choice[j + 1]]
            step[1] -= TURN * np.round(step[1] / TURN)
            total += LEAP_PENALTY * max(float(np.max(np.abs(step))) - allowed, 0.0)
        return total

    best = min(product(range(4), repeat=4), key=cost)
    wanted = [layer.joints[:, k] for layer, k in zip(layers, best, strict=True)]
    assert np.array_equal(_shortest(layers, endless, allowed), wanted)


@pytest.mark.parametrize("name", ["xarm7", "gen3"])
def test_a_path_is_found_among_the_postures_of_a_poor_pool(name: str) -> None:
    task = possible(name, np.random.default_rng(2), poses=4, step=0.05)
    problem = unreduced_problem(task.cell, task.arm, search_box(task.cell, task.arm))
    base = np.array([[*(task.position - problem.origin), task.yaw]])
    noise = np.random.default_rng(3).normal(0.0, 0.3, (problem.dof, 4, 5))
    pool = Seeds(task.joints.T[:, :, None] + noise, np.repeat(base, 5, axis=0))
    path = recombined(problem, base, pool, PARAMETERS, 0)
    found = figures(problem, path)
    assert found.error[0] < 2e-2
    assert found.step[0] < 1.3 * problem.max_step
    assert found.over[0] < 1e-2


def test_bases_are_apart() -> None:
    bases = np.array([[0.0, 0, 0, 0], [0.01, 0, 0, 1], [0.5, 0, 0, 0], [0.0, 0.4, 0, 0], [1.0, 0, 0, 0]])
    assert list(distinct_bases(bases, 3, 0.03)) == [0, 2, 3]
