import numpy as np
import pytest

from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.sqp.on_task import REACHED, brought_onto
from tests.support.given.arms import make_arm


@pytest.mark.parametrize("name", ["puma560", "ur10e"])
def test_joints_take_the_poses_in_the_posture_and_on_the_turns_that_are_near(name: str) -> None:
    arm = make_arm(name, "a")
    rng = np.random.default_rng(4)
    base = arm.base_in_world(np.array([0.3, -0.2, 0.1]), 0.4)
    taken = 0
    for _ in range(20):
        q = rng.uniform(-2.0, 2.0, arm.dof)
        flange = base @ flange_poses(arm.robot, q)[0]
        for signs in ALL_SIGNS:
            joints, missing = brought_onto(arm, signs, base, flange[None], q[None], q[None])
            if missing[0] < REACHED:
                assert np.allclose(base @ flange_poses(arm.robot, joints)[0], flange, atol=1e-7)
                taken += bool(np.allclose(joints[0], q, atol=1e-7))
    assert taken == 20  # the posture that the pose was made of, on its own turns


def test_what_is_missed_is_how_far_a_pose_is_beyond_reach() -> None:
    arm = make_arm("puma560", "a")
    q = np.array([0.3, -0.4, 0.0, 0.2, 0.7, 0.1])
    away = flange_poses(arm.robot, q)[0].copy()
    away[:3, 3] *= 5.0
    _, near = brought_onto(arm, ALL_SIGNS[0], np.eye(4), away[None], q[None], q[None])
    away[:3, 3] *= 1.0 + 0.5 / np.linalg.norm(away[:3, 3])
    _, far = brought_onto(arm, ALL_SIGNS[0], np.eye(4), away[None], q[None], q[None])
    assert near[0] > 1.0
    assert far[0] - near[0] == pytest.approx(0.5, abs=0.1)
