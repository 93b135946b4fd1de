"""Rows of one pose: zero where Pinocchio reaches it, large at half a turn, exact derivatives."""

from __future__ import annotations

from dataclasses import replace

import casadi as ca
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, rotation_vector, rotation_x, rotation_z, transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.branches import posture_terms
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.robot import Robot
from duocell.optimizer.nlp.pose_rows import BASE, PoseRows, hessian_pattern, pose_rows, target_numbers
from tests.support.given.arms import form_of

ROBOTS = ("puma560", "ur10e", "iiwa14", "yumi_left", "kr6_r900")
IDENTITY = np.eye(3)
TILTED = tuple(float(x) for x in (rotation_z(0.3) @ rotation_x(2.0)).ravel())


def point_of(name: str, seed: int, mount: Floats = IDENTITY) -> tuple[Robot, Floats, Floats, Floats]:
    """A base, joints, and the target they reach by Pinocchio."""
    robot, rng = catalogue.robot(name), np.random.default_rng(seed)
    base, joints = rng.uniform(-2.0, 2.0, 4), rng.uniform(-2.0, 2.0, robot.dof)
    target = transform(mount @ rotation_z(base[3]), base[:3]) @ flange_poses(robot, joints)[0]
    return robot, base, joints, target


def values(rows: PoseRows, base: Floats, joints: Floats, target: Floats) -> Floats:
    return np.array(rows.value(base, joints, target_numbers(target[None])[:, 0])).ravel()


@pytest.mark.parametrize("name", ROBOTS)
def test_rows_vanish_where_the_target_is_reached(name: str) -> None:
    for seed in range(5):
        robot, base, joints, target = point_of(name, seed)
        assert np.abs(values(pose_rows(robot, False), base, joints, target)).max() < 1e-12


def test_rows_of_a_mounted_arm_vanish_where_the_target_is_reached() -> None:
    robot, base, joints, target = point_of("ur10e", 1, np.array(TILTED).reshape(3, 3))
    assert np.abs(values(pose_rows(robot, False, TILTED), base, joints, target)).max() < 1e-12
    assert np.abs(values(pose_rows(robot, False), base, joints, target)).max() > 0.1


@pytest.mark.parametrize("name", ROBOTS)
def test_position_rows_are_metres_in_the_world(name: str) -> None:
    robot, base, joints, target = point_of(name, 2)
    off = target.copy()
    off[:3, 3] -= [0.1, -0.2, 0.3]
    assert values(pose_rows(robot, False), base, joints, off) == pytest.approx([0.1, -0.2, 0.3, 0, 0, 0], abs=1e-12)


AXES = st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda a: np.linalg.norm(a) > 0.1)


@given(AXES, st.floats(1e-3, np.pi - 0.05), st.integers(0, 5))
def test_orientation_rows_are_the_tangent_of_half_the_angle(
    axis: tuple[float, float, float], angle: float, seed: int
) -> None:
    """No root but zero, and growing without bound towards half a turn."""
    robot, base, joints, target = point_of("puma560", seed)
    turned = target.copy()
    turned[:3, :3] = rotation_about(np.array(axis) / np.linalg.norm(axis), angle) @ target[:3, :3]
    rows = values(pose_rows(robot, False), base, joints, turned)
    assert np.linalg.norm(rows[3:]) == pytest.approx(np.tan(angle / 2.0), rel=1e-9)
    error = rotation_vector(turned[:3, :3].T @ target[:3, :3])
    assert np.linalg.norm(np.cross(rows[3:], error)) < 1e-6 * np.linalg.norm(rows[3:])
    assert rows[3:] @ error > 0.0


