"""From a layout to the JSON document of the contract. Numbers that are infinite (no limit, no margin) become null."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import cos, sin
from typing import Any

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import quaternion_from_rotation, rotation_z, transform
from duocell.optimizer.monitoring.events import Incumbent
from duocell.optimizer.results.findings import Alternative
from duocell.optimizer.results.layout import (
    ArmCertificate,
    Baseline,
    BaselineArm,
    Certificate,
    Layout,
    PenaltyCycle,
    Reason,
    SegmentShare,
    Verification,
)
from duocell.optimizer.results.placement import Placement
from duocell.service.common.issues import Issue
from duocell.service.common.numbers import finite
from duocell.service.common.version import package_version
from duocell.service.results.documents_findings import clearances_document, explanation_document, tolerance_document


def result_document(layout: Layout, request_hash: str, warnings: Sequence[Issue] = ()) -> dict[str, Any]:
    """The ``result`` of a layout resource."""
    return {
        "outcome": layout.outcome.value,
        "objective": finite(layout.objective),
        "jobs": [_segment(segment) for segment in layout.segments],
        "arms": [_placement(placement) for placement in layout.placements],
        "reasons": [_reason(reason) for reason in layout.reasons],
        "warnings": [{"pointer": warning.pointer, "detail": warning.detail} for warning in warnings],
        "proved": layout.proved,
        "search": {
            "candidates": layout.search.candidates,
            "starts": layout.search.starts,
            "basins": layout.search.basins,
            "wall_time": layout.search.wall_time,
            "ended": layout.search.ended,
            "first_feasible_time": finite(layout.search.first_feasible_time),
        },
        "certificate": _certificate(layout.certificate),
        "baselines": [_baseline(baseline) for baseline in layout.baselines],
        "clearances": clearances_document(layout.clearances),
        "alternatives": [_alternative(alternative) for alternative in layout.alternatives],
        "tolerance": tolerance_document(layout.tolerance),
        "explanation": explanation_document(layout.explanation),
        "verification": _verification(layout.verification),
        "version": package_version(),
        "request_hash": request_hash,
    }


def _numbers(values: Iterable[float]) -> list[float | None]:
    return [finite(value) for value in values]


def incumbent_document(incumbent: Incumbent) -> dict[str, Any]:
    """The data of an event: a layout as in the result, without what its joints do."""
    return {
        "objective": finite(incumbent.objective),
        "time": incumbent.time,
        "arms": [
            {
                "name": arm.name,
                "base": _base(arm.position, arm.yaw, arm.mount),
                "posture": arm.posture,
                "objective": finite(arm.objective),
            }
            for arm in incumbent.arms
        ],
    }


def _base(position: Iterable[float], yaw: float, mount: Floats) -> dict[str, Any]:
    """Base frame in the world, as numbers for a person and as a pose for a program."""
    origin = [float(value) for value in position]
    x, y, z, w = (float(value) for value in quaternion_from_rotation(mount))
    s, c = sin(0.5 * yaw), cos(0.5 * yaw)
    orientation = {"quaternion": [x * c + y * s, y * c - x * s, z * c + w * s, w * c - z * s]}
    return {"position": origin, "yaw": float(yaw), "pose": {"position": origin, "orientation": orientation}}


def _placement(placement: Placement) -> dict[str, Any]:
    return {
        "name": placement.arm,
        "base": _base(placement.position, placement.yaw, placement.mount),
        "mounting_face": _mounting_face(placement),
        "posture": placement.posture,
        "objective": finite(placement.objective),
        "joints": placement.joints.tolist(),
        "minimum_margin": finite(placement.minimum_margin),
        "joint_margins": _numbers(placement.joint_margins),
        "linear_margins": [{"name": name, "margin": margin} for name, margin in placement.linear_margins],
        "minimum_conditioning": finite(placement.minimum_conditioning),
        "characteristic_length": finite(placement.characteristic_length),
        "singularity_distances": {name: finite(value) for name, value in placement.singularity_distances.items()},
        "singularities": "avoid" if placement.avoids_singularities else "allow",
        "geometry": placement.geometry,
    }


def _mounting_face(placement: Placement) -> dict[str, Any] | None:
    """Pose of the face that is bolted down, in the world."""
    if placement.mounting_face is None:
        return None
    base = transform(placement.mount @ rotation_z(placement.yaw), placement.position)
    face = base @ placement.mounting_face
    quaternion = quaternion_from_rotation(face[:3, :3])
    return {"position": face[:3, 3].tolist(), "orientation": {"quaternion": quaternion.tolist()}}


def _alternative(alternative: Alternative) -> dict[str, Any]:
    return {
        "objective": finite(alternative.objective),
        "arms": [_placement(placement) for placement in alternative.placements],
        "clearances": clearances_document(alternative.clearances),
        "note": alternative.note,
    }


def _segment(segment: SegmentShare) -> dict[str, Any]:
    return {
        "name": segment.name,
        "first_pose": segment.first_pose,
        "poses": segment.poses,
        "weight": segment.weight,
        "objective": finite(segment.objective),
    }


def _reason(reason: Reason) -> dict[str, Any]:
    return {
        "arm": reason.arm,
        "kind": reason.kind,
        "poses": [int(pose) for pose in reason.poses],
        "joint": reason.joint,
        "amount": finite(reason.amount),
        "unit": reason.unit,
        "detail": reason.detail,
    }


def _certificate(certificate: Certificate | None) -> dict[str, Any] | None:
    if certificate is None:
        return None
    arms = [_arm_proof(arm) for arm in certificate.arms]
    return {**_proof(certificate), "ended": certificate.ended, "arms": arms}


def _arm_proof(certificate: ArmCertificate) -> dict[str, Any]:
    return {"arm": certificate.arm, **_proof(certificate), "note": certificate.note}


def _proof(certificate: Certificate | ArmCertificate) -> dict[str, Any]:
    """What the proof of a cell and that of an arm have in common."""
    return {
        "lower_bound": finite(certificate.lower_bound),
        "gap": finite(certificate.gap),
        "proved": certificate.proved,
        "boxes": certificate.boxes,
        "wall_time": certificate.wall_time,
    }


def _baseline(baseline: Baseline) -> dict[str, Any]:
    return {
        "method": baseline.method,
        "objective": finite(baseline.objective),
        "wall_time": baseline.wall_time,
        "feasible": baseline.feasible,
        "note": baseline.note,
        "arms": [_baseline_arm(arm) for arm in baseline.arms],
    }


def _baseline_arm(arm: BaselineArm) -> dict[str, Any]:
    return {
        "arm": arm.arm,
        "base": _base(arm.position, arm.yaw, arm.mount),
        "start": None if arm.start is None else _base(arm.start[:3], float(arm.start[3]), arm.mount),
        "posture": arm.posture,
        "objective": finite(arm.objective),
        "feasible": arm.feasible,
        "note": arm.note,
        "trace": [_cycle(cycle) for cycle in arm.trace],
    }


def _cycle(cycle: PenaltyCycle) -> dict[str, Any]:
    return {
        "phase": cycle.phase,
        "parameter": finite(cycle.parameter),
        "penalised": finite(cycle.penalised),
        "objective": finite(cycle.objective),
        "placement": [float(value) for value in cycle.placement],
        "worst": finite(cycle.worst),
        "iterations": cycle.iterations,
        "evaluations": cycle.evaluations,
    }


def _verification(verification: Verification | None) -> dict[str, Any] | None:
    return (
        None
        if verification is None
        else {
            "max_position_error": verification.max_position_error,
            "max_orientation_error": verification.max_orientation_error,
            "max_joint_step": verification.max_joint_step,
            "limits_respected": verification.limits_respected,
        }
    )
