"""From layouts to documents."""

import json
from dataclasses import replace
from math import cos, inf, pi, sin
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from duocell.models.base.pose import rotation_from_quaternion, rotation_x, rotation_z
from duocell.optimizer.monitoring.events import Incumbent, Standing
from duocell.optimizer.results.findings import Alternative, Clearance, Explanation, Relaxation, Tolerance
from duocell.optimizer.results.layout import (
    ArmCertificate,
    Baseline,
    BaselineArm,
    Certificate,
    Layout,
    Outcome,
    PenaltyCycle,
    Reason,
    Search,
    SegmentShare,
    Verification,
)
from duocell.optimizer.results.placement import Placement
from duocell.service.common.issues import Issue
from duocell.service.common.version import package_version
from duocell.service.results.documents import incumbent_document, result_document
from duocell.service.schemas.result import LayoutResult

PLACEMENT = Placement(
    arm="main",
    position=np.array([1.0, 2.0, 3.0]),
    yaw=4.0,
    joints=np.arange(12.0).reshape(2, 6),
    posture={"elbow": "up"},
    objective=5.0,
    joint_margins=np.array([inf] * 6),
    minimum_margin=inf,
    minimum_conditioning=0.1,
    characteristic_length=0.4,
    singularity_distances={"elbow": 0.2},
)
BASELINE_ARM = BaselineArm(
    arm="main",
    position=np.zeros(3),
    yaw=0.1,
    objective=inf,
    feasible=False,
    start=np.ones(4),
    posture={"elbow": "up"},
    trace=(PenaltyCycle("interior", 0.3, inf, None, np.zeros(4), -0.1, 3, 9),),
    note="the start is infeasible",
)
CLEARANCE = Clearance("self", 0.01, 0.02, "main link 1", "main tool", 3, 0.25, None, False)
FULL = Layout(
    outcome=Outcome.OPTIMAL,
    objective=5.0,
    placements=(PLACEMENT,),
    reasons=(),
    search=Search(1, 2, 3, 4.0),
    verification=Verification(1e-9, 2e-9, 0.5, True),
    certificate=Certificate(4.9, 0.02, False, 7, 0.1, (ArmCertificate("main", None, None, False, 7, 0.1, "none yet"),)),
    baselines=(Baseline("interior-penalty", None, 0.2, False, (BASELINE_ARM,), "none"),),
    segments=(SegmentShare("a", 0, 2, 1.0, 5.0), SegmentShare("b", 2, 3, 0.0, None)),
    clearances=(CLEARANCE,),
    alternatives=(Alternative(6.0, (PLACEMENT,), (CLEARANCE,), "farther from everything"),),
    tolerance=Tolerance(0.002, 0.001, 64, 1.0, inf, inf, {"self": 0.019, "arm_arm": inf}, inf, "nothing breaks"),
)
INFEASIBLE = Layout(
    outcome=Outcome.INFEASIBLE,
    objective=None,
    placements=(),
    reasons=(Reason("main", "out_of_reach", (0, 1), "Too far.", None, 0.5, "m"),),
    search=Search(1, 0, 0, 0.1),
    verification=None,
    explanation=Explanation(("the region of main",), True, (Relaxation("allow more", "/arms/0/base/x", 7.0),)),
)


@pytest.mark.parametrize("layout", [FULL, INFEASIBLE], ids=["full", "infeasible"])
def test_a_document_is_plain_json_and_fits_the_published_schema(layout: Layout) -> None:
    document = result_document(layout, "hash")
    text = json.dumps(document, allow_nan=False)
    assert LayoutResult.model_validate_json(text).model_dump() == document


def test_what_is_infinite_is_null() -> None:
    arm = result_document(FULL, "")["arms"][0]
    assert arm["minimum_margin"] is None
    assert arm["joint_margins"] == [None] * 6


def test_every_class_of_clearances_is_there() -> None:
    document = result_document(FULL, "")
    assert document["clearances"] == {
        "arm_arm": None,
        "arm_part": None,
        "arm_obstacle": None,
        "part_obstacle": None,
        "self": {
            "required": 0.01,
            "distance": 0.02,
            "pair": ["main link 1", "main tool"],
            "pose": 3,
            "fraction": 0.25,
            "lower_bound": None,
            "certain": False,
        },
    }
    assert document["alternatives"][0]["clearances"] == document["clearances"]
    assert document["tolerance"]["clearances"]["self"] == 0.019
    assert document["tolerance"]["clearances"]["arm_arm"] is None
    assert result_document(INFEASIBLE, "")["explanation"]["relaxations"][0]["pointer"] == "/arms/0/base/x"
    assert document["explanation"] is None