@given(AXES, st.sampled_from([1e-7, -1e-6, 1e-4]))
def test_next_to_half_a_turn_there_is_no_root(axis: tuple[float, float, float], off: float) -> None:
    robot, base, joints, target = point_of("ur10e", 3)
    turned = target.copy()
    turned[:3, :3] = rotation_about(np.array(axis) / np.linalg.norm(axis), np.pi + off) @ target[:3, :3]
    rows = values(pose_rows(robot, False), base, joints, turned)
    assert np.linalg.norm(rows[3:]) > 1e3


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900"])
def test_the_shoulder_row_is_the_wrist_in_front_of_axis_1(name: str) -> None:
    robot, base, joints, target = point_of(name, 4)
    rows = pose_rows(robot, True)
    assert rows.size == 7
    front, _, _ = posture_terms(form_of(robot), joints, np.sin, np.cos)
    assert values(rows, base, joints, target)[6] == pytest.approx(front, abs=1e-13)


def test_an_arm_without_postures_has_no_shoulder_row() -> None:
    with pytest.raises(ValueError, match="no shoulder"):
        pose_rows(catalogue.robot("iiwa14"), True)


@pytest.mark.parametrize(
    ("name", "keep", "mount"),
    [(n, False, None) for n in ROBOTS] + [("puma560", True, None), ("ur10e", True, TILTED), ("iiwa14", False, TILTED)],
)
def test_derivatives_are_exact(name: str, keep: bool, mount: tuple[float, ...] | None) -> None:
    """Jacobian against central differences of the rows, Hessian against those of the Jacobian."""
    robot, base, joints, target = point_of(name, 5)
    joints = joints + 0.05  # off the solution
    rows = pose_rows(robot, keep) if mount is None else pose_rows(robot, keep, mount)
    numbers = target_numbers(target[None])[:, 0]
    size, n = rows.size, BASE + robot.dof
    at = np.concatenate([base, joints])
    lam = np.random.default_rng(0).normal(size=size)

    def jacobian(x: Floats) -> Floats:
        return np.array(rows.jacobian(x[:BASE], x[BASE:], numbers)).reshape(n, size).T

    def value(x: Floats) -> Floats:
        return np.array(rows.value(x[:BASE], x[BASE:], numbers)).ravel()

    steps = 1e-6 * np.eye(n)
    numeric = np.array([(value(at + h) - value(at - h)) / 2e-6 for h in steps]).T
    assert np.allclose(jacobian(at), numeric, rtol=0.0, atol=1e-7)

    entries = np.array(rows.hessian(base, joints, numbers, lam)).ravel()
    pattern = hessian_pattern(robot.dof)
    assert len(entries) == len(pattern) == len(set(pattern)) == n * (n + 1) // 2
    assert all(i <= j for i, j in pattern)
    upper = np.zeros((n, n))
    for (i, j), entry in zip(pattern, entries, strict=True):
        upper[i, j] = entry
    numeric = np.array([(lam @ jacobian(at + h) - lam @ jacobian(at - h)) / 2e-6 for h in steps])
    assert np.allclose(upper + np.triu(upper, 1).T, numeric, rtol=0.0, atol=1e-6)


def test_targets_are_columns_then_position() -> None:
    target = transform(rotation_z(0.3) @ rotation_x(0.5), [1.0, 2.0, 3.0])
    numbers = target_numbers(np.array([target, np.eye(4)]))
    assert numbers.shape == (12, 2)
    assert numbers[:, 0] == pytest.approx(np.concatenate([target[:3, 0], target[:3, 1], target[:3, 2], [1, 2, 3]]))
    assert np.array(ca.reshape(ca.DM(numbers[:9, 0]), 3, 3)) == pytest.approx(target[:3, :3])


def test_rows_are_compiled_once() -> None:
    robot = catalogue.robot("puma560")
    assert pose_rows(robot, True) is pose_rows(robot, True)
    assert pose_rows(robot, True) is not pose_rows(robot, False)
    other = replace(robot, flange_placement=transform(np.eye(3), [0, 0, 0.2]) @ robot.flange_placement)
    assert pose_rows(other, True) is not pose_rows(robot, True)
