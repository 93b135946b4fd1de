"""How joints follow a moving base: derivatives against exact inverse kinematics."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.kinematics.kinematics import flange_poses
from duocell.optimizer.clearance.path_samples import follow
from duocell.optimizer.sqp.sensitivity import joints_by_base
from tests.support.given.arms import make_arm, random_joints

STEP = 1e-5


@pytest.mark.parametrize("mount", [np.eye(3), rotation_x(np.pi), rotation_x(0.6)], ids=["floor", "ceiling", "slope"])
@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900", "fanuc_crx10ia"])
def test_joints_follow_the_base_as_inverse_kinematics_say(name: str, mount: Floats) -> None:
    arm = make_arm(name)
    q = random_joints(arm, 20, np.random.default_rng(4), 0.3)
    place = np.array([0.2, -0.3, 0.4, 0.7])

    def base_at(p: Floats) -> Floats:
        return transform(mount @ rotation_z(p[3]), p[:3])

    flanges = base_at(place) @ flange_poses(arm.robot, q)
    slopes = joints_by_base(arm.robot, base_at(place)[:3, :3], q)
    for axis in range(4):
        moved = [place + sign * STEP * np.eye(4)[axis] for sign in (1.0, -1.0)]
        (plus, good), (minus, fine) = (follow(arm.robot, base_at(p), flanges, q, q) for p in moved)
        regular = good & fine & (np.max(np.abs(slopes), axis=(1, 2)) < 50.0)
        assert np.sum(regular) > 10
        expected = (plus - minus) / (2.0 * STEP)
        assert np.allclose(slopes[regular, :, axis], expected[regular], rtol=1e-3, atol=1e-3)


def test_redundant_arms_move_as_little_as_possible() -> None:
    arm = make_arm("iiwa14")
    q = random_joints(arm, 10, np.random.default_rng(5), 0.3)
    slopes = joints_by_base(arm.robot, np.eye(3), q)
    q, slopes = (rows[np.max(np.abs(slopes), axis=(1, 2)) < 30.0] for rows in (q, slopes))  # not nearly singular
    assert len(q) > 5
    flanges = flange_poses(arm.robot, q)
    for axis in range(4):
        step = STEP * np.eye(4)[axis]
        moved = transform(rotation_z(step[3]), step[:3]) @ flange_poses(arm.robot, q + slopes[..., axis] * STEP)
        assert np.abs(moved - flanges).max() < 1e-3 * STEP
