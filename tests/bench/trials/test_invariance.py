"""Images of cells: what they are made of, and a sample of the trial."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.draws.cells import real_cell
from bench.draws.images import images, moved, reversed_arms, reversed_obstacles, reversed_poses
from bench.judges.dense_check import dense_check
from bench.trials.coupled_tasks import KINDS as TIES
from bench.trials.coupled_tasks import coupled_task
from bench.trials.invariance import attempt, change, differences, summary
from duocell.models.robot.arm import Interval

STEPS = 2e-2, 0.1


@pytest.mark.parametrize("seed", range(len(TIES)))
def test_the_image_of_a_layout_is_a_layout_of_the_image(seed: int) -> None:
    """Its stands moved along, judged by the dense check; the ties hold there, and not where they are not turned."""
    task = coupled_task(seed)
    shift = np.array([3.0, -7.0, 1.0])
    for quarters in range(4):
        image = moved(task.cell, quarters, shift)
        angle = quarters * np.pi / 2.0
        turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
        stands = task.known.stands.copy()
        stands[:, :2] = stands[:, :2] @ turn.T
        stands += [*shift, angle]
        assert dense_check(image, stands, list(task.known.joints), *STEPS).clean
    back = reversed_poses(task.cell)
    assert dense_check(back, task.known.stands, [q[::-1] for q in task.known.joints], *STEPS).clean
    swapped = reversed_arms(task.cell)
    assert dense_check(swapped, task.known.stands[::-1], list(task.known.joints[::-1]), *STEPS).clean


def test_four_quarters_and_two_reversals_are_none() -> None:
    cell = next(one.cell for one in map(real_cell, range(20)) if len(one.cell.surroundings.obstacles) > 1)
    again = cell
    for _ in range(4):
        again = moved(again, 1, np.zeros(3))
    assert np.array_equal(again.task.poses, cell.task.poses)
    for one, other in zip(again.surroundings.obstacles, cell.surroundings.obstacles, strict=True):
        assert np.array_equal(one.pose, other.pose)
    for arm, first in zip(again.arms, cell.arms, strict=True):
        assert np.allclose(arm.base.bounds[:3], first.base.bounds[:3], rtol=0.0, atol=1e-12)
    assert reversed_obstacles(reversed_obstacles(cell)).surroundings.obstacles == cell.surroundings.obstacles
    assert reversed_arms(reversed_arms(cell)).arms == cell.arms
    assert np.array_equal(reversed_poses(reversed_poses(cell)).task.poses, cell.task.poses)


def test_a_bounded_yaw_turns_along_and_there_are_six_images() -> None:
    cell = coupled_task(0).cell
    bounded = replace(cell.arms[0].base, yaw=Interval(0.1, 0.5))
    cell = replace(cell, arms=(replace(cell.arms[0], base=bounded), cell.arms[1]))
    assert moved(cell, 1, np.zeros(3)).arms[0].base.yaw.low == pytest.approx(0.1 + np.pi / 2.0)
    assert len(images(cell, np.random.default_rng(0))) == 6


def test_a_sample_of_the_trial() -> None:
    record = {"seed": 0, **attempt(0)}
    assert differences(record) == []
    assert "| single | 1 | 6 | 0 | 0 | 0 |" in summary([record])


def test_differences_are_told() -> None:
    image = {"word": "feasible", "objective": 1.00001, "detail": ""}
    record = {"word": "feasible", "objective": 1.0, "images": {"shifted": image}}
    assert differences(record) == ["shifted: 1 -> 1.00001"]
    record["images"] = {"shifted": image | {"word": "unknown", "objective": None}}
    assert differences(record) == ["shifted: feasible -> unknown"]
    assert change(None, None) == 0.0
    assert change(1.0, None) == np.inf
