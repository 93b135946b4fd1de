import copy
import json
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.lines import AxLine
from matplotlib.patches import Circle, Polygon, Rectangle

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import quaternion_from_rotation, rotation_z, transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.geometry.shapes import Body
from duocell.models.kinematics.kinematics import flange_poses
from duocell.service.figure.figure import arm_points, draw_layout, write_figure
from duocell.service.figure.figure_surroundings import outline
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate
from tests.support.given.solids import KINDS, random_pose, random_shape, support

TOOL = transform(rotation_z(0.3), [0.02, -0.01, 0.15])
BASES = {"main": ([0.2, 0.9, 0.1], -0.7), "follower": ([1.5, -0.1, 0.0], 2.2)}


def pose_document(pose: Floats) -> dict[str, Any]:
    quaternion = quaternion_from_rotation(pose[:3, :3]).tolist()
    return {"position": pose[:3, 3].tolist(), "orientation": {"quaternion": quaternion}}


@pytest.fixture
def resource() -> dict[str, Any]:
    """A layout made backwards: one arm's joints give the part's path, and the other arm just stands there."""
    puma = robot("puma560")
    joints = np.linspace([0.1, -0.4, 2.0, 0.3, 0.4, 0.1], [0.5, -0.6, 2.3, 0.1, 0.6, 0.3], 7)
    position, yaw = BASES["main"]
    part = transform(rotation_z(yaw), position) @ flange_poses(puma, joints) @ TOOL
    arms = [
        {
            "name": name,
            "robot": "puma560",
            "tool": pose_document(TOOL),
            "grasp": pose_document(np.eye(4)),
            "base": {"x": [-1.0, 2.0], "y": [-1.0, 2.0], "z": [0.0, 0.5], "yaw": [-3.1416, 3.1416]},
        }
        for name in BASES
    ]
    placed = [
        {"name": name, "base": {"position": position, "yaw": yaw}, "joints": joints.tolist()}
        for name, (position, yaw) in BASES.items()
    ]
    return {
        "request": {"name": "test", "task": {"poses": [pose_document(pose) for pose in part]}, "arms": arms},
        "result": {"outcome": "optimal", "objective": 12.347, "arms": placed},
    }


def drawn(resource: dict[str, Any]) -> Axes:
    cell = cell_of(validate(LayoutRequest, json.loads(json.dumps(resource["request"]))))
    return draw_layout(cell, resource["result"]).axes[0]


def texts(axes: Axes) -> str:
    return "\n".join([axes.get_title(loc="left"), *(text.get_text() for text in axes.texts)])


@pytest.mark.parametrize("name", ["puma560", "ur10e", "iiwa14"])
def test_a_stick_figure_ends_at_the_tool_centre_point(name: str) -> None:
    arm = robot(name)
    joints = np.random.default_rng(1).uniform(-1.5, 1.5, (5, arm.dof))
    points = arm_points(arm, joints, TOOL)
    assert points.shape == (5, arm.dof + 3, 3)
    assert np.allclose(points[:, 0], 0.0)
    assert np.allclose(points[:, -2], flange_poses(arm, joints)[:, :3, 3], atol=1e-12)
    assert np.allclose(points[:, -1], (flange_poses(arm, joints) @ TOOL)[:, :3, 3], atol=1e-12)


