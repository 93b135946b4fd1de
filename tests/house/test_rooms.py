"""The house: three floors, arrows only downwards; rooms of few files on few levels; no circles."""

import subprocess
import sys
from pathlib import Path

import grimp
import pytest

ROOT = Path(__file__).parents[2]
FLOORS = ("service", "optimizer", "models")
FILES, LEVELS = 15, 10
"""Most files of a room, most levels that the rooms of a floor import each other on."""


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("duocell", cache_dir=None)


def imported(graph: grimp.ImportGraph, package: str) -> dict[str, set[str]]:
    """Which of the direct children of a package import which others, with all that is inside of them."""
    depth = package.count(".") + 1
    rooms: dict[str, set[str]] = {child.split(".")[depth]: set() for child in graph.find_children(package)}
    for module in graph.find_descendants(package):
        for other in graph.find_modules_directly_imported_by(module):
            if other.startswith(f"{package}."):
                rooms[module.split(".")[depth]].add(other.split(".")[depth])
    return {room: others - {room} for room, others in rooms.items()}


def levels(rooms: dict[str, set[str]]) -> int:
    """Of the longest way down; circles have no end."""
    rest, count = dict(rooms), 0
    while rest:
        lowest = {room for room, others in rest.items() if not others & set(rest)}
        assert lowest, f"a circle among {sorted(rest)}"
        rest = {room: others for room, others in rest.items() if room not in lowest}
        count += 1
    return count


def test_levels_are_counted() -> None:
    assert levels({"a": {"b", "c"}, "b": {"c"}, "c": set(), "d": set()}) == 3
    with pytest.raises(AssertionError, match="circle"):
        levels({"a": {"b"}, "b": {"a"}, "c": set()})


@pytest.mark.parametrize("floor", FLOORS)
def test_no_floor_imports_one_above(graph: grimp.ImportGraph, floor: str) -> None:
    below = FLOORS[FLOORS.index(floor) :]  # neither other floors nor the interface for programs
    for module in graph.find_descendants(f"duocell.{floor}"):
        for other in graph.find_modules_directly_imported_by(module):
            assert other.startswith(tuple(f"duocell.{one}" for one in below)), f"{module} imports {other}"


@pytest.mark.parametrize("floor", FLOORS)
def test_rooms_import_each_other_on_few_levels(graph: grimp.ImportGraph, floor: str) -> None:
    rooms = imported(graph, f"duocell.{floor}")
    assert len(rooms) >= 7
    assert levels(rooms) <= LEVELS


@pytest.mark.parametrize("floor", FLOORS)
def test_no_circles_of_files(graph: grimp.ImportGraph, floor: str) -> None:
    inside = {f"duocell.{floor}", *graph.find_descendants(f"duocell.{floor}")}
    assert len(inside) > 50
    levels({module: graph.find_modules_directly_imported_by(module) & inside for module in inside})


@pytest.mark.parametrize("folder", [*FLOORS, "bench", "tests"])
def test_rooms_have_few_files(folder: str) -> None:
    files = [path for path in (ROOT / folder).rglob("*.py") if path.name != "__init__.py"]
    rooms = {path.parent for path in files}
    assert len(files) > 50
    assert {
        str(room.relative_to(ROOT)) for room in rooms if sum(path.parent == room for path in files) > FILES
    } == set()


@pytest.mark.parametrize("floor", FLOORS)
def test_every_room_says_what_it_is(floor: str) -> None:
    silent = [path for path in (ROOT / floor).rglob("__init__.py") if not path.read_text().startswith('"""')]
    assert silent == []


@pytest.mark.parametrize("floor", ["models", "optimizer"])
def test_lower_floors_load_no_web_framework(floor: str) -> None:
    code = (
        f"import importlib, pkgutil, sys, duocell.{floor} as floor\n"
        "[importlib.import_module(m.name) for m in pkgutil.walk_packages(floor.__path__, floor.__name__ + '.')]\n"
        "print(sorted({'fastapi', 'uvicorn', 'pydantic', 'rich', 'matplotlib', 'duocell.service'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.stdout.strip() == "[]", run.stderr
