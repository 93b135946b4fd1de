"""How far arms may be from the one they were drawn as: bounds, held against arms at random joint values."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.pose import rotation_angle
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.difference import SAME, moved_apart
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.nominal import nominal, singular_fifth
from tests.models.kinematics.test_nominal import calibrated
from tests.support.given.arms import general_six
from tests.support.oracles.signs import joint_axes


@pytest.mark.parametrize("name", ["ur10e", "puma560", "irb120"])
@pytest.mark.parametrize("size", [1e-5, 1e-3])
def test_no_joint_values_take_the_hand_farther_from_the_drawing_than_is_told(name: str, size: float) -> None:
    loose = []
    for seed in range(8):
        robot = calibrated(name, size, size, seed)
        meant = nominal(robot)
        assert meant is not None
        form = closed_form(meant.robot)
        assert form is not None
        q = np.random.default_rng(seed).uniform(-np.pi, np.pi, (2000, 6))
        true, drawn = flange_poses(robot, q), flange_poses(meant.robot, q)
        for point, bound in ((np.zeros(3), meant.apart.position), (form.wrist_in_flange, meant.apart.wrist)):
            moved = (true[:, :3, :3] - drawn[:, :3, :3]) @ point + true[:, :3, 3] - drawn[:, :3, 3]
            worst = float(np.linalg.norm(moved, axis=1).max())
            assert worst <= bound
            loose.append(bound / worst)
        turned = float(rotation_angle(np.swapaxes(true[:, :3, :3], 1, 2) @ drawn[:, :3, :3]).max())
        assert turned <= meant.apart.angle
        loose.append(meant.apart.angle / turned)
    assert max(loose) < 8.0  # no more room than is of use


def test_an_arm_is_no_way_off_itself() -> None:
    chain = chain_of(calibrated("ur10e", 1e-3, 1e-3))
    assert moved_apart(chain, chain, np.array([0.1, 0.2, 0.3])) == (0.0, 0.0)
    assert SAME.negligible


@pytest.mark.parametrize("name", ["ur10e", "puma560"])
def test_a_calibrated_wrist_is_singular_where_its_own_axes_lie_in_one_plane(name: str) -> None:
    robot = calibrated(name, 2e-3, 1e-4, 3)
    meant, fifth = nominal(robot), singular_fifth(robot)
    assert meant is not None
    assert fifth is not None
    drawn = singular_fifth(meant.robot)
    assert drawn is not None
    assert 1e-5 < abs(fifth - drawn) <= meant.apart.fifth * (1.0 + 1e-9)
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (20, 6))
    q[:10, 4], q[10:, 4] = fifth, fifth + np.pi
    axes, _ = joint_axes(robot, q)
    volume = np.einsum("Ka,Ka->K", axes[3], np.cross(axes[4], axes[5]))
    assert np.abs(volume).max() < 1e-12


def test_robots_without_postures_have_no_singular_value_of_joint_5() -> None:
    assert singular_fifth(general_six()) is None