@pytest.mark.parametrize("roll", [0.0, 0.5, pi, -pi / 2])
def test_the_pose_of_a_mounted_base_is_its_mount_and_then_its_yaw(roll: float) -> None:
    mount = rotation_x(roll)
    layout = replace(
        FULL,
        placements=(replace(PLACEMENT, mount=mount),),
        baselines=(Baseline("exterior-penalty", None, 0.2, False, (replace(BASELINE_ARM, mount=mount),)),),
    )
    document = result_document(layout, "")
    for base, yaw in (
        (document["arms"][0]["base"], 4.0),
        (document["baselines"][0]["arms"][0]["base"], 0.1),
        (document["baselines"][0]["arms"][0]["start"], 1.0),
    ):
        quaternion = base["pose"]["orientation"]["quaternion"]
        np.testing.assert_allclose(rotation_from_quaternion(quaternion), mount @ rotation_z(yaw), atol=1e-12)


def test_the_pose_of_a_base_agrees_with_its_yaw() -> None:
    base: Any = result_document(FULL, "")["arms"][0]["base"]
    assert base["position"] == base["pose"]["position"] == [1.0, 2.0, 3.0]
    assert base["pose"]["orientation"]["quaternion"] == [0.0, 0.0, sin(2.0), cos(2.0)]
    for yaw in (-pi, -1.0, 0.0, 2.0, 6.0):
        quaternion = np.array([0.0, 0.0, sin(yaw / 2), cos(yaw / 2)])
        np.testing.assert_allclose(rotation_from_quaternion(quaternion), rotation_z(yaw), atol=1e-12)


def test_the_mounting_face_is_where_the_base_carries_it() -> None:
    face = np.eye(4)
    face[:3, :3], face[:3, 3] = Rotation.from_euler("x", 0.3).as_matrix(), [0.0, 0.1, -0.2]
    layout = replace(FULL, placements=(replace(PLACEMENT, mount=rotation_x(0.5), mounting_face=face),))
    found = result_document(layout, "")["arms"][0]["mounting_face"]
    turn = Rotation.from_euler("x", 0.5) * Rotation.from_euler("z", 4.0)
    np.testing.assert_allclose(found["position"], PLACEMENT.position + turn.apply([0.0, 0.1, -0.2]), atol=1e-12)
    expected = (turn * Rotation.from_euler("x", 0.3)).as_matrix()
    np.testing.assert_allclose(rotation_from_quaternion(found["orientation"]["quaternion"]), expected, atol=1e-12)
    assert result_document(FULL, "")["arms"][0]["mounting_face"] is None


def test_linear_limits_and_the_rule_for_singularities_are_told() -> None:
    asked = replace(PLACEMENT, linear_margins=(("both", 0.3), ("other", 0.1)), avoids_singularities=False)
    (arm,) = result_document(replace(FULL, placements=(asked,)), "")["arms"]
    assert arm["linear_margins"] == [{"name": "both", "margin": 0.3}, {"name": "other", "margin": 0.1}]
    assert arm["singularities"] == "allow"
    assert result_document(FULL, "")["arms"][0]["singularities"] == "avoid"


def test_what_was_asked_and_by_whom_it_was_answered_stands_in_a_result() -> None:
    warning = Issue("/arms/0/base", "The base is far from the task.")
    document = result_document(FULL, "hash", [warning])
    assert (document["request_hash"], document["version"]) == ("hash", package_version())
    assert [one["pointer"] for one in document["warnings"]] == ["/arms/0/base"]
    assert [segment["name"] for segment in document["jobs"]] == ["a", "b"]


def test_a_baseline_without_a_start_tells_none() -> None:
    arm = replace(BASELINE_ARM, start=None)
    baselines = (Baseline("interior-penalty", None, 0.2, False, (arm,), "none"),)
    (shown,) = result_document(replace(FULL, baselines=baselines), "")["baselines"][0]["arms"]
    assert shown["start"] is None
    assert shown["base"]["yaw"] == 0.1


def test_a_layout_on_the_way_is_told_by_where_its_arms_stand() -> None:
    standing = Standing("main", (1.0, 2.0, 3.0), 4.0, {"elbow": "up"}, inf, rotation_x(0.5))
    found = incumbent_document(Incumbent(inf, 0.25, (standing,)))
    assert (found["objective"], found["time"]) == (None, 0.25)
    (arm,) = found["arms"]
    assert (arm["name"], arm["posture"], arm["objective"]) == ("main", {"elbow": "up"}, None)
    layout = replace(FULL, placements=(replace(PLACEMENT, mount=rotation_x(0.5)),))
    assert arm["base"] == result_document(layout, "")["arms"][0]["base"]
    assert json.loads(json.dumps(found, allow_nan=False)) == found
