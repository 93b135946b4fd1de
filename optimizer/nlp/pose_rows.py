"""Rows of one pose in the nonlinear program: the flange is where the task wants it, and exact derivatives of that.

Where the task leaves parameters open (`duocell.models.cell.pose_freedom`), they are unknowns of the pose beside the
joints, and the flange target is a function of them.

The orientation residual is the Gibbs vector ``tan(θ/2) · axis`` of the rotation error. The plain skew part
``sin θ · axis`` also vanishes at θ = 180°, and a solver does converge there; the Gibbs vector has its only root at
θ = 0 and grows without bound towards 180°.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.displacement import displaced_symbols
from duocell.models.cell.pose_freedom import EQUATIONS, PoseFreedom
from duocell.models.kinematics.branches import posture_terms
from duocell.models.kinematics.casadi_kinematics import flange_function
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.robot import Robot

BASE = 4
"""Base variables of an arm: x, y, z [m], yaw [rad]."""
Mount = tuple[float, ...]
"""Nine numbers: base orientation in the world at yaw 0, row by row."""
UPRIGHT: Mount = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0)
TARGET = 12
"""Numbers of a target pose: rotation column by column, then position."""
Kind = tuple[int, ...]
"""The parameters of a displacement that are open, see `PoseFreedom.kind`; () where a pose is given."""


@dataclass(frozen=True, eq=False, slots=True)
class PoseRows:
    """Compiled rows of one pose of one robot.

    Inputs are base (4), unknowns of the pose (n), target (`target_size`), for the Hessian also multipliers (size).

    Attributes:
        size: rows per pose: those of the pose, and one more if the shoulder is kept.
        dof: n: the joints, and the parameters that are open.
        value: -> (size,).
        jacobian: -> dense (size · (4 + n),) column by column.
        hessian: -> (10 + 4n + n(n+1)/2,): upper triangle of base-base, then base-pose, then upper triangle of
            pose-pose, each column by column.
    """

    size: int
    dof: int
    value: ca.Function
    jacobian: ca.Function
    hessian: ca.Function


def target_size(kind: Kind) -> int:
    """Numbers that a target is given by: its pose, or what stands before and after a displacement, and its cone."""
    return 2 * TARGET + 1 if kind else TARGET


@lru_cache(maxsize=128)
def pose_rows(robot: Robot, keep_shoulder: bool, mount: Mount = UPRIGHT, kind: Kind = ()) -> PoseRows:
    """Compile the rows of ``robot``; with ``keep_shoulder`` the last row is the front coordinate of its wrist [m]."""
    n = robot.dof + len(kind)
    base, pose, target = ca.SX.sym("base", BASE), ca.SX.sym("joints", n), ca.SX.sym("target", target_size(kind))
    joints = pose[: robot.dof]
    wanted = _wanted(kind, pose[robot.dof :], target)
    rows = _residual(robot, base, joints, wanted, np.array(mount).reshape(3, 3))
    if rows.numel() != EQUATIONS:
        raise AssertionError("a pose takes another number of equations than is told")
    if keep_shoulder:
        form = closed_form(robot)
        if form is None:
            raise ValueError(f"{robot.name} has no shoulder sign")
        front, _, _ = posture_terms(form, [joints[i] for i in range(robot.dof)], ca.sin, ca.cos)
        rows = ca.vertcat(rows, front)
    unknowns = ca.vertcat(base, pose)
    multipliers = ca.SX.sym("multipliers", rows.numel())
    hessian = ca.densify(ca.hessian(ca.dot(multipliers, rows), unknowns)[0])
    entries = [hessian[i, j] for i, j in hessian_pattern(n)]
    inputs, names = [base, pose, target], ["base", "joints", "target"]
    options = {"cse": True}
    return PoseRows(
        size=rows.numel(),
        dof=n,
        value=ca.Function("rows", inputs, [rows], names, ["rows"], options),
        jacobian=ca.Function(
            "jacobian", inputs, [ca.vec(ca.densify(ca.jacobian(rows, unknowns)))], names, ["jacobian"], options
        ),
        hessian=ca.Function(
            "hessian", [*inputs, multipliers], [ca.vertcat(*entries)], [*names, "multipliers"], ["hessian"], options
        ),
    )


def hessian_pattern(n: int) -> list[tuple[int, int]]:
    """(row, column) of every entry of `PoseRows.hessian`, in the unknowns (base, those of the pose) of one pose."""
    upper = [(i, j) for j in range(BASE) for i in range(j + 1)]
    mixed = [(i, BASE + j) for j in range(n) for i in range(BASE)]
    joints = [(BASE + i, BASE + j) for j in range(n) for i in range(j + 1)]
    return upper + mixed + joints


def _wanted(kind: Kind, values: ca.SX, target: ca.SX) -> tuple[ca.SX, ca.SX]:
    """Rotation (3, 3) and position (3,) of the flange target, for the parameters that are open."""
    rotation, position = ca.reshape(target[:9], 3, 3), target[9:TARGET]
    if not kind:
        return rotation, position
    turn, shift = displaced_symbols(kind, values, target[2 * TARGET])
    after = target[TARGET : 2 * TARGET]
    place = shift + turn @ after[9:]
    return rotation @ turn @ ca.reshape(after[:9], 3, 3), position + rotation @ place


def _residual(robot: Robot, base: ca.SX, joints: ca.SX, target: tuple[ca.SX, ca.SX], mount: Floats) -> ca.SX:
    """(6,) position error [m] in the world, Gibbs vector of the orientation error."""
    wanted, place = target
    rotation, position = flange_function(robot)(joints)
    cos, sin = ca.cos(base[3]), ca.sin(base[3])
    yaw = ca.sparsify(ca.DM(mount)) @ ca.sparsify(ca.blockcat([[cos, -sin, 0], [sin, cos, 0], [0, 0, 1]]))
    error = (yaw.T @ wanted).T @ ca.sparsify(rotation)
    skew = ca.vertcat(error[2, 1] - error[1, 2], error[0, 2] - error[2, 0], error[1, 0] - error[0, 1])
    gibbs = skew / (1.0 + ca.trace(error))
    return ca.vertcat(yaw @ ca.sparsify(position) + base[:3] - place, gibbs)


def target_numbers(targets: Floats) -> Floats:
    """(12, m) parameters from flange targets (m, 4, 4) in the world."""
    rotations = np.transpose(targets[:, :3, :3], (0, 2, 1)).reshape(len(targets), 9)
    return np.concatenate([rotations, targets[:, :3, 3]], axis=1).T


def freedom_numbers(freedom: PoseFreedom) -> Floats:
    """(`target_size`, m) parameters of the poses of an arm, whatever they leave open."""
    if freedom.exact:
        return target_numbers(freedom.targets())
    return np.concatenate([target_numbers(freedom.before), target_numbers(freedom.after), freedom.cone[None]])
