"""CasADi kinematics, walked from the Pinocchio model.

The wheel of Pinocchio has no ``pinocchio.casadi``; multiplying its joint placements and axes in CasADi gives the same
numbers to the last digits (a test compares the two for every robot of the catalogue).
"""

from __future__ import annotations

import casadi as ca

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.kinematics import chain, flange_placement, pinocchio_model
from duocell.models.robot.joint import JointMotions
from duocell.models.robot.robot import KinematicKey, Robot

_functions: dict[KinematicKey, ca.Function] = {}
_MOST_FUNCTIONS = 256

_ROUNDING = 1e-15
"""Entries of rotations and axes below this are left over from sines of multiples of π."""


def flange_function(robot: Robot) -> ca.Function:
    """Pose of the flange in the base frame as a CasADi function.

    One function per geometry, shared and cached; ``map`` it over the poses of a path.

    Returns:
        ``flange(q) -> (R, p)``: q (n) rad or m, R (3, 3), p (3) m.
    """
    function = _functions.get(robot.kinematic_key)
    if function is None:
        function = _build(robot)
        if len(_functions) >= _MOST_FUNCTIONS:
            _functions.clear()
        _functions[robot.kinematic_key] = function
    return function


def tool_jacobian(robot: Robot, joints: ca.SX, point: ca.SX) -> ca.SX:
    """Jacobian of a point of the hand in symbols, in axes parallel to the base frame, linear rows first.

    Args:
        robot: the chain.
        joints: (n,) rad.
        point: (3,) m, in the flange frame.

    Returns:
        (6, n), by derivatives of the pose, so it holds for joints of any kind.
    """
    rotation, position = flange_function(robot)(joints)
    columns = []
    for k in range(robot.dof):
        spin = ca.reshape(ca.jtimes(ca.vec(rotation), joints, ca.DM.eye(robot.dof)[:, k]), 3, 3) @ rotation.T
        columns.append(ca.vertcat(spin[2, 1], spin[0, 2], spin[1, 0]))
    return ca.vertcat(ca.jacobian(position + rotation @ point, joints), ca.horzcat(*columns))


def _build(robot: Robot) -> ca.Function:
    """Product of placements and joint motions over the chain, expanded to scalars."""
    model = pinocchio_model(robot)
    placements, axes = chain(model, range(1, model.njoints))
    flange = flange_placement(model)
    motions = JointMotions(robot.prismatic, axes)
    q = ca.SX.sym("q", robot.dof)
    rotation, position = ca.SX.eye(3), ca.SX.zeros(3)
    for index, placement in enumerate(placements):
        position = position + rotation @ placement[:3, 3]
        rotation = rotation @ _constant(placement[:3, :3])
        if robot.prismatic[index]:
            position = position + q[index] * (rotation @ axes[index])
        else:
            rotation = rotation @ _turn(motions, index, q[index])
    position = position + rotation @ flange[:3, 3]
    rotation = rotation @ _constant(flange[:3, :3])
    return ca.Function("flange", [q], [ca.densify(rotation), ca.densify(position)], ["q"], ["R", "p"])


def _turn(motions: JointMotions, joint: int, angle: ca.SX) -> ca.SX:
    """The turn of one joint."""
    turn: ca.SX = motions.symbolic_rotation(joint, ca.cos(angle), ca.sin(angle), _constant)
    return turn


def _constant(matrix: Floats) -> ca.SX:
    """A numeric matrix without its zeros and rounding errors, so that products skip them (half of them for an iiwa)."""
    return ca.SX(ca.sparsify(ca.DM(matrix), _ROUNDING))
