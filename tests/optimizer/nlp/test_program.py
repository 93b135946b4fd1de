"""Programs of cells: labels, bounds, packing; they state the problem and nothing else."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import signs_of
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.nlp.program import ArmSolution, Cuts, Program, build_program, describe, joint_bounds
from tests.support.given.arms import form_of, make_arm, region
from tests.support.given.fields import WitnessFields
from tests.support.given.tasks import Possible, possible
from tests.support.given.witness import witness_of
from tests.support.present import present


def witness(name: str, seed: int = 0, poses: int = 4, **given: Unpack[WitnessFields]) -> tuple[Possible, ArmSolution]:
    """A possible task and its witness as a point."""
    task = possible(name, np.random.default_rng(seed), poses=poses, **given)
    return task, witness_of(task)


def rows_at(program: Program, points: list[ArmSolution]) -> Floats:
    return np.array(program.structure.jacobian(program.pack(points), program.parameters)[0]).ravel()


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14", "yumi_left", "fanuc_crx10ia"])
def test_the_witness_satisfies_every_row_and_bound(name: str) -> None:
    task, point = witness(name)
    keep = point.signs is not None
    program = build_program(task.cell, [task.arm], [point], keep_shoulder=keep, steps=True)
    rows, unknowns = rows_at(program, [point]), program.pack([point])
    assert np.all(rows >= program.rows_lower - 1e-9)
    assert np.all(rows <= program.rows_upper + 1e-9)
    assert np.all(unknowns >= program.lower)
    assert np.all(unknowns <= program.upper)
    off = rows_at(program, [replace(point, position=point.position + np.array([0.0, 0.01, 0.0]))])
    assert np.abs(off).max() > 0.009


@pytest.mark.parametrize("steps", [False, True])
@pytest.mark.parametrize("cuts", [False, True])
@pytest.mark.parametrize("keep", [False, True])
def test_every_row_has_a_label_of_its_own(steps: bool, cuts: bool, keep: bool) -> None:
    task, point = witness("puma560")
    arms = [task.arm, replace(task.arm, name="other")]
    given = [Cuts(np.ones((4, 6)), np.full(4, -1.0))] * 2 if cuts else None
    program = build_program(task.cell, arms, [point, point], keep_shoulder=keep, steps=steps, cuts=given)
    labels = list(program.labels())
    rows = program.structure.rows.numel()
    assert len(labels) == len(set(labels)) == rows == len(program.rows_lower) == len(program.rows_upper)
    assert rows == 2 * (4 * (6 + keep) + 18 * steps + 4 * cuts)
    assert sum(label.startswith("other / ") for label in labels) == rows // 2
    assert "rows" in describe(program)


def test_labels_name_the_row_they_stand_for() -> None:
    """Disturbing one thing changes the rows whose labels speak of it."""
    task, point = witness("puma560")
    given = [Cuts(np.ones((4, 6)), np.full(4, -1.0))]
    program = build_program(task.cell, [task.arm], [point], keep_shoulder=True, steps=True, cuts=given)
    labels, before = np.array(list(program.labels())), rows_at(program, [point])
    joints = point.joints.copy()
    joints[2, 1] += 0.1
    changed = labels[np.abs(rows_at(program, [replace(point, joints=joints)]) - before) > 1e-6]
    name = task.arm.robot.joint_names[1]
    assert all("pose 2" in label or "pose 3" in label for label in changed)
    for wanted in (
        f"arm / {name} step to pose 2",
        f"arm / {name} step to pose 3",
        "arm / conditioning, pose 2",
        "arm / shoulder side, pose 2",
    ):
        assert wanted in changed
    lifted = replace(point, position=point.position + np.array([0.0, 0.0, 0.1]))
    assert set(labels[np.abs(rows_at(program, [lifted]) - before) > 1e-6]) == {
        f"arm / flange z, pose {j}" for j in range(4)
    }


def test_points_are_packed_and_unpacked_arm_by_arm() -> None:
    first, a = witness("puma560", 1)
    _, b = witness("iiwa14", 2)
    arms = [first.arm, make_arm("iiwa14", "second")]
    program = build_program(first.cell, arms, [a, b])
    back = program.unpack(program.pack([a, b]), [a, b])
    for point, again in zip((a, b), back, strict=True):
        assert np.array_equal(point.position, again.position)
        assert point.yaw == again.yaw
        assert np.array_equal(point.joints, again.joints)
        assert point.signs == again.signs


def test_base_region_and_joint_limits_are_the_bounds() -> None:
    task, point = witness("iiwa14")
    arm = replace(task.arm, base=region((0.1, 0.2), 0.5, (-1.0, 3.0), (2.0, 2.5)))
    program = build_program(task.cell, [arm], [point])
    assert program.lower[:4].tolist() == [0.1, 0.5, -1.0, 2.0]
    assert program.upper[:4].tolist() == [0.2, 0.5, 3.0, 2.5]
    assert np.array_equal(program.lower[4:].reshape(4, 7), np.tile(arm.lower, (4, 1)))
    assert np.array_equal(program.upper[4:].reshape(4, 7), np.tile(arm.upper, (4, 1)))
    free = build_program(task.cell, [replace(arm, base=region())], [point])
    assert (free.lower[3], free.upper[3]) == (-np.inf, np.inf)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900", "j2s6s300", "z1"])
def test_joint_bounds_keep_exactly_the_elbow_and_wrist_of_the_start(name: str) -> None:
    """Inside them the two signs are those of the start; the start is inside; limits are never widened."""
    arm = make_arm(name)
    form, rng = form_of(arm.robot), np.random.default_rng(5)
    for seed in range(8):
        _, point = witness(name, seed)
        low, high = joint_bounds(arm, point)
        assert np.all(low >= arm.lower)
        assert np.all(high <= arm.upper)
        assert np.all(point.joints >= low - 1e-12)
        assert np.all(point.joints <= high + 1e-12)
        finite = np.isfinite(low) & np.isfinite(high)
        joints = rng.uniform(np.where(finite, low, -3.0), np.where(finite, high, 3.0), (200, 6))
        signs = signs_of(form, joints)
        bend = present(point.signs)[0] * present(point.signs)[1]
        assert np.all(signs[:, 0] * signs[:, 1] == bend)
        assert np.all(signs[:, 2] == present(point.signs)[2])
        for joint in (2, 4):  # half a turn, cut by the limits
            assert high[joint] - low[joint] <= np.pi + 1e-12


def test_the_shoulder_row_has_the_side_of_the_posture() -> None:
    task, point = witness("puma560")
    for signs in ALL_SIGNS:
        program = build_program(task.cell, [task.arm], [replace(point, signs=signs)], keep_shoulder=True)
        low, high = program.rows_lower[:28].reshape(4, 7), program.rows_upper[:28].reshape(4, 7)
        assert np.all(low[:, :6] == 0.0)
        assert np.all(high[:, :6] == 0.0)
        assert set(low[:, 6]) == {0.0 if signs[0] > 0 else -np.inf}
        assert set(high[:, 6]) == {np.inf if signs[0] > 0 else 0.0}


def test_requests_of_one_shape_share_their_symbols() -> None:
    task, point = witness("puma560")
    one = build_program(task.cell, [task.arm], [point])
    other = build_program(task.cell, [replace(task.arm, name="b", weights=np.ones(6))], [point])
    assert one.structure is other.structure
    assert not np.array_equal(one.parameters, other.parameters)


def test_targets_include_grasp_and_tool() -> None:
    """The flange of an arm with tool and grasp goes where Pinocchio says it must."""
    tool, grasp = transform(rotation_z(0.4), [0.1, 0, 0.2]), transform(rotation_z(-1.0), [0, 0.3, 0])
    task, point = witness("ur5e", 3, tool=tool, grasp=grasp)
    reached = transform(rotation_z(task.yaw), task.position) @ flange_poses(task.arm.robot, task.joints) @ tool
    assert np.allclose(reached, task.cell.task.poses @ grasp, atol=1e-12)
    program = build_program(task.cell, [task.arm], [point])
    assert np.abs(rows_at(program, [point])).max() < 1e-12


def test_steps_from_segment_to_segment_have_no_bounds_and_segments_their_own_turns() -> None:
    task, point = witness("ur10e")
    segments = Task(task.cell.task.poses, (0, 2), weights=np.array([1.0, 1.0, 3.0, 0.0]))
    cell = replace(task.cell, task=segments)
    lifted = point.joints.copy()
    lifted[2:, 4] += np.where(lifted[2:, 4] > 0.0, -2.0, 2.0) * np.pi
    program = build_program(cell, [task.arm], [replace(point, joints=lifted)], steps=True)
    labels = list(program.labels())
    free = np.isinf(program.rows_upper) & np.isinf(program.rows_lower)
    assert {labels[k] for k in np.flatnonzero(free)} == {
        f"arm / {name} step to pose 2" for name in task.arm.robot.joint_names
    }
    unknowns = program.pack([replace(point, joints=lifted)])
    assert np.all(unknowns >= program.lower)
    assert np.all(unknowns <= program.upper)
    assert program.upper[4 + 4] - program.upper[4 + 12 + 4] != 0.0
    error = lifted - task.arm.reference
    wanted = np.sum(np.array([[1.0], [1.0], [3.0], [0.0]]) * task.arm.weights * error**2)
    cost = float(program.structure.gradient(unknowns, program.parameters)[0]) * program.scale
    assert cost == pytest.approx(float(wanted), rel=1e-12)
