"""Optima in a singular minimum, which no spread of points sees: held against branch and bound."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.draws.random_tasks import random_cell
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.straight_wrist import can_be_straight, straight_wrists
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.optimizer.single_arm.search import search_arm
from tests.support.given.arms import form_of, make_arm, random_joints
from tests.support.present import present


@pytest.mark.parametrize("seed", [0, 1])
def test_the_follower_of_random_19_stands_at_the_tip_of_its_notch(seed: int) -> None:
    cell = random_cell(19)
    arm = replace(cell.arms[1], avoid_singularities=False)  # its tip is at the singularity itself
    search = search_arm(cell, arm, Settings(seed=seed), np.inf)
    proof = certify(
        present(reduced_problem(cell, arm)), search.objective, CertificateSettings(gap=1e-3, time_limit=20.0)
    )
    assert proof.found is None
    assert search.objective == pytest.approx(29.7922, rel=1e-5)
    assert present(proof.lower_bound) <= present(search.objective)


@pytest.mark.parametrize("name", ["puma560", "kr6_r900", "irb120"])
def test_straight_wrists_are_found_where_they_were_made(name: str) -> None:
    arm = make_arm(name)
    form = form_of(arm.robot)
    assert can_be_straight(form)
    assert chain_of(arm.robot).vertical_sign
    q = random_joints(arm, 20, np.random.default_rng(5), 0.1)
    q[:, 4] = form.wrist_zero
    flange = flange_poses(arm.robot, q)
    wrist = flange[:, :3, 3] + flange[:, :3, :3] @ form.wrist_in_flange - form.origin
    tool_axis = flange[:, :3, :3] @ (form.home_rotation.T @ form.axes[5])
    ways = straight_wrists(form, tool_axis, (wrist @ form.axes[0])[:, None])
    # seen from a base whose yaw is free: one of the eight ways is as far from axis 1 as the wrist that was made
    radial = wrist - (wrist @ form.axes[0])[:, None] * form.axes[0]
    found = ways.wrist[:, :, 0] - (ways.wrist[:, :, 0] @ form.axes[0])[..., None] * form.axes[0]
    distances = np.where(ways.shoulder[:, :, 0] != 0, np.linalg.norm(found, axis=-1), np.inf)
    assert np.min(np.abs(distances - np.linalg.norm(radial, axis=-1)), axis=0).max() < 1e-9
