"""docs/architecture.md says what there is: rooms, their picture, the way of a request, and places to look at."""

import importlib.util
import json
import re
import sys
import traceback
from itertools import pairwise
from pathlib import Path
from types import ModuleType
from typing import Any
from xml.etree import ElementTree

import grimp
import pytest

from duocell.models.base.pose import transform
from duocell.optimizer.nlp import solve as nlp_solve
from duocell.service.requests import convert_pose
from duocell.service.requests.accept import accept
from duocell.service.settings import Limits
from duocell.service.workers import worker

ROOT = Path(__file__).parents[2]
PAGE, PICTURE = ROOT / "docs" / "architecture.md", ROOT / "docs" / "rooms.svg"
TEXT = PAGE.read_text(encoding="utf-8")
FLOORS = ("service", "optimizer", "models")
WAY = re.findall(r"^(\d+)\. (\*\*)?`([\w/]+\.py)`", TEXT, re.M)
NUMBERS = {"nine": 9}


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


def test_files_of_the_way_are_counted() -> None:
    assert [int(number) for number, _, _ in WAY] == list(range(1, len(WAY) + 1))
    assert len({file for _, _, file in WAY}) == len(WAY)
    (count, changes) = re.findall(r"pass through (\d+) files, .* In (\w+) of them", TEXT.replace("\n", " "))[0]
    assert int(count) == len(WAY)
    assert NUMBERS[changes] == sum(bool(bold) for _, bold, _ in WAY)


def test_a_request_goes_the_way_that_is_described(monkeypatch: pytest.MonkeyPatch) -> None:
    """Who calls whom where poses are converted, and where IPOPT is called."""
    stacks: dict[str, list[list[str]]] = {"converted": [], "solved": []}

    def noted(stage: str, function: Any) -> Any:
        def called(*arguments: Any) -> Any:
            files = [Path(frame.filename).resolve() for frame in traceback.extract_stack()]
            inside = [str(file.relative_to(ROOT)) for file in files if file.is_relative_to(ROOT)]
            stacks[stage].append([file for file in inside if file.startswith(FLOORS)])
            return function(*arguments)

        return called

    monkeypatch.setattr(convert_pose, "transform", noted("converted", transform))
    monkeypatch.setattr(nlp_solve, "_solver", noted("solved", nlp_solve._solver))
    request = json.loads((ROOT / "examples" / "line.json").read_text())
    request = {**request, "arms": request["arms"][:1], "certificate": None}
    accepted = accept(json.dumps(request).encode(), Limits())
    assert worker.solve(accepted.text, accepted.request_hash, 60.0).text is not None
    way = [file for _, _, file in WAY]
    converted = [stack for stack in stacks["converted"] if "service/requests/convert_arm.py" not in stack]
    assert len(converted) == 4  # both ends of the line, twice
    assert {file for stack in converted + stacks["solved"] for file in stack} <= set(way)
    places = [way.index(file) for file in stacks["solved"][0]]
    assert places == sorted(places)
    assert way[places[-1]] == "optimizer/nlp/solve.py"
