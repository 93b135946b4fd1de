"""docs/architecture.md says what there is: rooms, their picture, the way of a request, and places to look at."""

import importlib.util
import json
import re
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from itertools import pairwise
from math import atan2, cos, pi, sin
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any
from xml.etree import ElementTree

import grimp
import numpy as np
import pytest

from duocell.optimizer.nlp import solve as nlp_solve
from duocell.service.requests import convert_pose
from duocell.service.requests.accept import accept
from duocell.service.requests.prepared import read_accepted
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Limits
from duocell.service.workers.solving import solve_request

ROOT = Path(__file__).parents[2]
PAGE, PICTURE = ROOT / "docs" / "architecture.md", ROOT / "docs" / "rooms.svg"
TEXT = PAGE.read_text(encoding="utf-8")
FLOORS = ("service", "optimizer", "models")
WAY = re.findall(r"^(\d+)\. (\*\*)?`([\w/]+\.py)`", TEXT, re.M)
ON_LOOKERS = re.findall(r"^- `([\w/]+\.py)`: ", TEXT.split("### Look")[1].split("\n## ")[0], re.M)
NUMBERS = {"six": 6, "seven": 7, "eight": 8}
MOST = 15
"""Files on the way of a request: what the project has set itself."""
POSES, HEIGHT = 13, 0.1015625
"""Of the requests that are watched, and m; nothing else there comes in thirteens or has this height."""


@pytest.fixture(scope="module")
def drawing() -> ModuleType:
    spec = importlib.util.spec_from_file_location("draw_rooms", ROOT / ".ci" / "draw_rooms.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules["draw_rooms"] = module  # dataclasses look themselves up
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("duocell", cache_dir=None)


# --- rooms and picture ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("floor", FLOORS)
def test_every_room_has_its_line(floor: str) -> None:
    (section,) = re.findall(rf"^### {floor}/\n(.*?)(?=^##)", TEXT, re.M | re.S)
    lines = re.findall(r"^\| `([\w.]+)` \| [A-Z].*\. \|$", section, re.M)
    files = {path.name for path in (ROOT / floor).glob("*.py")} - {"__init__.py"}
    rooms = {path.parent.name for path in (ROOT / floor).glob("*/__init__.py")}
    assert sorted(lines) == sorted(files | rooms)


def test_the_picture_shows_the_rooms_and_arrows_of_today(drawing: ModuleType, graph: grimp.ImportGraph) -> None:
    shown = list(ElementTree.parse(PICTURE).iter())
    rooms = drawing.imports(graph)
    assert {one.get("data-room") for one in shown} - {None} == set(rooms), "make rooms"
    arrows = {(one.get("data-from"), one.get("data-to")) for one in shown if one.get("data-from")}
    assert arrows == drawing.arrows(rooms), "make rooms"


def test_arrows_of_the_picture_are_imports_and_all_imports_follow_from_them(
    drawing: ModuleType, graph: grimp.ImportGraph
) -> None:
    found: dict[str, set[str]] = {}
    for module in graph.modules:
        for other in graph.find_modules_directly_imported_by(module):
            ends = [".".join(name.split(".")[1:3]) for name in (module, other)]
            if ends[0] != ends[1] and "." in ends[0] and "." in ends[1]:
                found.setdefault(ends[0], set()).add(ends[1])
    arrows: set[tuple[str, str]] = drawing.arrows(drawing.imports(graph))
    assert all(end in found[start] for start, end in arrows)
    below = {start: {end for other, end in arrows if other == start} for start, _ in arrows}
    for _ in range(len(below)):
        for ends_of in below.values():
            ends_of.update(*(below.get(end, set()) for end in ends_of))
    assert all(ends_of <= below[start] for start, ends_of in found.items())
    assert len(arrows) < 150


def test_an_arrow_that_follows_from_others_is_left_out(drawing: ModuleType) -> None:
    rooms = {"a.x": {"a.y", "a.z", "b.w"}, "a.y": {"a.z"}, "a.z": {"b.w"}, "b.w": set()}
    assert drawing.arrows(rooms) == {("a.x", "a.y"), ("a.y", "a.z"), ("a.z", "b.w")}


def test_nothing_of_the_picture_overlaps(drawing: ModuleType, graph: grimp.ImportGraph) -> None:
    placed = drawing.placed(drawing.imports(graph))
    for row in placed.rows:
        ends = [
            (placed.x[name] - drawing.width(name) / 2.0, placed.x[name] + drawing.width(name) / 2.0) for name in row
        ]
        assert all(end < start for (_, end), (start, _) in pairwise(ends))
    height = {name: y for y, row in zip(placed.y, placed.rows, strict=True) for name in row}
    assert all(height[start] < height[end] for start, end in placed.ways)


# --- files ------------------------------------------------------------------------------------------------------------


def test_every_file_that_is_named_exists() -> None:
    named = re.findall(r"`((?:service|optimizer|models|src|tests|docs|bench)/[\w./-]*|[\w-]+\.(?:toml|md))`", TEXT)
    assert len(named) > 80
    assert [name for name in named if not (ROOT / name).exists()] == []


def test_every_name_that_is_said_to_stand_in_a_file_does() -> None:
    named = re.findall(r"`(\S+\.py)`(?:: | \()`(\w+)`", TEXT)
    assert len(named) > 6
    for file, name in named:
        assert re.search(rf"\b{name}\b", (ROOT / file).read_text()), f"{name} in {file}"


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", TEXT):
        assert (PAGE.parent / target).exists(), target


# --- the way of a request ---------------------------------------------------------------------------------------------


class IpoptIsCalled(BaseException):
    """The way has come to its end; nothing on it takes this for an error."""


def bodies() -> list[bytes]:
    """Requests for one arm: poses in every format, a line, and a task sequence."""
    request = json.loads((ROOT / "examples" / "line.json").read_text())
    request = {**request, "arms": request["arms"][:1], "certificate": None}
    path = request.pop("task")["line"]
    line = {"line": path | {"count": POSES}}
    accepted = accept(json.dumps(request | {"task": line}).encode(), Limits())
    _, cell = read_accepted(LayoutRequest, accepted.prepared)
    poses = [
        {"position": [*pose[:2, 3].tolist(), HEIGHT], "orientation": turned(k, atan2(pose[1, 0], pose[0, 0]))}
        for k, pose in enumerate(cell.task.poses)
    ]
    segments = [{"name": "poses", "task": {"poses": poses}}, {"name": "line", "task": line}]
    return [
        json.dumps(request | some).encode()
        for some in ({"task": {"poses": poses}}, {"task": line}, {"tasks": segments})
    ]


def turned(k: int, angle: float) -> dict[str, Any]:
    """A turn about z as an orientation, in one format after the other."""
    s, c = sin(angle), cos(angle)
    forms: list[dict[str, Any]] = [
        {"quaternion": [0.0, 0.0, sin(angle / 2.0), cos(angle / 2.0)]},
        {"matrix": [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]]},
        {"rpy": [0.0, 0.0, angle]},
        {"euler_zyz": [angle, 0.0, 0.0]},
        {"oat": [angle + pi / 2.0, pi / 2.0, 0.0]},
    ]
    return forms[k % len(forms)]


