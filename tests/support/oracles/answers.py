"""An independent look at a layout: every figure a user reads, computed again from the joints and the placement."""

from __future__ import annotations

import numpy as np
import pinocchio as pin
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.kinematics import FLANGE, pinocchio_model
from duocell.models.objective.objective import JOINT_AVAILABILITY
from duocell.models.robot.arm import Arm
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Outcome
from duocell.optimizer.results.placement import Placement
from tests.support.oracles.signs import axis_signs


def flange(arm: Arm, joints: Floats) -> Floats:
    """(4, 4) flange in the base frame by Pinocchio."""
    model = pinocchio_model(arm.robot)
    data = model.createData()
    pin.framesForwardKinematics(model, data, np.asarray(joints, dtype=float))
    placed: Floats = data.oMf[model.getFrameId(FLANGE)].homogeneous.copy()
    return placed


def reached(arm: Arm, position: Floats, yaw: float, joints: Floats) -> Floats:
    """(4, 4) tool centre point in the world."""
    turn = np.array([[np.cos(yaw), -np.sin(yaw), 0.0], [np.sin(yaw), np.cos(yaw), 0.0], [0.0, 0.0, 1.0]])
    base = np.eye(4)
    base[:3, :3], base[:3, 3] = arm.mount @ turn, position
    tool: Floats = base @ flange(arm, joints) @ arm.tool
    return tool


def turn_between(first: Floats, second: Floats) -> float:
    """Angle [rad] between two orientations."""
    return float(np.linalg.norm(pin.log3(first[:3, :3].T @ second[:3, :3])))


def conditioning_by_differences(arm: Arm, joints: Floats, length: float) -> float:
    """σmin/σmax of a Jacobian from central differences of the tool's pose."""
    step, columns = 1e-5, []
    for unit in np.eye(arm.dof):
        ahead, behind = (flange(arm, joints + sign * step * unit) @ arm.tool for sign in (1, -1))
        angular = pin.log3(ahead[:3, :3] @ behind[:3, :3].T)
        columns.append(np.concatenate([(ahead[:3, 3] - behind[:3, 3]) / length, angular]) / (2.0 * step))
    sigma = np.linalg.svd(np.array(columns).T, compute_uv=False)
    return float(sigma[-1] / sigma[0])


def assert_sound(cell: Cell, layout: Layout) -> None:
    """Every figure of a layout with a placement for each arm."""
    assert layout.outcome in ("optimal", "feasible")
    assert [p.arm for p in layout.placements] == [arm.name for arm in cell.arms]
    assert layout.reasons == ()
    worst = [assert_placed(cell, arm, p) for arm, p in zip(cell.arms, layout.placements, strict=True)]
    assert layout.objective == pytest.approx(sum(p.objective for p in layout.placements), rel=1e-12)
    assert [(segment.first_pose, segment.poses) for segment in layout.segments] == [
        (j.start, j.stop - j.start) for j in cell.task.segments
    ]
    assert [segment.name for segment in layout.segments] == list(cell.task.names)
    shares = [segment.objective for segment in layout.segments if segment.objective is not None]
    assert len(shares) == len(layout.segments)
    assert layout.objective == pytest.approx(sum(shares), rel=1e-12)
    check = layout.verification
    assert check is not None
    assert check.limits_respected
    for said, (k, seen) in zip(
        (check.max_position_error, check.max_orientation_error, check.max_joint_step),
        enumerate(zip(*worst, strict=True)),
        strict=True,
    ):
        assert said == pytest.approx(max(seen), abs=1e-8 if k < 2 else 1e-12)
    assert layout.search.candidates > 0
    assert layout.search.starts > 0
    assert layout.search.basins > 0
    assert layout.search.wall_time > 0.0