def test_an_arm_is_drawn_from_its_base_to_the_grasp_on_the_part(resource: dict[str, Any]) -> None:
    axes = drawn(resource)
    part = np.array([pose["position"] for pose in resource["request"]["task"]["poses"]])
    (strong,) = [line for line in axes.lines if line.get_label() == "main: puma560"]
    ends = np.asarray(strong.get_xydata())
    assert np.allclose(ends[0], BASES["main"][0][:2])
    assert np.allclose(ends[-1], part[len(part) // 2, :2], atol=1e-9)


def test_every_base_stands_where_the_result_says_with_its_numbers(resource: dict[str, Any]) -> None:
    axes = drawn(resource)
    discs = [patch.center for patch in axes.patches if isinstance(patch, Circle) and patch.radius < 0.1]
    assert discs == [tuple(position[:2]) for position, _ in BASES.values()]
    assert "main\nx 0.200  y 0.900  z 0.100 m\nyaw -40.1°" in texts(axes)
    assert "follower\nx 1.500  y -0.100  z 0.000 m\nyaw 126.1°" in texts(axes)
    assert "test: optimal, E = 12.35" in texts(axes)


def test_the_reach_circle_contains_every_flange_of_the_path(resource: dict[str, Any]) -> None:
    ring = max((p for p in drawn(resource).patches if isinstance(p, Circle)), key=lambda p: p.radius)
    cell = cell_of(validate(LayoutRequest, json.loads(json.dumps(resource["request"]))))
    flanges = cell.flange_targets(cell.arms[0])[:, :2, 3]
    assert np.all(np.linalg.norm(flanges - BASES["main"][0][:2], axis=1) < ring.radius)
    assert ring.radius < 1.0  # the source's longest reach is 0.934 m


def test_arms_that_share_a_region_share_its_rectangle(resource: dict[str, Any]) -> None:
    def rectangles() -> list[tuple[float, ...]]:
        found = [patch for patch in drawn(resource).patches if isinstance(patch, Rectangle)]
        return [(*patch.get_xy(), patch.get_width(), patch.get_height()) for patch in found]

    assert rectangles() == [(-1.0, -1.0, 3.0, 3.0)]
    resource["request"]["arms"][1]["base"]["x"] = [0.5, 2.5]
    assert rectangles() == [(-1.0, -1.0, 3.0, 3.0), (0.5, -1.0, 2.0, 3.0)]
    resource["request"]["arms"][1]["base"] |= {"x": 1.5, "y": -0.1}
    assert rectangles() == [(-1.0, -1.0, 3.0, 3.0)]


def test_an_infeasible_layout_shows_what_there_is(resource: dict[str, Any]) -> None:
    resource["result"] = {"outcome": "infeasible", "objective": None, "arms": resource["result"]["arms"][1:]}
    axes = drawn(resource)
    assert "test: infeasible  (from above)" in texts(axes)
    labels = {line.get_label() for line in axes.lines}
    assert "follower: puma560" in labels
    assert "main: puma560" not in labels
    assert "reach of the flange at task height" in {patch.get_label() for patch in axes.patches}


def test_the_region_without_a_place_is_in_the_picture(resource: dict[str, Any]) -> None:
    resource["result"] = {"outcome": "infeasible", "objective": None, "arms": resource["result"]["arms"][1:]}
    resource["request"]["arms"][0]["base"] |= {"x": [4.0, 5.0], "y": [3.0, 6.0]}
    axes = drawn(resource)
    assert axes.get_xlim()[0] < 0.5 < 5.0 < axes.get_xlim()[1]
    assert axes.get_ylim()[1] > 6.0


def test_the_ends_of_the_path_are_numbered_as_in_the_answer(resource: dict[str, Any]) -> None:
    count = len(resource["request"]["task"]["poses"])
    assert [text.get_text() for text in drawn(resource).texts[-2:]] == ["0", str(count - 1)]


@pytest.mark.parametrize("suffix", [".svg", ".png", ".pdf"])
def test_the_same_layout_gives_the_same_file(resource: dict[str, Any], tmp_path: Path, suffix: str) -> None:
    first, second = tmp_path / f"a{suffix}", tmp_path / f"b{suffix}"
    write_figure(resource, first)
    write_figure(copy.deepcopy(resource), second)
    assert first.read_bytes() == second.read_bytes()
    assert first.stat().st_size > 5000


def test_the_svg_holds_its_text_as_text(resource: dict[str, Any], tmp_path: Path) -> None:
    resource["request"]["name"] = "50 $ & <more>, with $half a formula"
    write_figure(resource, tmp_path / "layout.svg")
    root = ElementTree.parse(tmp_path / "layout.svg").getroot()
    text = " ".join("".join(node.itertext()) for node in root.iter("{http://www.w3.org/2000/svg}text"))
    assert "50 $ & <more>, with $half a formula" in text
    assert "yaw -40.1°" in text


def test_an_unknown_format_is_refused(resource: dict[str, Any], tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="xyz"):
        write_figure(resource, tmp_path / "layout.xyz")


def test_the_picture_shows_every_placed_arm_with_its_reach(resource: dict[str, Any]) -> None:
    axes = drawn(resource)
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    assert np.isclose(right - left, top - bottom)
    for ring in (patch for patch in axes.patches if isinstance(patch, Circle)):
        (x, y), radius = ring.center, ring.radius
        assert left < x - radius
        assert x + radius < right
        assert bottom < y - radius
        assert y + radius < top


def test_without_placements_the_picture_shows_the_regions(resource: dict[str, Any]) -> None:
    resource["result"] = {"outcome": "infeasible", "objective": None, "arms": []}
    axes = drawn(resource)
    assert axes.get_xlim()[0] < -1.0
    assert axes.get_xlim()[1] > 2.0


# --- what else stands there -------------------------------------------------------------------------------------------

TABLE = {"type": "box", "size": [0.6, 0.4, 0.8]}
PIT = [[3.0, 3.0], [4.0, 3.0], [4.0, 4.0]]


def outlines(axes: Axes) -> list[Floats]:
    return [patch.get_xy()[:-1] for patch in axes.patches if isinstance(patch, Polygon)]


def some_outline(axes: Axes, corners: Any) -> bool:
    """Whether a polygon with these corners is drawn, wherever it begins."""
    wanted = np.array(corners)
    return any(
        len(found) == len(wanted) and all(np.min(np.linalg.norm(found - corner, axis=1)) < 1e-6 for corner in wanted)
        for found in outlines(axes)
    )


def rectangle(x: float, y: float, half: tuple[float, float], angle: float) -> Floats:
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * half
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    placed: Floats = corners @ turn.T + [x, y]
    return placed


def test_obstacles_floor_pedestals_and_part_are_seen_from_above(resource: dict[str, Any]) -> None:
    request = resource["request"]
    turned = {"position": [0.5, -0.5, 0.4], "orientation": {"rpy": [0.0, 0.0, 0.5]}}
    upright = {"position": [0.5, -0.5, 0.4], "orientation": {"rpy": [np.pi / 2, 0.0, 0.0]}}
    request["obstacles"] = [
        {"name": "table", "pose": turned, "shape": TABLE},
        {"name": "floor", "shape": {"type": "half_space"}},
        {"name": "wall", "pose": upright, "shape": {"type": "half_space"}},
    ]
    request["floor"] = {"allowed": [[-3, -3], [3, -3], [3, 3]], "forbidden": [PIT, [[5, 5], [6, 5], [6, 6]]]}
    request["arms"][0]["pedestal"] = {"foot": -0.001, "footprint": {"size": [0.4, 0.3]}}
    request["part"] = {"shapes": [{"shape": {"type": "box", "size": [0.2, 0.1, 0.05]}}]}
    axes = drawn(resource)
    assert some_outline(axes, rectangle(0.5, -0.5, (0.3, 0.2), 0.5))
    assert some_outline(axes, rectangle(0.2, 0.9, (0.2, 0.15), -0.7))
    assert some_outline(axes, PIT)
    assert some_outline(axes, [[-3, -3], [3, -3], [3, 3]])
    labels = [patch.get_label() for patch in axes.patches]
    assert [labels.count(name) for name in ("obstacles", "allowed floor", "forbidden floor")] == [1, 1, 1]
    assert "table" in texts(axes)
    (wall,) = [line for line in axes.lines if isinstance(line, AxLine)]
    first, second = wall.get_xy1(), wall.get_xy2()
    assert first is not None
    assert second is not None
    assert first[1] == second[1] == -0.5
    part = np.array([pose["position"] for pose in request["task"]["poses"]])
    for index in (0, len(part) // 2, len(part) - 1):
        assert any(np.linalg.norm(found.mean(axis=0) - part[index, :2]) < 1e-9 for found in outlines(axes))


@pytest.mark.parametrize("kind", KINDS)
def test_the_shadow_of_a_shape_reaches_as_far_as_the_shape(kind: type) -> None:
    rng = np.random.default_rng(7)
    directions = np.column_stack([np.cos(np.arange(12.0)), np.sin(np.arange(12.0)), np.zeros(12)])
    for _ in range(10):
        body = Body("thing", random_pose(rng), random_shape(kind, rng))
        frame = random_pose(rng)
        shadow = outline(body, frame)
        reach = support(body.shape, frame @ body.pose, directions)
        seen = np.max(directions[:, :2] @ shadow.T, axis=1)
        assert np.all(seen <= reach + 1e-9)
        assert np.all(seen >= reach - 3e-3)  # circles have 48 corners


def test_an_arm_on_the_ceiling_is_drawn_where_it_hangs(resource: dict[str, Any]) -> None:
    request = resource["request"]
    request["arms"][0]["mount"] = {"roll": 3.141592653589793}
    axes = drawn(resource)
    (strong,) = [line for line in axes.lines if line.get_label() == "main: puma560"]
    joints = np.array(resource["result"]["arms"][0]["joints"])[3:4]
    base = np.diag([1.0, -1.0, -1.0]) @ rotation_z(-0.7)
    points = arm_points(robot("puma560"), joints, TOOL)[0] @ base.T + [0.2, 0.9, 0.1]
    np.testing.assert_allclose(np.asarray(strong.get_xydata()), points[:, :2], atol=1e-12)
