"""Which end of the robot a tool is attached to, and which face is bolted down."""

from __future__ import annotations

import copy
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from duocell.models.base.pose import quaternion_from_rotation, rotation_from_rpy, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.robot.robot_frames import ISO_9787
from duocell.service.common.issues import InvalidRequest
from duocell.service.requests.convert import cell_of
from duocell.service.results.documents import result_document
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.validation import validate
from tests.service.conftest import made_up_layout

Document = dict[str, Any]
TOOL = {"position": [0.01, 0.02, 0.15], "orientation": {"rpy": [0.3, -0.2, 0.5]}}
SOLID = {"shape": {"type": "box", "size": [0.1, 0.2, 0.3]}, "pose": TOOL}
TURNED = ("irb120", "lrmate200id", "gp8", "kr210_r2700", "ur5", "z1")


def asked(name: str, **given: Any) -> Document:
    document = copy.deepcopy(EXAMPLE) | {"arms": [EXAMPLE["arms"][0] | {"robot": name, "tool": TOOL} | given]}
    document["arms"][0].pop("posture", None)
    document["arms"][0]["reference"] = None
    return document


def arm_and_solids(document: Document) -> Any:
    cell = cell_of(validate(LayoutRequest, document))
    return cell.arms[0], cell.surroundings.of(cell.arms[0].name).tool


@pytest.mark.parametrize("name", TURNED)
def test_the_same_tool_told_in_either_frame_is_the_same(name: str) -> None:
    """In the last frame of the description, and, re-expressed here, in that of ISO 9787, which needs no name."""
    last, solids = arm_and_solids(asked(name, flange=robot(name).flange_frame, tool_shapes=[SOLID]))
    into_iso = np.linalg.inv(robot(name).flange()) @ last.tool
    retold = {
        "position": into_iso[:3, 3].tolist(),
        "orientation": {"quaternion": quaternion_from_rotation(into_iso[:3, :3]).tolist()},
    }
    for named in (None, ISO_9787):
        iso, moved = arm_and_solids(asked(name, tool=retold, flange=named, tool_shapes=[SOLID | {"pose": retold}]))
        np.testing.assert_allclose(iso.tool, last.tool, atol=1e-12)
        np.testing.assert_allclose(moved[0].pose, solids[0].pose, atol=1e-12)
    np.testing.assert_allclose(last.tool, solids[0].pose, atol=1e-12)


def test_a_flange_that_the_robot_lacks_is_refused_once() -> None:
    with pytest.raises(InvalidRequest) as caught:
        arm_and_solids(asked("irb120", flange="tool0", tool_shapes=[SOLID]))
    assert [issue.pointer for issue in caught.value.issues] == ["/arms/0/flange"]
    assert "iso9787 and link_6" in caught.value.issues[0].detail


def test_a_table_has_the_one_flange_it_ends_with() -> None:
    rows = [
        {"alpha": a, "a": 0.1 * i, "d": 0.3, "lower": -2.0, "upper": 2.0}
        for i, a in enumerate((-1.57, 0.0, 1.57, -1.57, 1.57, 0.0))
    ]
    arm, _ = arm_and_solids(asked("ur5e", robot={"dh": rows}))
    named, _ = arm_and_solids(asked("ur5e", robot={"dh": rows}, flange=arm.robot.flange_frame))
    np.testing.assert_array_equal(arm.tool, named.tool)


def test_a_robot_shows_its_frames_with_their_sources(client: TestClient) -> None:
    shown = client.get("/v1/robots/kr210_r2700").json()
    iso, last = shown["flanges"]
    assert (iso["name"], last["name"]) == (ISO_9787, shown["flange_frame"])
    assert last["pose"]["position"] == pytest.approx(shown["flange_at_zero"]["position"])
    beyond = np.array(iso["pose"]["position"]) - last["pose"]["position"]
    np.testing.assert_allclose(beyond, [0.215, 0.0, 0.0], atol=1e-12)
    assert iso["source"]
    assert iso["checked"]
    assert shown["mounting_face"]["pose"]["position"] == [0.0, 0.0, 0.0]
    assert client.get("/v1/robots/puma560").json()["mounting_face"] is None


def test_a_layout_tells_where_the_mounting_face_is() -> None:
    layout = made_up_layout(validate(LayoutRequest, EXAMPLE))
    hanging = replace(
        layout.placements[0], mount=rotation_from_rpy([3.0, 0.1, 0.0]), mounting_face=transform(np.eye(3), [0, 0, -0.1])
    )
    known, unknown = result_document(replace(layout, placements=(hanging, layout.placements[1])), "")["arms"]
    pose = known["base"]["pose"]
    up = np.array(known["mounting_face"]["position"]) - pose["position"]
    assert np.linalg.norm(up) == pytest.approx(0.1)
    assert up[2] > 0.09  # it hangs: the face is above
    there = known["mounting_face"]["orientation"]["quaternion"]
    assert abs(np.dot(there, pose["orientation"]["quaternion"])) == pytest.approx(1.0)
    assert unknown["mounting_face"] is None
