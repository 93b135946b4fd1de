"""Poses: a position and a rotation in one of nine formats; and lists of them, which are read in one pass."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import chain
from operator import itemgetter
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, GetCoreSchemaHandler, SerializationInfo, Tag
from pydantic_core import CoreSchema, core_schema

from duocell.models.base.arrays import Floats, Ints
from duocell.service.schemas.base import FIRST_WRONG, Matrix3, Strict, Vector3, Vector4, exactly_one_of

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


SHAPES: dict[str, tuple[int, ...]] = {
    **dict.fromkeys(FORMS, (3,)),
    **dict.fromkeys(("quaternion", "quaternion_wxyz"), (4,)),
    "matrix": (3, 3),
}
"""Of the numbers of an orientation, by its format."""


@dataclass(frozen=True, slots=True, eq=False)
class Orientations:
    """Those orientations of a list of poses that have one format.

    Attributes:
        format: one of `FORMS`. rows: (k,) which poses of the list. values: (k, ...) as they were sent.
    """

    format: str
    rows: Ints
    values: Floats


@dataclass(frozen=True, slots=True, eq=False)
class PoseList:
    """Two poses or more, as arrays: thousands of objects would take ten times as long to make and to go through.

    For Pydantic it is a list of `Pose`. Where anything is wrong with one, that list is what says so.

    Attributes:
        positions: (m, 3) m. orientations: one per format that occurs; () where only the positions are left.
    """

    positions: Floats
    orientations: tuple[Orientations, ...]

    def __len__(self) -> int:
        return len(self.positions)

    def one_by_one(self) -> list[tuple[str, Any]]:
        """Format and numbers of each orientation, in the order of the poses."""
        found: list[tuple[str, Any]] = [("", None)] * len(self)
        for some in self.orientations:
            for row, values in zip(some.rows.tolist(), some.values.tolist(), strict=True):
                found[row] = some.format, values
        return found

    def document(self) -> list[dict[str, Any]]:
        """The poses as they are written in a request; every number is a float.

        Raises:
            ValueError: only the positions are left.
        """
        if not self.orientations:
            raise ValueError("poses without orientations cannot be written")
        rows = zip(self.positions.tolist(), self.one_by_one(), strict=True)
        return [{"position": position, "orientation": {name: values}} for position, (name, values) in rows]

    @classmethod
    def __get_pydantic_core_schema__(cls, source: Any, handler: GetCoreSchemaHandler) -> CoreSchema:
        one_by_one = handler.generate_schema(Annotated[list[Pose], Field(min_length=2), FIRST_WRONG])
        return core_schema.no_info_wrap_validator_function(
            cls._read,
            one_by_one,
            serialization=core_schema.plain_serializer_function_ser_schema(cls._written, info_arg=True),
        )

    def _written(self, info: SerializationInfo) -> Any:
        """The document; where the context of a dump is a function of lists of poses, what that makes of this one."""
        return self.document() if info.context is None else info.context(self)

    @classmethod
    def _read(cls, value: Any, one_by_one: Callable[[Any], list[Pose]]) -> Self:
        """The list that was sent.

        Raises:
            ValidationError: what is wrong with the first pose that is not as it should be.
        """
        if isinstance(value, cls):
            return value
        found = cls._of(value)
        if found is None:
            found = cls._of([pose.model_dump() for pose in one_by_one(value)])
        if found is None:
            raise AssertionError("poses that are right one by one are not right together")
        return found

    @classmethod
    def _of(cls, poses: Any) -> Self | None:
        """The poses of a document; None if there is anything wrong with them. All of it is done by loops in C."""
        if not isinstance(poses, list) or len(poses) < 2 or not _all_are(dict, 2, poses):
            return None
        try:
            places, turns = zip(*map(itemgetter("position", "orientation"), poses), strict=True)
        except KeyError:
            return None
        positions = _numbers(places, (3,))
        if positions is None or not _all_are(dict, 1, turns):
            return None
        names = [*chain.from_iterable(turns)]
        stated = []
        for name in dict.fromkeys(names):
            rows = [row for row, other in enumerate(names) if other == name]
            values = _numbers([turns[row][name] for row in rows], SHAPES[name]) if name in SHAPES else None
            if values is None:
                return None
            stated.append(Orientations(name, np.array(rows), values))
        return cls(positions, tuple(stated))


def _all_are(kind: type, length: int, values: Sequence[Any]) -> bool:
    """Whether all values are of a type and a length."""
    return set(map(type, values)) == {kind} and set(map(len, values)) == {length}


def _numbers(rows: Sequence[Any], shape: tuple[int, ...]) -> Floats | None:
    """(k, *shape) finite numbers of nested lists; None if they are anything else."""
    flat = rows
    for length in shape:
        if not _all_are(list, length, flat):
            return None
        flat = list(chain.from_iterable(flat))
    if not {float, int}.issuperset(map(type, flat)):
        return None
    try:
        numbers = np.fromiter(flat, np.float64, len(flat))
    except OverflowError:  # a whole number beyond all floats
        return None
    return numbers.reshape(-1, *shape) if np.isfinite(numbers).all() else None
