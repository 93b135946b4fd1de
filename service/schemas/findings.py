"""What is found out about a layout in a real cell, as it is published in the OpenAPI document."""

from __future__ import annotations

from pydantic import Field

from duocell.service.schemas.base import Answer, Number

_ASKED = "null if not looked at."


class ClassClearance(Answer):
    """What a class of pairs keeps along the whole path, between the poses too."""

    required: float = Field(description="m, that was asked for.", examples=[0.03])
    distance: Number = Field(
        description="m, the smallest at any sample of the path, by Coal; negative: how deep the bodies penetrate.",
        examples=[0.041],
    )
    pair: list[str] = Field(
        description="The two bodies that come nearest to each other.", examples=[["main link 3", "table"]]
    )
    pose: int = Field(description="Index of the pose before that sample.", examples=[4])
    fraction: float = Field(description="Of the way from there to the next pose, 0 to 1.", examples=[0.25])
    lower_bound: Number = Field(
        description="m, nothing of the class comes nearer anywhere on the path; null if that is not known.",
        examples=[0.038],
    )
    certain: bool = Field(
        description="Nothing between the samples can change whether distance >= required.", examples=[True]
    )


class Clearances(Answer):
    """Per class of pairs."""

    arm_arm: ClassClearance | None = Field(description=f"Between two arms; {_ASKED}")
    arm_part: ClassClearance | None = Field(description=f"Between arms and the part; {_ASKED}")
    arm_obstacle: ClassClearance | None = Field(description=f"Between arms and obstacles; {_ASKED}")
    part_obstacle: ClassClearance | None = Field(description=f"Between the part and obstacles; {_ASKED}")
    self: ClassClearance | None = Field(description=f"Between the bodies of one arm; {_ASKED}")


class Distances(Answer):
    """Per class of pairs."""

    arm_arm: Number = Field(description=f"m, between two arms; {_ASKED}", examples=[0.03])
    arm_part: Number = Field(description=f"m, between arms and the part; {_ASKED}", examples=[0.05])
    arm_obstacle: Number = Field(description=f"m, between arms and obstacles; {_ASKED}", examples=[0.04])
    part_obstacle: Number = Field(description=f"m, between the part and obstacles; {_ASKED}", examples=[0.04])
    self: Number = Field(description=f"m, between the bodies of one arm; {_ASKED}", examples=[0.08])


class ToleranceResult(Answer):
    """What is left if the bases are not exactly where they should be."""

    position: float = Field(description="m, that was asked about.", examples=[0.002])
    angle: float = Field(description="rad, that was asked about.", examples=[0.00175])
    samples: int = Field(description="Layouts with errors that were looked at.", examples=[96])
    feasible: float = Field(description="Share of them that still can do the task.", examples=[1.0])
    margin: Number = Field(
        description="rad, smallest joint margin over those that can be followed; negative beyond a limit.",
        examples=[0.29],
    )
    margin_by_sensitivity: Number = Field(description="rad, its first-order estimate.", examples=[0.29])
    clearances: Distances = Field(description="Smallest distances over the same, whatever was asked for.")
    largest: Number = Field(
        description="Factor on both errors up to which every sampled layout stays feasible.", examples=[4.0]
    )
    note: str = Field(
        description="What breaks first.", examples=["At 4 times the errors main link 3 touches the table at pose 4."]
    )


class Relaxation(Answer):
    """A change of the request that makes it feasible, found by trying it."""

    what: str = Field(description="One sentence.", examples=["Allow main to stand up to 0.25 m farther out."])
    pointer: str = Field(description="JSON pointer of the field to change.", examples=["/arms/0/base/x"])
    objective: Number = Field(description="Of the layout that becomes possible.", examples=[171.3])


class ExplanationResult(Answer):
    """What blocks an infeasible cell."""

    blocking: list[str] = Field(
        description="These by themselves leave no layout, and without any one of them the others do; what else is "
        "in the way stands in `reasons`.",
        examples=[["the clearance of main from the table"]],
    )
    irreducible: bool = Field(
        description="True if that is proved, and a layout without it is known for each of them; false: not all may be "
        "needed.",
        examples=[True],
    )
    relaxations: list[Relaxation] = Field(
        description="Changes that help, each with the smallest number that was found, the cheapest first."
    )
    behind: list[str] = Field(
        default=[],
        description="What still leaves no layout once these are undone, where undoing them is not enough.",
        examples=[[]],
    )
