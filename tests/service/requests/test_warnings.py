"""Slips that can be carried out are told beside the result; a request without any has no warnings."""

import copy
from typing import Any

import pytest

from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout, Outcome, Search
from duocell.service.requests.convert import cell_of
from duocell.service.requests.warnings import warnings_of
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.validation import validate

Document = dict[str, Any]
NOTHING = Layout(Outcome.UNKNOWN, None, (), (), Search(0, 0, 0, 0.0), None)
HAND = {"position": [0.0, 0.0, 0.1], "orientation": {"rpy": [0, 0, 0]}}


def request_of(**arm: Any) -> LayoutRequest:
    document = copy.deepcopy(EXAMPLE)
    for one in document["arms"]:
        one |= {"tool": HAND}
    document["arms"][0] |= arm
    return validate(LayoutRequest, document)


def told(request: LayoutRequest, layout: Layout = NOTHING) -> dict[str, str]:
    return {issue.pointer: issue.detail for issue in warnings_of(request, cell_of(request), layout)}


def test_a_request_without_slips_has_no_warnings() -> None:
    assert told(request_of()) == {}


GRASP = {"position": [0.0, 3.0, 4.0], "orientation": {"rpy": [0, 0, 0]}}
SLIPS: dict[str, tuple[Document, str, str]] = {
    "a region in millimetres": (
        {"base": {"x": [-1000, 1000], "y": [0, 500], "z": 0, "yaw": 0}},
        "/arms/0/base/x",
        "mean -1 m (-1000 mm)",
    ),
    "limits in degrees": (
        {"limits": [[-45, 45]] * 6, "reference": [0.0] * 6},
        "/arms/0/limits/3",
        "mean -0.785398 rad (-45°)",
    ),
    "no tool": ({"tool": {"position": [0, 0, 0], "orientation": {"rpy": [0, 0, 0]}}}, "/arms/0/tool", "no length"),
    "a grasp in the world": ({"grasp": GRASP}, "/arms/0/grasp/position", "5 m away"),
}


@pytest.mark.parametrize("name", SLIPS)
def test_slips_are_told_at_their_place(name: str) -> None:
    arm, pointer, words = SLIPS[name]
    found = told(request_of(**arm))
    assert pointer in found, found
    assert words in found[pointer]


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_a_flange_that_is_turned_is_told(sense: float) -> None:
    """Of a robot that has no known flange; whichever way its last axis points."""
    dh = [{"alpha": a, "a": 0.3, "d": 0.1, "lower": -2, "upper": 2} for a in (1.5708, 0, 1.5708, -1.5708, 1.5708)]
    turned = [*dh, {"alpha": sense * 1.5708, "a": 0.3, "d": 0.1, "lower": -2, "upper": 2}]
    assert "does not lie along the axis" in told(request_of(robot={"dh": turned}, reference=None))["/arms/0/robot"]
    straight = [*dh, {"alpha": 0.0 if sense > 0.0 else 3.14159265358979, "a": 0.0, "d": 0.1, "lower": -2, "upper": 2}]
    assert told(request_of(robot={"dh": straight}, reference=None)) == {}


def test_usual_flanges_of_the_catalogue_are_no_slip() -> None:
    """Also where its last axis points into the robot, as of gp8."""
    arm = {key: value for key, value in EXAMPLE["arms"][0].items() if key in ("name", "grasp", "base")}
    for name in ("gp8", "kr210_r2700", "irb120", "fanuc_crx10ial", "franka_panda", "puma560"):
        request = validate(LayoutRequest, EXAMPLE | {"arms": [arm | {"robot": name, "tool": HAND}]})
        assert "/arms/0/robot" not in told(request), name


@pytest.mark.parametrize(
    ("robot", "flange", "out"),
    [("irb120", "link_6", "[1, 0, 0]"), ("gp8", "link_6_t", "[1, 0, 0]"), ("kr210_r2700", "link_6", "[0, 0, -1]")],
)
def test_another_flange_says_where_its_outside_is(robot: str, flange: str, out: str) -> None:
    found = told(request_of(robot=robot, flange=flange, reference=None, limits=None))
    assert f"that is {out} there" in found["/arms/0/flange"]


SQUARE = {"type": "box", "size": [0.6, 0.6, 0.3]}
FAR_BODIES: dict[str, tuple[Document, str, str]] = {
    "an obstacle in millimetres": (
        {"obstacles": [{"name": "table", "pose": {**HAND, "position": [500, 0, 200]}, "shape": SQUARE}]},
        "/obstacles/0/pose/position",
        "mean 0.5 m (500 mm)",
    ),
    "the size of a part in millimetres": (
        {"part": {"shapes": [{"shape": {"type": "cylinder", "radius": 50, "length": 300}}]}},
        "/part/shapes/0/shape/length",
        "mean 0.3 m (300 mm)",
    ),
}


@pytest.mark.parametrize("name", FAR_BODIES)
def test_solids_in_millimetres_are_told(name: str) -> None:
    more, pointer, words = FAR_BODIES[name]
    request = request_of()
    found = told(validate(LayoutRequest, request.model_dump(exclude_unset=True) | more))
    assert words in found[pointer]


def test_a_hall_is_no_slip() -> None:
    wall = {"name": "wall", "pose": {**HAND, "position": [0, 15, 2]}, "shape": {"type": "box", "size": [60, 0.2, 4]}}
    assert told(validate(LayoutRequest, request_of().model_dump(exclude_unset=True) | {"obstacles": [wall]})) == {}


def test_a_pedestal_in_millimetres_is_told() -> None:
    base = {"x": 0.0, "y": 0.0, "z": 0.5, "yaw": 0.0}
    hung = {"roll": 3.14159, "pitch": 0.0}
    found = told(request_of(base=base, mount=hung, pedestal={"height": 500, "footprint": {"size": [0.4, 0.4]}}))
    assert "mean 0.5 m (500 mm)" in found["/arms/0/pedestal/height"]


def test_a_base_region_beside_the_task_is_told_with_the_place_of_the_task() -> None:
    request = request_of(base={"x": [6.0, 7.0], "y": [0.0, 1.0], "z": 0.0, "yaw": 0.0})
    found = told(request, optimize(cell_of(request)))
    assert "No pose is within reach from where this base may stand" in found["/arms/0/base"]
    assert "/arms/1/base" not in found
