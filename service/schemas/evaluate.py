"""The request to evaluate a given layout, and the answer."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import ConfigDict, Field

from duocell.service.schemas.arm import Arm, Base
from duocell.service.schemas.base import FIRST_WRONG, Answer, PerJoint
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.schemas.result import LayoutResult

_BASES = (
    {"x": 0.1618, "y": 0.9457, "z": 0.0, "yaw": -0.8766},
    {"x": 1.6511, "y": 0.1093, "z": 0.0, "yaw": 2.2708},
)
EVALUATE_EXAMPLE: dict[str, Any] = {
    **{name: EXAMPLE[name] for name in ("name", "task", "max_joint_step")},
    "arms": [{**arm, "base": base} for arm, base in zip(EXAMPLE["arms"], _BASES, strict=True)],
}
"""A complete request; the tests send it."""


class PlacedBase(Base):
    """Where the base stands in the world."""

    x: float = Field(description="m, of the origin of the base frame.", examples=[0.16])
    y: float = Field(description="m.", examples=[0.95])
    z: float = Field(description="m.", examples=[0.0])
    yaw: float = Field(description="rad about the vertical (with a `mount`: about z of the base).", examples=[-0.8766])


class PlacedArm(Arm):
    """One of the arms that carry the object, at its place."""

    base: PlacedBase = Field(description="Where the base stands.", examples=[_BASES[0]])
    joints: Annotated[list[Annotated[list[float], PerJoint, FIRST_WRONG]], FIRST_WRONG] | None = Field(
        default=None,
        description="Joint values in rad to be checked as they are, one row per pose; null: the best path of the best "
        "posture is found.",
        examples=[[[0.1, -0.5, 2.4, 0.3, 0.2, 0.1], [0.2, -0.5, 2.4, 0.3, 0.2, 0.1]]],
    )


class EvaluateRequest(LayoutRequest):
    """Score and verify a layout without optimising.

    The fields are those of a request for a layout; time_limit, certificate, baselines, alternatives, tolerance
    and explain are accepted and ignored.
    """

    model_config = ConfigDict(json_schema_extra={"examples": [EVALUATE_EXAMPLE]})

    arms: list[PlacedArm] = Field(  # type: ignore[assignment]  # requests are frozen: nobody puts an Arm in here
        min_length=1, description="The arms at their places.", examples=[EVALUATE_EXAMPLE["arms"]]
    )


class Evaluation(Answer):
    """A layout and how good it is. It is not kept."""

    name: str = Field(description="Label of the request.", examples=["line"])
    request: EvaluateRequest = Field(description="The request with every default filled in.")
    result: LayoutResult = Field(
        description="As for a layout that was asked for: `feasible` if it breaks no rule, `infeasible` with a reason "
        "for every rule that it breaks; without joints `infeasible` only if no path from these bases keeps all rules, "
        "and `unknown` if none was found. Arms that reach all poses are listed whatever else they break."
    )
