"""What all schemas share: strictness, and the number types of the wire."""

from __future__ import annotations

import unicodedata
from functools import reduce
from operator import or_
from typing import Annotated, Any, Self, get_args

from pydantic import (
    AfterValidator,
    AwareDatetime,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Discriminator,
    Field,
    PlainSerializer,
    Tag,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from duocell.service.common.numbers import finite
from duocell.service.common.timestamps import timestamp

TAG = "@"
"""First letter of the tags of unions; such parts of an error location are no part of the document."""


class Strict(BaseModel):
    """A part of a request: nothing is converted (whole numbers count as numbers), nothing unknown is accepted."""

    model_config = ConfigDict(extra="forbid", strict=True, frozen=True, allow_inf_nan=False)

    @model_validator(mode="before")
    @classmethod
    def _know_every_field(cls, value: Any) -> Any:
        """Refuse unknown fields here, where their right names are known, rather than by pydantic's own check."""
        if isinstance(value, dict):
            known = cls.__pydantic_fields__  # `model_fields` asks first whether it may: 2 µs, ten times per pose
            unknown = [key for key in value if key not in known]
            if unknown:
                raise PydanticCustomError(
                    "unknown_field", "unknown field", {"unknown": unknown, "allowed": list(known)}
                )
        return value


class Answer(BaseModel):
    """A part of an answer. No field has a default, so that a generated client sees every field as present.

    It is made of an object with attributes of the same names, so that what a field is called and holds stands here and
    where it comes from, and nowhere between.
    """

    model_config = ConfigDict(extra="forbid", frozen=True, from_attributes=True)

    @classmethod
    def of(cls, source: object, **made: Any) -> Self:
        """The answer made of attributes of ``source``, and in their place of what is ``made`` for it."""
        known = {name: getattr(source, name) for name in cls.__pydantic_fields__ if name not in made}
        return cls.model_validate(known | made)


class Choice(Discriminator):
    """A discriminator that may stand in ``X | None``, whose members must be hashable."""

    __hash__ = object.__hash__


def exactly_one_of(*names: str) -> Choice:
    """Chooses the member of a union by the one of ``names`` that is given; the member's tag is ``TAG`` + name."""

    def choose(value: Any) -> str | None:
        fields = value if isinstance(value, dict) else value.__pydantic_fields__ if isinstance(value, Strict) else ()
        given = [name for name in names if name in fields]
        return TAG + given[0] if len(given) == 1 else None

    return Choice(
        choose,
        custom_error_type="one_of",
        custom_error_message="exactly one of several fields is needed",
        custom_error_context={"choices": ", ".join(names)},
    )


def tagged_by_type(*names: str) -> Choice:
    """Chooses the member of a union by its field ``type``, one of ``names``; the member's tag is ``TAG`` + name."""

    def choose(value: Any) -> str | None:
        kind = value.get("type") if isinstance(value, dict) else getattr(value, "type", None)
        return TAG + kind if isinstance(kind, str) and kind in names else None

    return Choice(
        choose,
        custom_error_type="type_of",
        custom_error_message="the type is unknown",
        custom_error_context={"choices": ", ".join(names)},
    )


def one_of_types(*kinds: type[Strict]) -> Any:
    """The union of kinds that are told apart by their field ``type``, in which each has its own word."""
    words = [get_args(kind.model_fields["type"].annotation)[0] for kind in kinds]
    members = (Annotated[kind, Tag(TAG + word)] for kind, word in zip(kinds, words, strict=True))
    return Annotated[reduce(or_, members), tagged_by_type(*words)]


def _number_or_interval(value: Any) -> str:
    return f"{TAG}interval" if isinstance(value, list) else f"{TAG}number"


def _ordered(interval: list[float]) -> list[float]:
    """Refuse [high, low]."""
    low, high = interval
    if low > high:
        raise PydanticCustomError("interval_order", "low above high", {"low": low, "high": high})
    return interval


def _printable(text: str) -> str:
    """Refuse control characters: labels end up in tables, drawings and logs."""
    if any(unicodedata.category(letter) == "Cc" for letter in text):
        raise PydanticCustomError("control_characters", "control characters")
    return text


MOST_JOINTS = 16
"""Values of a list with one per joint; how many joints the robot has is seen later."""

FIRST_WRONG = Field(fail_fast=True)
"""Of lists that may be long: only the first member that is wrong is told."""


def _weight(value: float) -> float:
    """Refuse weights that are neither nothing nor something."""
    if 0.0 < value < LEAST_WEIGHT:
        raise PydanticCustomError("weight", "too small for a weight", {"least": LEAST_WEIGHT, "most": MOST_WEIGHT})
    return value


LEAST_WEIGHT, MOST_WEIGHT = 1e-6, 1e6
Weight = Annotated[float, Field(ge=0.0, le=MOST_WEIGHT), AfterValidator(_weight)]
"""0, or between `LEAST_WEIGHT` and `MOST_WEIGHT`: only the ratios of weights matter."""


def _listed(value: Any) -> Any:
    """An array as lists; anything else as it is."""
    return value.tolist() if hasattr(value, "tolist") else value


Number = Annotated[float | None, BeforeValidator(finite)]
"""Of an answer; null where there is none, or it is infinite (no limit, no margin)."""
Listed = BeforeValidator(_listed)
"""Of lists in answers that are arrays where they come from."""
Moment = Annotated[
    AwareDatetime,
    PlainSerializer(timestamp, return_type=str),
    WithJsonSchema({"type": "string", "format": "date-time"}),
]
"""RFC 3339 in UTC, always with microseconds."""
Positive = Annotated[float, Field(gt=0.0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Vector2 = Annotated[list[float], Field(min_length=2, max_length=2)]
PositiveVector2 = Annotated[list[Positive], Field(min_length=2, max_length=2)]
PositiveVector3 = Annotated[list[Positive], Field(min_length=3, max_length=3)]
Polygon = Annotated[list[Vector2], Field(min_length=3), FIRST_WRONG]
PerJoint = Field(max_length=MOST_JOINTS)
Vector3 = Annotated[list[float], Field(min_length=3, max_length=3)]
Vector4 = Annotated[list[float], Field(min_length=4, max_length=4)]
Matrix3 = Annotated[list[Vector3], Field(min_length=3, max_length=3)]
Interval = Annotated[list[float], Field(min_length=2, max_length=2), AfterValidator(_ordered)]
NumberOrInterval = Annotated[
    Annotated[float, Tag("@number")] | Annotated[Interval, Tag("@interval")], Discriminator(_number_or_interval)
]
"""A fixed value or the interval to choose from."""
Label = Annotated[
    str,
    # The same rule for clients and generators of test data; the validator has the better sentence.
    Field(max_length=200, json_schema_extra={"pattern": r"^[^\u0000-\u001f\u007f-\u009f]*$"}),
    AfterValidator(_printable),
]
