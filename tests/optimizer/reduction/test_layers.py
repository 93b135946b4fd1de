"""Branch choice through layers against all paths tried one by one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.pose import rotation_x
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.objective.objective import JOINT_AVAILABILITY
from duocell.optimizer.reduction.layers import BEYOND, LEAP, StepLimits, _shortest, best_path, layers_at, node_costs
from tests.support.angles import TURN, wrapped
from tests.support.given.arms import make_arm
from tests.support.given.tasks import possible
from tests.support.oracles.answers import reached, turn_between


@given(st.integers(0, 10**6), st.lists(st.integers(1, 4), min_size=1, max_size=5), st.floats(0.2, 3.0))
def test_the_cheapest_path_through_random_layers_is_found(seed: int, sizes: list[int], max_step: float) -> None:
    rng = np.random.default_rng(seed)
    layers = [rng.uniform(-4.0, 4.0, (size, 3)) for size in sizes]
    costs = [rng.uniform(0.0, 10.0, size) for size in sizes]

    def total(path: Sequence[int]) -> float:
        chosen = [layer[k] for layer, k in zip(layers, path, strict=True)]
        cost = sum(float(c[k]) for c, k in zip(costs, path, strict=True))
        steps = [float(np.abs(wrapped(b - a)).max()) for a, b in pairwise(chosen)]
        return cost + sum(LEAP * max(step - max_step, 0.0) + 1e-6 * step for step in steps)

    limits = StepLimits(np.full(layers[0].shape[1], max_step), np.zeros(layers[0].shape[1], dtype=np.bool_))
    said, found = _shortest(layers, costs, limits)
    best = min(total(path) for path in product(*(range(size) for size in sizes)))
    assert len(found) == len(sizes)
    assert said == pytest.approx(best, rel=1e-9, abs=1e-9)
    assert total(found) == pytest.approx(best, rel=1e-9, abs=1e-9)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14", "gen3", "ur3e"])
@pytest.mark.parametrize("skip", [False, True])
def test_costs_of_branches_are_those_of_their_best_turns(name: str, skip: bool) -> None:
    arm = replace(make_arm(name), avoid_singularities=False)  # the rule has a cost of its own
    rng = np.random.default_rng(0)
    layer = rng.uniform(-3.0 * np.pi, 3.0 * np.pi, (200, arm.dof))
    costs = node_costs(JOINT_AVAILABILITY, arm, layer, skip)
    turned = layer[:, None] + TURN * np.arange(-6, 7)[:, None]
    inside = (turned >= arm.lower) & (turned <= arm.upper)
    each = np.where(inside, arm.weights * (turned - arm.reference) ** 2, np.inf).min(axis=1)
    gap = np.maximum(np.maximum(arm.lower - turned, turned - arm.upper), 0.0).min(axis=1)
    if skip:
        each, gap = each[:, 1:], gap[:, 1:]
    possible_ = np.isfinite(each).all(axis=1)
    assert possible_.any()
    assert costs[possible_] == pytest.approx(each[possible_].sum(axis=1), rel=1e-9, abs=1e-9)
    assert np.all(costs[~possible_] >= BEYOND * gap[~possible_].sum(axis=1) * (1.0 - 1e-9))


@pytest.mark.parametrize("name", ["iiwa14", "franka_panda", "fanuc_crx10ia", "yumi_left", "jaco2", "ur5e"])
def test_paths_from_the_base_of_the_witness_reach_every_pose(name: str) -> None:
    task = possible(name, np.random.default_rng(4), poses=4, step=0.05)
    path = best_path(task.cell, task.arm, task.position, task.yaw)
    assert path.unreached == ()
    assert path.joints.shape == task.joints.shape
    for pose, q in zip(task.cell.task.poses, path.joints, strict=True):
        have = reached(task.arm, path.position, path.yaw, q)
        assert np.linalg.norm(have[:3, 3] - pose[:3, 3]) < 1e-5
        assert turn_between(have, pose) < 1e-5
    arm = task.arm
    assert path.objective == pytest.approx(np.sum(arm.weights * (path.joints - arm.reference) ** 2))
    out = np.maximum(arm.lower - path.joints.min(0), 0) + np.maximum(path.joints.max(0) - arm.upper, 0)
    step = np.abs(np.diff(path.joints, axis=0)).max()
    assert path.violation == pytest.approx(out.sum() + max(step - task.cell.max_joint_step, 0.0), abs=1e-9)
    if arm.dof == 6:  # all branches are known, so the witness cannot be missed
        assert path.violation < 1e-9
        witness = np.sum(arm.weights * (task.joints - arm.reference) ** 2)
        assert path.objective <= witness + 1e-6


def test_paths_of_mounted_arms_stand_where_they_say() -> None:
    task = possible("iiwa14", np.random.default_rng(5), poses=3, step=0.05, mount=rotation_x(2.2))
    path = best_path(task.cell, task.arm, task.position, task.yaw)
    for pose, q in zip(task.cell.task.poses, path.joints, strict=True):
        assert np.abs(reached(task.arm, path.position, path.yaw, q) - pose).max() < 1e-5


def test_poses_out_of_reach_are_named() -> None:
    task = possible("iiwa14", np.random.default_rng(6), poses=4)
    poses = task.cell.task.poses.copy()
    poses[[1, 3], 2, 3] += 20.0
    cell = replace(task.cell, task=replace(task.cell.task, poses=poses))
    path = best_path(cell, task.arm, task.position, task.yaw)
    assert path.unreached == (1, 3)
    assert path.violation == np.inf
    assert path.joints.shape == (0, 7)


def test_layers_are_branches_of_the_chosen_poses() -> None:
    task = possible("ur5e", np.random.default_rng(7), poses=5)
    layers = layers_at(task.cell, task.arm, task.position, task.yaw, np.array([0.0, 4.0]))
    assert len(layers) == 2
    for j, layer in zip((0, 4), layers, strict=True):
        assert np.abs(wrapped(layer - task.joints[j])).max(axis=1).min() < 1e-6
        flanges = flange_poses(task.arm.robot, layer)
        assert np.abs(flanges - flange_poses(task.arm.robot, task.joints[j])).max() < 1e-6
