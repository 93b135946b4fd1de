"""Poses: a position and a rotation in one of nine formats."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field, Tag

from duocell.service.schemas.base import Matrix3, Strict, Vector3, Vector4, exactly_one_of

FORMS = (
    *("quaternion", "matrix", "rpy", "euler_zyz", "oat"),
    *("quaternion_wxyz", "axis_angle", "abc_deg", "wpr_deg"),
)
"""Of an orientation; degrees only where controllers and pendants have nothing else, and then in the name."""


class Quaternion(Strict):
    """A unit quaternion."""

    quaternion: Vector4 = Field(
        description="[x, y, z, w]. Normalised if its length is within 1e-3 of one, refused otherwise.",
        examples=[[0.0, 0.0, 0.3826834, 0.9238795]],
    )


class Matrix(Strict):
    """A rotation matrix."""

    matrix: Matrix3 = Field(
        description="Three rows. Projected to the nearest rotation if orthonormal and right-handed to 1e-3, "
        "refused otherwise.",
        examples=[[[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]],
    )


class RollPitchYaw(Strict):
    """Turns about the fixed axes x, y, z."""

    rpy: Vector3 = Field(
        description="[roll, pitch, yaw] in rad: Rz(yaw) Ry(pitch) Rx(roll).", examples=[[3.1415926, 0.0, 1.5707963]]
    )


class EulerZyz(Strict):
    """Euler angles about z, y, z."""

    euler_zyz: Vector3 = Field(
        description="[α, β, γ] in rad: Rz(α) Ry(β) Rz(γ). Kawasaki controllers call these O, A, T.",
        examples=[[0.0, 1.5707963, 0.0]],
    )


class Oat(Strict):
    """Orientation, altitude, tool angles of PUMA arms."""

    oat: Vector3 = Field(
        description="[O, A, T] in rad: Rz(O - 90°) Ry(90° - A) Rz(T), equation (3.34) of the source. VAL controllers "
        "of PUMA arms print A with the opposite sign (READY is (90°, -90°, 0) there): change the sign of their A.",
        examples=[[1.5707963, 1.5707963, 0.0]],
    )


class QuaternionWxyz(Strict):
    """A unit quaternion, its scalar first."""

    quaternion_wxyz: Vector4 = Field(
        description="[w, x, y, z], q1 to q4 of ABB controllers. Normalised if its length is within 1e-3 of one, "
        "refused otherwise.",
        examples=[[0.9238795, 0.0, 0.0, 0.3826834]],
    )


class AxisAngle(Strict):
    """A rotation vector."""

    axis_angle: Vector3 = Field(
        description="[rx, ry, rz] in rad: the axis, as long as the angle; what Universal Robots writes into `p[...]`.",
        examples=[[0.0, 3.1415926, 0.0]],
    )


class AbcDegrees(Strict):
    """The angles of KUKA controllers."""

    abc_deg: Vector3 = Field(
        description="[A, B, C] in degrees: Rz(A) Ry(B) Rx(C), as KUKA controllers write them.",
        examples=[[90.0, 0.0, 180.0]],
    )


class WprDegrees(Strict):
    """The angles of FANUC controllers."""

    wpr_deg: Vector3 = Field(
        description="[W, P, R] in degrees: Rz(R) Ry(P) Rx(W), as FANUC controllers write them.",
        examples=[[180.0, 0.0, 90.0]],
    )


Orientation = Annotated[
    Annotated[Quaternion, Tag("@quaternion")]
    | Annotated[Matrix, Tag("@matrix")]
    | Annotated[RollPitchYaw, Tag("@rpy")]
    | Annotated[EulerZyz, Tag("@euler_zyz")]
    | Annotated[Oat, Tag("@oat")]
    | Annotated[QuaternionWxyz, Tag("@quaternion_wxyz")]
    | Annotated[AxisAngle, Tag("@axis_angle")]
    | Annotated[AbcDegrees, Tag("@abc_deg")]
    | Annotated[WprDegrees, Tag("@wpr_deg")],
    exactly_one_of(*FORMS),
]


class Pose(Strict):
    """Position and orientation of one frame in another."""

    position: Vector3 = Field(description="[x, y, z] in m.", examples=[[0.9, 0.5, 0.1]])
    orientation: Orientation = Field(
        description="Exactly one of quaternion, matrix, rpy, euler_zyz, oat, quaternion_wxyz, axis_angle, abc_deg, "
        "wpr_deg.",
        examples=[{"quaternion": [0.0, 0.0, 0.3826834, 0.9238795]}],
    )


IDENTITY = Pose(position=[0.0, 0.0, 0.0], orientation=Quaternion(quaternion=[0.0, 0.0, 0.0, 1.0]))
