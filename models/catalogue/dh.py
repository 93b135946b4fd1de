"""Robots from tables of standard Denavit-Hartenberg parameters.

``A_i = Rot(z, θ_i + offset_i) Trans(z, d_i) Trans(x, a_i) Rot(x, α_i)``, section 1 of the source. The base frame is the
table's frame 0 (its z axis is joint axis 1) unless another place is given for that, the flange frame its last one.
The first joint may be prismatic, a linear axis along z of frame 0: its value is added to d, and θ is the offset alone.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from math import isfinite, pi

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRobot
from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.kinematics.kinematics import characteristic_length, conditioning
from duocell.models.robot.arm import NARROWEST
from duocell.models.robot.joint import JointKind
from duocell.models.robot.robot import Robot

JOINT_COUNTS = (6, 7)
"""Inverse kinematics exists for six and seven joints, a linear axis among them; fewer cannot take a free pose, more
have no finite branches."""

MAX_LENGTH = 100.0
"""m; a longer link is taken for a length sent in millimetres."""

MAX_ANGLE = 20.0 * pi
"""rad; limits of ten turns either way are more than any arm has, beyond it the angle was probably sent in degrees."""


@dataclass(frozen=True, slots=True)
class DhRow:
    """One joint of a table: α [rad], a [m], d [m], limits of its value [rad or m], what is added to θ [rad], kind."""

    alpha: float
    a: float
    d: float
    lower: float
    upper: float
    theta_offset: float = 0.0
    kind: JointKind = JointKind.REVOLUTE


def robot_from_dh(name: str, rows: Sequence[DhRow], first_frame: Floats | None = None) -> Robot:
    """A robot from a table.

    Args:
        name: label of the robot.
        rows: six or seven, from the base to the flange.
        first_frame: (4, 4) m, frame 0 of the table in the base frame; None: they are one.

    Raises:
        InvalidRobot: with a pointer such as ``/dh/2/lower``: number of joints, numbers that are not finite or absurdly
            large, limits in the wrong order, or a geometry that cannot move its flange in all six directions.
    """
    if len(rows) not in JOINT_COUNTS:
        raise InvalidRobot(
            f"the D-H table has {len(rows)} rows; arms of 6 or 7 joints are supported, of which the first may be "
            "prismatic. "
            "A fixed transform after the last joint belongs into the tool.",
            "/dh",
        )
    for index, row in enumerate(rows):
        _check_row(index, row)
    lower = np.array([row.lower for row in rows])
    upper = np.array([row.upper for row in rows])
    links = [_link(row) for row in rows]
    start = np.eye(4) if first_frame is None else first_frame
    placements = [start @ _offset(rows[0])] + [
        link @ _offset(row) for link, row in zip(links[:-1], rows[1:], strict=True)
    ]
    robot = Robot(
        name=name,
        joint_names=tuple(f"joint_{i + 1}" for i in range(len(rows))),
        joint_placements=np.array(placements),
        joint_axes=np.tile([0.0, 0.0, 1.0], (len(rows), 1)),
        flange_placement=links[-1],
        lower=lower,
        upper=upper,
        reference=0.5 * (lower + upper),
        source="D-H table",
        joint_kinds=tuple(row.kind for row in rows),
    )
    check_full_rank(robot, "/dh")
    return robot


def check_full_rank(robot: Robot, pointer: str = "") -> None:
    """Refuse geometries that are singular everywhere.

    The Jacobian of a chain has its generic rank at almost every posture, so a few arbitrary ones decide.

    Raises:
        InvalidRobot: the flange cannot be moved in all six directions at any posture.
    """
    length = characteristic_length(robot)
    postures = np.random.default_rng(0).uniform(-pi, pi, (8, robot.dof))
    if robot.dof >= 6 and length > 0.0 and conditioning(robot, np.eye(4), postures, length).max() > 1e-6:
        return
    raise InvalidRobot(
        "this geometry is singular in every posture: its flange cannot be moved in all six directions. "
        "Its axes must neither all be parallel nor all meet in one point; check α, a, d.",
        pointer,
    )


def _check_row(index: int, row: DhRow) -> None:
    """Refuse numbers that are not finite or make no sense, naming the cell of the table."""
    if row.kind is JointKind.PRISMATIC and index > 0:
        raise InvalidRobot(
            f"joint {index + 1} is prismatic; only the first joint may be, a linear axis that carries the arm.",
            f"/dh/{index}/type",
        )
    unit = row.kind.unit
    for field in fields(DhRow):
        if field.name == "kind":
            continue
        value = getattr(row, field.name)
        length = field.name in ("a", "d") or (unit == "m" and field.name in ("lower", "upper"))
        most, of = (MAX_LENGTH, "m") if length else (MAX_ANGLE, "rad")
        if not isfinite(value) or abs(value) > most:
            raise InvalidRobot(
                f"{field.name} of joint {index + 1} is {value:g} {of}; allowed is -{most:g} to {most:g} {of}. "
                "Lengths are metres and angles radians.",
                f"/dh/{index}/{field.name}",
            )
    if row.upper - row.lower < NARROWEST:
        raise InvalidRobot(
            f"lower limit {row.lower:g} {unit} of joint {index + 1} is not {NARROWEST:g} {unit} below its upper limit "
            f"{row.upper:g} {unit}; "
            "swap them, or leave the joint some range.",
            f"/dh/{index}/lower",
        )


def _link(row: DhRow) -> Floats:
    """What follows the joint's motion: Trans(z, d) Trans(x, a) Rot(x, α)."""
    return transform(rotation_x(row.alpha), [row.a, 0.0, row.d])


def _offset(row: DhRow) -> Floats:
    """Rot(z, offset) in front of the joint's motion."""
    return transform(rotation_z(row.theta_offset), np.zeros(3))
