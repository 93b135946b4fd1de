"""Pinocchio side of a robot: poses, Jacobians, conditioning and reach.

Pinocchio has no type information; everything untyped about it stays in this file.
Models are cached by the geometry alone (`Robot.kinematic_key`), so a catalogue arm and its copy with other limits share
one. Frames: poses and Jacobians are expressed in the robot's base frame.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import Any

import numpy as np
import pinocchio as pin

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.pose import transform
from duocell.models.robot.joint import JointMotions
from duocell.models.robot.robot import KinematicKey, Robot

FLANGE = "flange"
"""Name of the flange frame in every model."""


def pinocchio_model(robot: Robot) -> Any:
    """The ``pin.Model`` of a robot: a revolute or prismatic joint for each, configuration space R^n, a frame `FLANGE`.

    Endless joints are ordinary revolute ones too: their values stay plain angles, whatever the number of turns.
    Limits are not copied, they belong to the arm in its cell. Treat the model as read-only, it is shared.
    """
    return _model(robot.kinematic_key)


@lru_cache(maxsize=256)
def _model(key: KinematicKey) -> Any:
    placements, axes, prismatic, flange = _geometry(key)
    model = pin.Model()
    parent = 0
    for index, (placement, axis, shifts) in enumerate(zip(placements, axes, prismatic, strict=True)):
        joint = pin.JointModelPrismaticUnaligned(axis) if shifts else pin.JointModelRevoluteUnaligned(axis)
        parent = model.addJoint(parent, joint, pin.SE3(placement), f"joint_{index + 1}")
    model.addFrame(pin.Frame(FLANGE, parent, pin.SE3(flange), pin.FrameType.OP_FRAME))
    return model


def _geometry(key: KinematicKey) -> tuple[Floats, Floats, Bools, Floats]:
    """The arrays behind a kinematic key: placements (n, 4, 4), axes (n, 3), which joints shift (n,), flange (4, 4)."""
    placements, axes, flange = (np.frombuffer(key[part], dtype=np.float64) for part in (0, 1, 3))
    prismatic = np.frombuffer(key[2], dtype=np.bool_)
    return placements.reshape(-1, 4, 4), axes.reshape(-1, 3), prismatic, flange.reshape(4, 4)


def chain(model: Any, joints: Iterable[int]) -> tuple[Floats, Floats]:
    """Placements and axes of some joints of any ``pin.Model``, as Pinocchio holds them.

    Args:
        model: built by `pinocchio_model` or read from a URDF.
        joints: k indices, all of them revolute or prismatic.

    Returns:
        (k, 4, 4) ``jointPlacements``, each in the frame of its parent joint, and (k, 3) unit axes in the joint frame.
    """
    indices = list(joints)
    placements: Floats = np.array([model.jointPlacements[index].homogeneous for index in indices]).reshape(-1, 4, 4)
    axes: Floats = np.array([_axis(model, index) for index in indices]).reshape(-1, 3)
    return placements, axes


def _axis(model: Any, index: int) -> Any:
    """Axis of a joint: the angular part of its motion subspace, or the linear one of a joint that only shifts."""
    joint = model.joints[index]
    data = joint.createData()
    joint.calc(data, pin.neutral(model), np.zeros(model.nv))
    return data.S[3:] if np.any(data.S[3:]) else data.S[:3]


def flange_placement(model: Any) -> Floats:
    """(4, 4) flange in the last joint frame of a model built by `pinocchio_model`."""
    placement: Floats = model.frames[model.getFrameId(FLANGE)].placement.homogeneous
    return placement


def _each(robot: Robot, q: Floats) -> Floats:
    """``q`` as (k, n), checked."""
    rows = np.atleast_2d(np.asarray(q, dtype=np.float64))
    if rows.ndim != 2 or rows.shape[1] != robot.dof:
        raise ValueError(f"expected joint values of shape (k, {robot.dof}), got {np.shape(q)}")
    return rows


def flange_poses(robot: Robot, q: Floats) -> Floats:
    """Flange in the base frame, by Pinocchio.

    Args:
        robot: the chain.
        q: (k, n) rad or m; one row (n,) counts as k = 1.

    Returns:
        (k, 4, 4).
    """
    rows = _each(robot, q)
    model = pinocchio_model(robot)
    data = model.createData()  # one per call: models are shared between threads, data must not be
    frame = model.getFrameId(FLANGE)
    poses: Floats = np.empty((len(rows), 4, 4))
    for pose, row in zip(poses, rows, strict=True):
        pin.framesForwardKinematics(model, data, row)
        pose[...] = data.oMf[frame].homogeneous
    return poses


def jacobians(robot: Robot, q: Floats, tool: Floats) -> Floats:
    """Jacobians of the tool centre point, in axes parallel to the base frame, linear rows first.

    ``J q̇`` is the velocity of the TCP [m/s] over the angular velocity of the tool [rad/s], for joint speeds in rad/s or
    m/s.

    Args:
        robot: the chain.
        q: (k, n) rad or m; one row (n,) counts as k = 1.
        tool: (4, 4) TCP in the flange frame.

    Returns:
        (k, 6, n).
    """
    rows = _each(robot, q)
    model = pinocchio_model(robot)
    data = model.createData()
    frame = model.getFrameId(FLANGE)
    aligned = pin.ReferenceFrame.LOCAL_WORLD_ALIGNED
    result: Floats = np.empty((len(rows), 6, robot.dof))
    arms: Floats = np.empty((len(rows), 3))  # flange origin to TCP, in base axes
    for jacobian, arm, row in zip(result, arms, rows, strict=True):
        jacobian[...] = pin.computeFrameJacobian(model, data, row, frame, aligned)
        pin.updateFramePlacement(model, data, frame)
        arm[...] = data.oMf[frame].rotation @ tool[:3, 3]
    # v_tcp = v_flange + ω × r
    result[:, :3] += np.cross(result[:, 3:], arms[:, :, None], axis=1)
    return result


def conditioning(robot: Robot, tool: Floats, q: Floats, length: float) -> Floats:
    """Reciprocal condition numbers σmin/σmax of the Jacobians `without_units`.

    0 at a singularity, 1 for an isotropic posture (section 2 of the source: "reciprocal condition").

    Args:
        robot: the chain, at least 6 joints for anything but the conditioning of a thinner Jacobian.
        tool: (4, 4) TCP in the flange frame.
        q: (k, n) rad or m.
        length: m, see `characteristic_length`.

    Returns:
        (k,) in [0, 1].
    """
    jacobian = without_units(jacobians(robot, q, tool), robot.prismatic, length)
    sigma = np.linalg.svd(jacobian, compute_uv=False)
    result: Floats = sigma[:, -1] / sigma[:, 0]
    return result


def without_units(jacobian: Floats, prismatic: Bools, length: float) -> Floats:
    """Jacobians (..., 6, n), changed in place, whose entries are pure numbers.

    Linear rows are divided by ``length`` [m]. A turn counts what it does per radian, a shift what it does per
    ``length``: its column is the unit vector along its axis.
    """
    jacobian[..., :3, :] /= length
    if np.any(prismatic):
        jacobian[..., prismatic] *= length
    return jacobian


def characteristic_length(robot: Robot) -> float:
    """The length [m] that makes linear and angular halves of the Jacobian equally large, averaged over all postures.

    A revolute joint contributes 1 to the squared Frobenius norm of the angular half and the squared distance d_i² of
    the flange origin from its axis to that of the linear half. So ``L² = mean over i of E[d_i²]``, every joint turning
    uniformly through the full circle. A property of the robot alone: neither tool nor limits nor posture enter, so
    conditioning numbers of one robot are comparable between layouts. A linear axis under an arm does not count: the
    length is that of the arm.
    """
    return _characteristic_length(robot.kinematic_key)


@lru_cache(maxsize=256)
def _characteristic_length(key: KinematicKey) -> float:
    placements, axes, prismatic, flange = _geometry(key)
    motions = JointMotions(prismatic, axes)
    # Second moment E[h hᵀ] of the homogeneous flange origin h = (p, 1), walked from the flange to the base.
    moment = np.outer(flange[:, 3], flange[:, 3])
    squares = []
    # three angles average second-degree trigonometric polynomials exactly
    third: Floats = np.array([0.0, 1.0, 2.0])
    third *= 2.0 * np.pi / 3.0
    for i in range(len(axes) - 1, -1, -1):
        axis = axes[i]
        if prismatic[i]:
            break  # the first joint: nothing behind it turns
        squares.append(np.trace(moment[:3, :3]) - axis @ moment[:3, :3] @ axis)
        turns = placements[i] @ transform(motions.rotation(i, third), np.zeros(3))
        moment = np.mean(turns @ moment @ np.swapaxes(turns, -1, -2), axis=0)
    return float(np.sqrt(np.mean(squares)))


Travel = tuple[float, float]
"""m, least and largest value of the linear axis that carries an arm."""


def reach(robot: Robot, travel: Travel | None = None) -> float:
    """An upper bound [m] of the distance of the flange origin from the base origin, whatever the joint values.

    Every chain of points, one on each joint axis, bounds the reach by the sum of its links (joints cannot change the
    distance between points on neighbouring axes); the points are slid along the axes to make that sum small. Sound, and
    a few percent above the true extreme for common arms: beyond it a pose is certainly out of reach, inside it is not
    promised. An arm on a linear axis reaches as far from where the axis can take it.

    Args:
        robot: the chain. travel: of its linear axis, where that may go farther than the robot's own limits let it.
    """
    if robot.carried is None:
        return _reach(robot.kinematic_key)[0]
    farthest = float(np.max(np.linalg.norm(carriage_ends(robot, travel), axis=1)))
    return farthest + _reach(robot.carried.kinematic_key)[0]


def carriage_ends(robot: Robot, travel: Travel | None = None) -> Floats:
    """(2, 3) m, where the linear axis of a robot has the origin of its carriage at both ends, in the base frame."""
    low, high = (float(robot.lower[0]), float(robot.upper[0])) if travel is None else travel
    placement = robot.joint_placements[0]
    ends: Floats = placement[:3, 3] + np.outer([low, high], placement[:3, :3] @ robot.joint_axes[0])
    return ends


def reach_sphere(robot: Robot) -> tuple[Floats, float]:
    """A ball that the flange origin never leaves, in the base frame, or in that of the carriage of a linear axis.

    Its centre is on the first axis that turns. Tighter than `reach` for arms whose shoulder stands above the frame;
    same argument, started on that axis.

    Returns:
        centre (3,) m, and radius [m].
    """
    turning = robot if robot.carried is None else robot.carried
    _, centre, radius = _reach(turning.kinematic_key)
    return np.array(centre), radius


@lru_cache(maxsize=256)
def _reach(key: KinematicKey) -> tuple[float, tuple[float, ...], float]:
    placements, axes, _, flange = _geometry(key)
    total, _ = _shortest_chain(placements, axes, flange, from_origin=True)
    radius, slide = _shortest_chain(placements, axes, flange, from_origin=False)
    centre = placements[0][:3, :3] @ (slide * axes[0]) + placements[0][:3, 3]
    return total, tuple(float(c) for c in centre), radius


def _shortest_chain(placements: Floats, axes: Floats, flange: Floats, *, from_origin: bool) -> tuple[float, float]:
    """Length of a short chain of points on the axes, ending at the flange origin, and the slide of its first point.

    The sum of lengths is convex in the slides; each slide in turn is set to its optimum, which is where the light of
    one neighbour would be reflected to the other. Any set of slides is a valid bound, so stopping early is sound.
    """
    n = len(axes)
    slides = np.zeros(n)
    links = [*placements, flange]

    def before(i: int) -> Floats:
        """Point i - 1 in the frame of joint i (i = n: in the flange frame)."""
        point = np.zeros(3) if i == 0 else slides[i - 1] * axes[i - 1]
        back: Floats = links[i][:3, :3].T @ (point - links[i][:3, 3])
        return back

    def after(i: int) -> Floats:
        """Point i + 1 in the frame of joint i."""
        point = np.zeros(3) if i + 1 == n else slides[i + 1] * axes[i + 1]
        forth: Floats = links[i + 1][:3, :3] @ point + links[i + 1][:3, 3]
        return forth

    for _ in range(60):
        for i, axis in enumerate(axes):
            forth = after(i)
            along, aside = _on_axis(forth, axis)
            if i > 0 or from_origin:
                other, beside = _on_axis(before(i), axis)
                both = aside + beside
                along = 0.5 * (along + other) if both == 0.0 else (along * beside + other * aside) / both
            slides[i] = along
    first = 0 if from_origin else 1
    lengths = [np.linalg.norm((slides[i] * axes[i] if i < n else np.zeros(3)) - before(i)) for i in range(first, n + 1)]
    return float(np.sum(lengths)), float(slides[0])


def _on_axis(point: Floats, axis: Floats) -> tuple[float, float]:
    """Coordinate of a point along a unit axis, and its distance from it."""
    along = float(point @ axis)
    return along, float(np.linalg.norm(point - along * axis))
