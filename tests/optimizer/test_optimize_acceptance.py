"""The acceptance cases: certified values per arm, and everything a user reads about their layouts."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from duocell.models.robot.posture import ELBOW, SHOULDER, WRIST
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Outcome
from tests.support.given.acceptance import CASES, load
from tests.support.oracles.answers import assert_sound, reached, turn_between
from tests.support.present import present

NAMES = CASES


@cache
def solved(name: str) -> Layout:
    return optimize(load(name)[0])


@pytest.mark.parametrize("name", NAMES)
def test_every_arm_is_between_its_proved_bound_and_the_best_known_value(name: str) -> None:
    layout = solved(name)
    _, expected = load(name)
    assert layout.outcome is Outcome.OPTIMAL
    assert [p.arm for p in layout.placements] == [arm["arm"] for arm in expected["arms"]]
    for placement, known in zip(layout.placements, expected["arms"], strict=True):
        assert placement.objective >= known["lower_bound"]
        assert placement.objective <= 1.001 * known["best_known"]
    assert layout.objective == pytest.approx(sum(p.objective for p in layout.placements), rel=1e-12)
    assert layout.objective <= 1.001 * expected["best_known"]


@pytest.mark.parametrize("name", NAMES)
def test_the_optimum_is_the_known_one(name: str) -> None:
    """Same posture, named (s, s·e, f) there, and the same place to what the certified search resolves."""
    layout = solved(name)
    _, expected = load(name)
    for placement, known in zip(layout.placements, expected["arms"], strict=True):
        s = SHOULDER[present(placement.posture)["shoulder"]]
        e, f = ELBOW[present(placement.posture)["elbow"]], WRIST[present(placement.posture)["wrist"]]
        assert [s, s * e, f] == known["posture"]
        assert placement.position[:2] == pytest.approx([known["x"], known["y"]], abs=5e-3)
        assert placement.yaw == pytest.approx(known["yaw"], abs=0.02)
        step = np.abs(np.diff(placement.joints, axis=0)).max()
        assert step == pytest.approx(known["max_step"], abs=0.02)


@pytest.mark.parametrize("name", NAMES)
def test_figures_are_sound(name: str) -> None:
    layout = solved(name)
    assert_sound(load(name)[0], layout)


@pytest.mark.parametrize("name", NAMES)
def test_no_step_hides_a_turn(name: str) -> None:
    """Halfway between the joints of two poses the tool is about halfway between the poses."""
    cell, _ = load(name)
    for arm, placement in zip(cell.arms, solved(name).placements, strict=True):
        targets = cell.task.poses @ arm.grasp
        for j in range(len(targets) - 1):
            half = reached(arm, placement.position, placement.yaw, placement.joints[j : j + 2].mean(axis=0))
            middle = targets[j : j + 2, :3, 3].mean(axis=0)
            assert np.linalg.norm(half[:3, 3] - middle) < 0.06
            whole = turn_between(targets[j], targets[j + 1])
            for end in (targets[j], targets[j + 1]):
                assert turn_between(half, end) < 0.5 * whole + 0.15
