"""The result of a layout, as it is published in the OpenAPI document."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from duocell.service.schemas.base import Answer, Listed, Number
from duocell.service.schemas.findings import Clearances, ExplanationResult, ToleranceResult
from duocell.service.schemas.pose import Pose


class BasePlacement(Answer):
    """Where a base stands."""

    position: Annotated[list[float], Listed] = Field(
        description="[x, y, z] in m of the base origin in the world.", examples=[[0.16, 0.95, 0.0]]
    )
    yaw: float = Field(description="rad about the vertical, in the interval of the request.", examples=[-0.8766])
    pose: Pose = Field(description="The same as a pose of the base frame in the world.")


class LinearMargin(Answer):
    """What a path leaves of a limit between joints."""

    name: str = Field(description="The limit.", examples=["joint_2 + joint_3"])
    margin: float = Field(description="rad, smallest distance of its sum to either end.", examples=[0.12])


class MeasureResult(Answer):
    """A measure along the path of one arm, over its poses."""

    measure: str = Field(description="Its name.", examples=["manipulability"])
    unit: str = Field(description="Of the values; 1: none.", examples=["1"])
    minimum: Number = Field(description="Smallest value.", examples=[0.37])
    mean: Number = Field(description="Mean.", examples=[1.1])
    maximum: Number = Field(description="Largest value.", examples=[1.6])


class TermResult(Answer):
    """What one measure contributes to the objective: weight times cost."""

    measure: str = Field(description="Its name.", examples=["joint_availability"])
    weight: float = Field(description="As in the request.", examples=[1.0])
    unit: str = Field(description="Of the cost; 1: none.", examples=["rad²"])
    cost: Number = Field(description="Over all arms and poses, each times the weight of its job.", examples=[155.2])


class Displacement(Answer):
    """What was chosen of what the poses leave open."""

    parameters: list[str] = Field(
        description="Of the displacement Trans(x, y, z) Tilt(tilt_x, tilt_y) Rx(turn_x) Ry(turn_y) Rz(turn_z), in the "
        "axes of the tolerance: those that are open at some pose, and those that are given and not 0.",
        examples=[["turn_z"]],
    )
    values: Annotated[list[list[float]], Listed] = Field(
        description="One row per pose: m for x, y, z, else rad.", examples=[[[0.31], [0.35]]]
    )
    tool: Annotated[list[Pose], Listed] = Field(
        description="The tool centre point in the world, pose by pose.",
        examples=[[{"position": [0.4, 0.1, 0.2], "orientation": {"quaternion": [0.0, 1.0, 0.0, 0.0]}}]],
    )


class ArmResult(Answer):
    """Where one arm stands and how it moves there."""

    name: str = Field(description="The arm's name in the request.", examples=["main"])
    base: BasePlacement = Field(description="Its base.")
    mounting_face: Pose | None = Field(
        default=None,
        description="The face that the base is bolted down with, in the world; null where it is not known.",
    )
    posture: dict[str, str] | None = Field(
        description="Posture kept along the path; null for robots without named postures.",
        examples=[{"shoulder": "left", "elbow": "up", "wrist": "flip"}],
    )
    objective: Number = Field(description="This arm's part of the objective.", examples=[68.48])
    joints: Annotated[list[list[float]], Listed] = Field(
        description="Joint values in rad, or m as `joint_units` says, one row per pose, job after job.",
        examples=[[[0.1, -0.5, 2.4, 0.3, 0.2, 0.1]]],
    )
    displacement: Displacement | None = Field(
        default=None, description="What was chosen where `tolerance` leaves poses open; null where nothing is open."
    )
    minimum_margin: Number = Field(
        description="rad, smallest distance of any joint that turns to its limits over the path; null if none has "
        "limits.",
        examples=[0.31],
    )
    joint_margins: Annotated[list[Number], Listed] = Field(
        description="The same per joint, in its unit; null for joints without limits.",
        examples=[[0.9, 0.5, 1.1, 0.31, 0.6, 2.2]],
    )
    joint_units: list[Literal["rad", "m"]] | None = Field(
        default=None,
        description="Units of the joints' values and margins: m for a linear axis. null in results of versions that "
        "knew none.",
        examples=[["m", "rad", "rad", "rad", "rad", "rad", "rad"]],
    )
    linear_margins: list[LinearMargin] | None = Field(
        default=None,
        description="The same per limit between joints, in the order of the request.",
        examples=[[{"name": "joint_2 + joint_3", "margin": 0.12}]],
    )
    minimum_conditioning: Number = Field(
        description="Smallest σmin/σmax of the Jacobian over the path, its linear rows divided by "
        "characteristic_length; 0 at a singularity.",
        examples=[0.08],
    )
    characteristic_length: Number = Field(description="m.", examples=[0.35])
    singularity_distances: dict[str, float | None] = Field(
        description="Smallest distance to the elbow and wrist singularity (rad) and the shoulder singularity (m); "
        "empty for robots without a closed form.",
        examples=[{"elbow": 0.8, "wrist": 0.4, "shoulder": 0.2}],
    )
    singularities: Literal["avoid", "allow"] | None = Field(
        description="Whether poses at a singularity of the wrist were refused; null in results of versions that knew "
        "no such rule.",
        examples=["avoid"],
    )
    measures: list[MeasureResult] | None = Field(
        default=None, description="Every measure that could be asked for; missing in results of older versions."
    )
    geometry: Literal["mesh", "cited", "estimated"] = Field(
        description="Where the shape of its links comes from: the maker's collision meshes, measurements with a "
        "source, or a rule of thumb from its reach. It matters for clearances only.",
        examples=["cited"],
    )


class Reason(Answer):
    """Why an arm cannot do its part."""

    arm: str = Field(description="Its name; empty where no arm is to blame.", examples=["main"])
    kind: str = Field(
        description="out_of_reach, joint_limit, joint_step, posture, conditioning, singularity, limit_reached, "
        "not_found, floor, coupling, collision, pose_error.",
        examples=["out_of_reach"],
    )
    poses: list[int] = Field(description="Poses concerned, counted from 0.", examples=[[7, 8, 9]])
    joint: str | None = Field(description="Joint, or limit between joints, concerned.", examples=[None])
    amount: Number = Field(description="By how much, in unit.", examples=[0.12])
    unit: str = Field(description="m, rad or empty.", examples=["m"])
    detail: str = Field(
        description="One sentence.",
        examples=["Poses 7 to 9 are out of reach by up to 0.12 m wherever the base stands."],
    )


class Search(Answer):
    """What the search did: the evidence where there is no proof."""

    candidates: int = Field(description="Base placements times postures evaluated.", examples=[4096])
    starts: int = Field(description="Local optimisations run.", examples=[12])
    basins: int = Field(description="Distinct local optima found.", examples=[3])
    wall_time: float = Field(description="s.", examples=[0.05])
    ended: bool | None = Field(
        description="false: the time limit cut the search, or the automatic proof, before it was through; null in "
        "results of versions that did not tell.",
        examples=[True],
    )
    first_feasible_time: Number = Field(
        description="s from the start to the first usable layout of the whole cell; null without one, and in results "
        "of versions that did not tell.",
        examples=[0.04],
    )


class ArmCertificate(Answer):
    """Proof for one arm."""

    arm: str = Field(description="Its name.", examples=["main"])
    lower_bound: Number = Field(
        description="No base in its region scores less; null where infeasible or where no proof is offered.",
        examples=[68.1],
    )
    gap: Number = Field(description="(objective - lower_bound) / objective.", examples=[0.005])
    proved: bool = Field(description="The requested gap is reached.", examples=[True])
    boxes: int = Field(description="Boxes of base positions examined.", examples=[34920])
    wall_time: float = Field(description="s.", examples=[0.4])
    note: str = Field(description="Why there is no bound, if there is none.", examples=[""])


class CertificateResult(Answer):
    """Proof for the cell."""

    lower_bound: Number = Field(description="No layout scores less.", examples=[154.1])
    gap: Number = Field(description="(objective - lower_bound) / max(objective, 1e-9).", examples=[0.007])
    proved: bool = Field(description="The requested gap is reached.", examples=[True])
    boxes: int = Field(description="Boxes of base positions examined.", examples=[60536])
    wall_time: float = Field(description="s.", examples=[0.8])
    ended: bool | None = Field(
        description="false: a time limit cut the proof; null in results of versions that did not tell.", examples=[True]
    )
    arms: list[ArmCertificate] = Field(description="Per arm.")


class PenaltyCycle(Answer):
    """One cycle of a penalty method: the minimum for one value of its parameter."""

    phase: str = Field(description="reach, exterior or interior.", examples=["interior"])
    parameter: Number = Field(description="Penalty parameter; 0 in the reach phase.", examples=[0.3])
    penalised: Number = Field(description="Penalised objective.", examples=[190.2])
    objective: Number = Field(description="Objective; null where there is no inverse.", examples=[171.0])
    placement: Annotated[list[float], Listed] = Field(
        description="[x, y, z, yaw] in m and rad.", examples=[[0.4, 0.9, 0.0, -0.8]]
    )
    worst: Number = Field(description="Largest violation in rad or m; kept if negative.", examples=[-0.02])
    iterations: int = Field(description="Line searches.", examples=[12])
    evaluations: int = Field(description="Evaluations of the penalised objective.", examples=[40])


class BaselineArm(Answer):
    """Where a method of the literature puts one arm."""

    arm: str = Field(description="Its name.", examples=["main"])
    base: BasePlacement = Field(description="Its base at the end.")
    start: BasePlacement | None = Field(description="Where the method began; null if it did not run.")
    posture: dict[str, str] | None = Field(description="Posture it keeps.", examples=[{"elbow": "up"}])
    objective: Number = Field(description="Its part of the objective.", examples=[75.0])
    feasible: bool = Field(description="Whether it keeps every constraint.", examples=[True])
    note: str = Field(description="What is worth knowing: an extra phase, an infeasible start.", examples=[""])
    trace: list[PenaltyCycle] = Field(description="Every cycle.")


class BaselineResult(Answer):
    """Result of a method of the literature on the same problem."""

    method: str = Field(description="Its name.", examples=["interior-penalty"])
    objective: Number = Field(description="The objective it reaches.", examples=[171.0])
    wall_time: float = Field(description="s.", examples=[1.2])
    feasible: bool = Field(description="Whether its point keeps every constraint.", examples=[True])
    note: str = Field(description="What is worth knowing about the run.", examples=[""])
    arms: list[BaselineArm] = Field(description="Per arm.")


class AlternativeResult(Answer):
    """Another layout of the same cell, as thoroughly checked as the answer."""

    objective: Number = Field(description="Its objective.", examples=[161.0])
    arms: list[ArmResult] = Field(description="Placements of all arms, in the order of the request.")
    clearances: Clearances = Field(description="What every class of pairs keeps along the whole path.")
    note: str = Field(description="Why one might prefer it.", examples=["Keeps 61 mm from the table instead of 34 mm."])


class Verification(Answer):
    """Numbers by Pinocchio, which did not produce the answer."""

    max_position_error: float = Field(description="m.", examples=[1e-12])
    max_orientation_error: float = Field(description="rad.", examples=[1e-12])
    max_joint_step: float = Field(
        description="rad between consecutive poses of a job, of joints that turn.", examples=[0.4]
    )
    max_prismatic_step: float | None = Field(
        default=None, description="m, likewise, of linear axes; null where there is none.", examples=[None]
    )
    limits_respected: bool = Field(description="Joints and bases are inside their limits.", examples=[True])
    tolerances_respected: bool | None = Field(
        default=None,
        description="Every pose is inside what `tolerance` leaves open there, seen from where the joints take the "
        "tool; null in results of versions that did not tell.",
        examples=[True],
    )


class JobResult(Answer):
    """One job of the task: which rows of `joints` are its own, and what it costs."""

    name: str = Field(description="Its name in the request; empty for a plain task.", examples=["carry"])
    first_pose: int = Field(description="Its first pose, counted from 0 through all jobs.", examples=[0])
    poses: int = Field(description="How many poses it has.", examples=[10])
    weight: float = Field(description="What each of its poses counts for.", examples=[1.0])
    objective: Number = Field(
        description="Its part of the objective, weight included; null if an arm has no placement.", examples=[155.2]
    )


class ResultWarning(Answer):
    """Something in the request that may be a slip; it was carried out as it stands."""

    pointer: str = Field(description="JSON pointer into the request.", examples=["/arms/0/limits/2"])
    detail: str = Field(description="What is odd, and what may have been meant.", examples=["The tool has no length."])


class LayoutResult(Answer):
    """The answer for a cell."""

    outcome: Literal["optimal", "feasible", "infeasible", "unknown"] = Field(
        description="optimal: proved to be the best within the gap of the certificate; feasible: usable, and how far "
        "from the best is known as far as the certificate says; infeasible: proved that there is no layout, see "
        "reasons; unknown: nothing usable found and nothing proved, see reasons. Of versions that do not tell "
        "`search.ended`: optimal was said of every search that ended, infeasible of every one that found nothing.",
        examples=["optimal"],
    )
    objective: Number = Field(
        description="What was minimised: the sum over objective_terms of weight times cost. If nothing else is asked "
        "for, Σ_arms Σ_j Σ_i w_i (q_ij - q*_i)², each pose j times the weight of its job. null without a usable "
        "layout.",
        examples=[155.2],
    )
    objective_terms: list[TermResult] | None = Field(
        default=None,
        description="The measures it is made of, in the order of the request; empty without a usable layout, missing "
        "in results of older versions.",
    )
    jobs: list[JobResult] = Field(description="The jobs in the order of the request; one for a plain task.")
    arms: list[ArmResult] = Field(
        description="Placements of the arms that work, in the order of the request; without a layout also the nearest "
        "that was seen, and `reasons` say what it breaks."
    )
    reasons: list[Reason] = Field(description="Why there is no layout, and what stopped the search.", examples=[[]])
    warnings: list[ResultWarning] = Field(
        description="What may be a slip in the request: lengths that look like millimetres, angles that look like "
        "degrees, a tool without length, a grasp far from the part, a flange frame that is turned, arms in one place.",
        examples=[[]],
    )
    proved: bool = Field(
        description="True only with a proof, of optimality to the gap or of infeasibility: with the words optimal and "
        "infeasible.",
        examples=[True],
    )
    search: Search = Field(description="What the search did.")
    certificate: CertificateResult | None = Field(description="The proof, as far as it got; null: not tried.")
    baselines: list[BaselineResult] = Field(description="Methods of the literature, if asked for.", examples=[[]])
    clearances: Clearances = Field(description="What every class of pairs keeps along the whole path.")
    alternatives: list[AlternativeResult] = Field(description="Other layouts, best first, if asked for.", examples=[[]])
    tolerance: ToleranceResult | None = Field(description="What installation errors leave, if asked for.")
    explanation: ExplanationResult | None = Field(
        description="What blocks a cell without a layout and what would help, if asked for."
    )
    verification: Verification | None = Field(description="Independent check; null if there is no placement.")
    version: str = Field(description="Version of the program.", examples=["0.2.0"])
    request_hash: str = Field(
        description="SHA-256 of the request as returned (defaults filled in) in canonical JSON: names sorted, no "
        "spaces.",
        examples=["9f86d081884c7d659a2feaa0c55ad015a3bf4f1b2b0b822cd15d6c15b0f00a08"],
    )