def assert_placed(cell: Cell, arm: Arm, placement: Placement) -> tuple[float, float, float]:
    """One arm's figures; returns its errors of position and orientation and its largest step."""
    joints = placement.joints
    assert joints.shape == (len(cell.task), arm.dof)
    away = turned = 0.0
    for pose, grasp, q in zip(cell.task.poses, cell.grasps(arm), joints, strict=True):
        have, want = reached(arm, placement.position, placement.yaw, q), pose @ grasp
        away = max(away, float(np.linalg.norm(have[:3, 3] - want[:3, 3])))
        turned = max(turned, turn_between(want, have))
    assert away <= 1e-6
    assert turned <= 1e-6
    assert np.all(joints >= arm.lower - 1e-9)
    assert np.all(joints <= arm.upper + 1e-9)
    place = np.array([*placement.position, placement.yaw])
    assert np.all(place >= arm.base.bounds[:, 0] - 1e-9)
    assert np.all(place <= arm.base.bounds[:, 1] + 1e-9)
    step = max(float(np.max(np.abs(np.diff(joints[segment], axis=0)), initial=0.0)) for segment in cell.task.segments)
    assert step <= cell.max_joint_step + 1e-9
    cost = float(np.sum(cell.task.weights @ (arm.weights * (joints - arm.reference) ** 2)))
    if cell.objective == JOINT_AVAILABILITY:  # of others their own tests say what they are
        assert placement.objective == pytest.approx(cost, rel=1e-9)
    margins = np.minimum(joints - arm.lower, arm.upper - joints).min(axis=0)
    assert placement.joint_margins == pytest.approx(margins, abs=1e-12)
    assert placement.minimum_margin == pytest.approx(margins.min(), abs=1e-12)
    _assert_conditioning(arm, placement)
    _assert_posture(arm, placement)
    return away, turned, step


def _assert_conditioning(arm: Arm, placement: Placement) -> None:
    length = placement.characteristic_length
    assert length > 0.0
    some = placement.joints[:: max(1, len(placement.joints) // 12)]
    seen = [conditioning_by_differences(arm, q, length) for q in some]
    assert placement.minimum_conditioning <= min(seen) + 1e-6
    if len(some) == len(placement.joints):
        assert placement.minimum_conditioning == pytest.approx(min(seen), abs=1e-6)
    if arm.min_conditioning is not None:
        assert placement.minimum_conditioning >= arm.min_conditioning - 1e-9


def _assert_posture(arm: Arm, placement: Placement) -> None:
    """One posture all the way, by the joint axes themselves; a sign may touch zero."""
    signs = axis_signs(arm.robot, placement.joints)
    assert (placement.posture is None) == (signs is None)
    if signs is None:
        return
    names = {"shoulder": ("left", "right"), "elbow": ("up", "down"), "wrist": ("flip", "noflip")}
    assert placement.posture is not None
    assert set(placement.posture) == set(names) == set(placement.singularity_distances)
    for key, (name, words) in enumerate(names.items()):
        assert placement.posture[name] in words
        if placement.singularity_distances[name] > 1e-6:
            assert len(set(signs[:, key])) == 1, f"{name} changes side"
    wanted = {
        "shoulder": {1: "left", -1: "right"},
        "elbow": {1: "down", -1: "up"},
        "wrist": {1: "noflip", -1: "flip"},
    }
    for name, word in wanted.items():
        asked = getattr(arm.posture, name)
        if asked is not None:
            assert placement.posture[name] == word[asked]


def assert_ended(layout: Layout) -> None:
    """A search that found a layout and was cut by no limit; the word follows from the certificate alone."""
    assert layout.usable, [reason.detail for reason in layout.reasons]
    assert layout.search.ended
    assert layout.search.first_feasible_time is not None
    assert layout.search.first_feasible_time > 0.0
    certificate = layout.certificate
    proved = certificate is not None and certificate.gap is not None and certificate.gap <= certificate.wanted
    assert layout.outcome is (Outcome.OPTIMAL if proved else Outcome.FEASIBLE)
    assert layout.proved == proved


def solved(cell: Cell) -> Layout:
    """The layout of a cell, of a search that ended, and sound."""
    layout = optimize(cell)
    assert_ended(layout)
    assert_sound(cell, layout)
    return layout
