"""From a layout to the JSON document of the contract.

What the fields are called and hold stands in `duocell.service.schemas.result`; most are attributes of the layout under
the same name. Here is what is called or put together otherwise.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import cos, sin
from typing import Any

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import quaternion_from_rotation, rotation_z, transform
from duocell.optimizer.monitoring.events import Incumbent
from duocell.optimizer.results.findings import Alternative
from duocell.optimizer.results.layout import Baseline, BaselineArm, Layout
from duocell.optimizer.results.placement import Displacement, Placement
from duocell.service.common.issues import Issue
from duocell.service.common.numbers import finite
from duocell.service.common.version import package_version
from duocell.service.results.documents_findings import clearances, tolerance
from duocell.service.schemas import result as schemas


def result_document(layout: Layout, request_hash: str, warnings: Sequence[Issue] = ()) -> dict[str, Any]:
    """The ``result`` of a layout resource."""
    return schemas.LayoutResult.of(
        layout,
        jobs=layout.segments,
        arms=[_placement(placement) for placement in layout.placements],
        warnings=[schemas.ResultWarning.of(warning) for warning in warnings],
        baselines=[_baseline(baseline) for baseline in layout.baselines],
        clearances=clearances(layout.clearances),
        alternatives=[_alternative(alternative) for alternative in layout.alternatives],
        tolerance=None if layout.tolerance is None else tolerance(layout.tolerance),
        version=package_version(),
        request_hash=request_hash,
    ).model_dump(mode="json")


def incumbent_document(incumbent: Incumbent) -> dict[str, Any]:
    """The data of an event: a layout as in the result, without what its joints do."""
    return {
        "objective": finite(incumbent.objective),
        "time": incumbent.time,
        "arms": [
            {
                "name": arm.name,
                "base": _base(arm.position, arm.yaw, arm.mount).model_dump(mode="json"),
                "posture": arm.posture,
                "objective": finite(arm.objective),
            }
            for arm in incumbent.arms
        ],
    }


def _base(position: Iterable[float], yaw: float, mount: Floats) -> schemas.BasePlacement:
    """Base frame in the world, as numbers for a person and as a pose for a program."""
    origin = [float(value) for value in position]
    x, y, z, w = (float(value) for value in quaternion_from_rotation(mount))
    s, c = sin(0.5 * yaw), cos(0.5 * yaw)
    orientation = {"quaternion": [x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s]}
    pose = {"position": origin, "orientation": orientation}
    return schemas.BasePlacement.model_validate({"position": origin, "yaw": float(yaw), "pose": pose})


def _placement(placement: Placement) -> schemas.ArmResult:
    return schemas.ArmResult.of(
        placement,
        name=placement.arm,
        base=_base(placement.position, placement.yaw, placement.mount),
        mounting_face=_mounting_face(placement),
        joint_units=[kind.unit for kind in placement.joint_kinds] or len(placement.joint_margins) * ["rad"],
        linear_margins=[{"name": name, "margin": margin} for name, margin in placement.linear_margins],
        singularities="avoid" if placement.avoids_singularities else "allow",
        displacement=_displacement(placement.displacement),
    )


def _displacement(found: Displacement | None) -> dict[str, Any] | None:
    """What was chosen of what the poses leave open."""
    if found is None:
        return None
    quaternions = quaternion_from_rotation(found.tools[:, :3, :3]).tolist()
    tool = [
        {"position": position, "orientation": {"quaternion": quaternion}}
        for position, quaternion in zip(found.tools[:, :3, 3].tolist(), quaternions, strict=True)
    ]
    return {"parameters": list(found.names), "values": found.values.tolist(), "tool": tool}


def _mounting_face(placement: Placement) -> dict[str, Any] | None:
    """Pose of the face that is bolted down, in the world."""
    if placement.mounting_face is None:
        return None
    base = transform(placement.mount @ rotation_z(placement.yaw), placement.position)
    face = base @ placement.mounting_face
    quaternion = quaternion_from_rotation(face[:3, :3])
    return {"position": face[:3, 3].tolist(), "orientation": {"quaternion": quaternion.tolist()}}


def _alternative(alternative: Alternative) -> schemas.AlternativeResult:
    return schemas.AlternativeResult.of(
        alternative,
        arms=[_placement(placement) for placement in alternative.placements],
        clearances=clearances(alternative.clearances),
    )


def _baseline(baseline: Baseline) -> schemas.BaselineResult:
    return schemas.BaselineResult.of(baseline, arms=[_baseline_arm(arm) for arm in baseline.arms])


def _baseline_arm(arm: BaselineArm) -> schemas.BaselineArm:
    return schemas.BaselineArm.of(
        arm,
        base=_base(arm.position, arm.yaw, arm.mount),
        start=None if arm.start is None else _base(arm.start[:3], float(arm.start[3]), arm.mount),
    )