def are_poses(value: Any) -> bool:
    """Whether a value is poses: a list of them, an array with an axis for them, or one as a document."""
    if isinstance(value, np.ndarray):
        shape = value.shape
        many = any(size in (POSES, 2 * POSES) for size in shape)
        return many and (shape[-2:] in ((4, 4), (3, 3)) or shape[-1] == 3 or 12 in shape)
    if isinstance(value, dict):
        position = value.get("position")
        return isinstance(position, list) and position[2:] == [HEIGHT]
    return isinstance(value, (list, tuple)) and len(value) == POSES


@contextmanager
def watched(holding: set[str], handing: set[str]) -> Iterator[None]:
    """Note the files of functions that have poses in hand, and of those that hand them on to another file."""

    def note(frame: FrameType, event: str, argument: Any) -> None:
        if event != "return":
            return
        file, other = (inside(frame), inside(frame.f_back) if frame.f_back else "")
        if file and any(are_poses(value) for value in [argument, *frame.f_locals.values()]):
            holding.add(file)
            if other and other != file and are_poses(argument):
                handing.add(file)

    sys.setprofile(note)
    try:
        yield
    finally:
        sys.setprofile(None)


@cache
def place_of(file: str) -> str:
    path = Path(file).resolve()
    place = str(path.relative_to(ROOT)) if path.is_relative_to(ROOT) else ""
    return place if place.startswith(FLOORS) else ""


def inside(frame: FrameType) -> str:
    """The file of a function, as the page names it; "" for those of libraries and tests."""
    return place_of(frame.f_code.co_filename)


def test_files_of_the_way_are_counted() -> None:
    assert [int(number) for number, _, _ in WAY] == list(range(1, len(WAY) + 1))
    assert len({file for _, _, file in WAY} | set(ON_LOOKERS)) == len(WAY) + len(ON_LOOKERS)
    (count, changes) = re.findall(r"pass through (\d+) files, .* In (\w+) of them", TEXT.replace("\n", " "))[0]
    assert int(count) == len(WAY) <= MOST
    assert NUMBERS[changes] == sum(bool(bold) for _, bold, _ in WAY)


def test_poses_are_in_hand_where_it_is_said_and_nowhere_else(monkeypatch: pytest.MonkeyPatch) -> None:
    """Requests are accepted and solved up to the first call of IPOPT, and every function is watched meanwhile."""

    def call_ipopt(*_: Any) -> Any:
        raise IpoptIsCalled

    monkeypatch.setattr(nlp_solve, "_solver", call_ipopt)
    holding, handing = set[str](), set[str]()
    for body in bodies():
        with watched(holding, handing):
            accepted = accept(body, Limits())
            with pytest.raises(IpoptIsCalled):
                solve_request(accepted.prepared, accepted.request_hash, 60.0)
    way = {file for _, _, file in WAY}
    ends = {"service/http/body.py", "optimizer/nlp/program.py", "optimizer/nlp/solve.py"}  # bytes, and numbers in a row
    assert holding - {"models/base/arrays.py"} == (way - ends) | set(ON_LOOKERS)  # which freezes arrays of any kind
    assert handing.isdisjoint(ON_LOOKERS)


def test_poses_are_converted_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of a format together, by the process that accepts a request; the worker gets what came out."""
    converted: list[tuple[int, ...]] = []

    def noted(name: str) -> Any:
        convert = convert_pose.ROTATIONS[name]

        def rotations(values: Any) -> Any:
            converted.append(np.shape(values))
            return convert(values)

        return rotations

    for name in convert_pose.ROTATIONS:
        monkeypatch.setitem(convert_pose.ROTATIONS, name, noted(name))
    body, *_ = bodies()
    converted.clear()
    accepted = accept(body, Limits())
    others = [(4,), (3, 3)]  # tool and grasp of the arm
    assert converted == [(3, 4), (3, 3, 3), (3, 3), (2, 3), (2, 3), *others]  # format by format
    converted.clear()
    _, cell = read_accepted(LayoutRequest, accepted.prepared)
    assert len(cell.task) == POSES
    assert converted == others
