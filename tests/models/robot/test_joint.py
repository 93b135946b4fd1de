"""What joints do, against matrix exponentials."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import expm

from duocell.models.base.arrays import Floats
from duocell.models.robot.joint import JointKind, JointMotions, move_columns, moved_by
from duocell.models.robot.robot import Robot
from tests.support.given.linear_axis import on_linear_axis

RNG = np.random.default_rng(4)
AXES = np.array([v / np.linalg.norm(v) for v in RNG.normal(size=(4, 3))])
SHIFTS = np.array([True, False, True, False])


def exponential(shifts: bool, axis: Floats, value: float) -> Floats:
    """The motion of a joint as the exponential of its twist."""
    twist = np.zeros((4, 4))
    if shifts:
        twist[:3, 3] = axis
    else:
        twist[:3, :3] = np.cross(axis, np.eye(3)).T
    motion: Floats = expm(value * twist)
    return motion


def test_the_terms_add_up_to_the_exponential_of_the_twist() -> None:
    motions = JointMotions(SHIFTS, AXES)
    for value in RNG.uniform(-4.0, 4.0, 20):
        matrices = motions.rest + np.cos(value) * motions.cosine + np.sin(value) * motions.sine + value * motions.linear
        wanted = [exponential(shifts, axis, value) for shifts, axis in zip(SHIFTS, AXES, strict=True)]
        assert np.allclose(matrices, wanted, rtol=0.0, atol=1e-12)
        assert np.allclose(motions.rotation(1, np.array([value]))[0], wanted[1][:3, :3], rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("shifts", [True, False])
def test_frames_in_columns_move_as_their_matrices_do(shifts: bool) -> None:
    values = RNG.uniform(-3.0, 3.0, 10)
    frames = np.array([exponential(False, axis, 1.0) for axis in AXES])[np.arange(10) % 4]
    frames[:, :3, 3] = RNG.normal(size=(10, 3))
    columns, position = frames[:, :3, :3].transpose(2, 1, 0).copy(), frames[:, :3, 3].T.copy()
    position = move_columns(shifts, values, columns, position)
    wanted = frames @ np.array([exponential(shifts, np.array([0.0, 0.0, 1.0]), value) for value in values])
    assert np.allclose(columns.transpose(2, 1, 0), wanted[:, :3, :3], rtol=0.0, atol=1e-12)
    assert np.allclose(position.T, wanted[:, :3, 3], rtol=0.0, atol=1e-12)


def test_velocities_are_the_derivatives_of_the_points() -> None:
    points, step = RNG.normal(size=(4, 3)), 1e-6
    for shifts, axis, point in zip(SHIFTS, AXES, points, strict=True):
        ahead, behind = (exponential(shifts, axis, value)[:3] @ np.append(point, 1.0) for value in (step, -step))
        found = moved_by(np.array(shifts), axis, point)
        assert np.allclose(found, (ahead - behind) / (2.0 * step), rtol=0.0, atol=1e-9)


def test_values_have_a_unit() -> None:
    assert [kind.unit for kind in JointKind] == ["rad", "m"]


def test_only_the_first_joint_of_a_robot_may_shift() -> None:
    robot = on_linear_axis("ur10e")
    arrays = robot.joint_placements, robot.joint_axes, robot.flange_placement, robot.lower, robot.upper, robot.reference
    for kinds in (robot.joint_kinds[::-1], robot.joint_kinds[:-1]):
        with pytest.raises(ValueError, match=r"prismatic|kinds"):
            Robot("wrong", robot.joint_names, *arrays, joint_kinds=kinds)


def test_the_arm_on_a_linear_axis_is_a_robot_by_itself() -> None:
    robot = on_linear_axis("ur10e")
    carried = robot.carried
    assert carried is not None
    assert carried.carried is None
    assert not carried.slides
    assert carried.joint_names == robot.joint_names[1:]
    assert np.array_equal(carried.joint_placements, robot.joint_placements[1:])
