"""How many of everything a document asks for, counted before any of it is looked at."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

from duocell.service.common.issues import IssueCollector, pointer_of
from duocell.service.settings import Limits

CODE = "too-large"


class Amount(NamedTuple):
    """One amount: where, how many, of what, the setting that limits it, and what to do if there are too many."""

    path: tuple[str | int, ...]
    number: int
    what: str
    setting: str
    advice: str


def check_amounts(document: Any, limits: Limits) -> None:
    """Refuse too many poses, arms, obstacles, ... before each of them is looked at.

    Raises:
        InvalidRequest: more than the settings allow.
    """
    issues = IssueCollector()
    for amount in _amounts(document):
        most = getattr(limits, amount.setting)
        if amount.number > most:
            issues.add(
                pointer_of(amount.path),
                f"{amount.number} {amount.what} are too many; allowed are {most} (DUOCELL_{amount.setting.upper()}). "
                f"{amount.advice}",
                CODE,
            )
    issues.raise_any()


def _amounts(document: Any) -> Iterator[Amount]:
    """Everything that is counted."""
    segments = _list(_member(document, "tasks"))
    yield from _poses(("task",), _member(document, "task"))
    for index, segment in enumerate(segments):
        yield Amount(
            ("tasks", index, "grasps"), _size(_member(segment, "grasps")), "grasps", "max_arms", "One per arm."
        )
    ways = [
        way
        for index, segment in enumerate(segments)
        for way in _poses(("tasks", index, "task"), _member(segment, "task"))
    ]
    yield from ways
    advice = "Send fewer: every second pose usually gives the same layout."
    yield Amount(("tasks",), sum(way.number for way in ways), "poses of all jobs", "max_poses", advice)
    arms = _list(_member(document, "arms"))
    yield Amount(("arms",), len(arms), "arms", "max_arms", "Uncoupled arms may as well be sent one by one.")
    obstacles = _list(_member(document, "obstacles"))
    yield Amount(("obstacles",), len(obstacles), "obstacles", "max_obstacles", "Leave out what no arm can reach.")
    couplings = _list(_member(document, "coupling"))
    yield Amount(("coupling",), len(couplings), "couplings", "max_couplings", "One can name several arms.")
    for index, tie in enumerate(couplings):
        named = len(_list(_member(tie, "arms")))
        yield Amount(("coupling", index, "arms"), named, "arms", "max_arms", "Name each once.")
    for index, arm in enumerate(arms):
        rows = len(_list(_member(arm, "joints")))
        yield Amount(("arms", index, "joints"), rows, "rows", "max_poses", "One row per pose is needed.")
    yield from _shapes(document, arms)
    yield from _polygons(document, arms)


def _poses(at: tuple[str | int, ...], task: Any) -> Iterator[Amount]:
    """Poses of a task, written out or generated."""
    for path, count in (
        (("poses",), len(_list(_member(task, "poses")))),
        (("line", "count"), _count(_member(task, "line"))),
        (("arc", "count"), _count(_member(task, "arc"))),
    ):
        advice = "Send fewer: every second pose usually gives the same layout."
        yield Amount((*at, *path), count, "poses", "max_poses", advice)


def _shapes(document: Any, arms: list[Any]) -> Iterator[Amount]:
    """Shapes of the part and of the tools."""
    advice = "A few boxes and capsules describe most things well enough."
    part = _list(_member(_member(document, "part"), "shapes"))
    yield Amount(("part", "shapes"), len(part), "shapes", "max_shapes", advice)
    for index, arm in enumerate(arms):
        tool = _list(_member(arm, "tool_shapes"))
        yield Amount(("arms", index, "tool_shapes"), len(tool), "shapes", "max_shapes", advice)


def _polygons(document: Any, arms: list[Any]) -> Iterator[Amount]:
    """Polygons of the floor, and the corners of all polygons."""
    floor = _member(document, "floor")
    forbidden = _list(_member(floor, "forbidden"))
    advice = "Join those that touch each other."
    yield Amount(("floor", "forbidden"), len(forbidden), "polygons", "max_polygons", advice)
    polygons: list[tuple[tuple[str | int, ...], Any]] = [(("floor", "allowed"), _member(floor, "allowed"))]
    polygons += [(("floor", "forbidden", index), polygon) for index, polygon in enumerate(forbidden)]
    for index, arm in enumerate(arms):
        for way in (("footprint",), ("pedestal", "footprint")):
            holder = arm
            for name in way:
                holder = _member(holder, name)
            polygons.append((("arms", index, *way, "polygon"), _member(holder, "polygon")))
    for path, polygon in polygons:
        yield Amount(path, len(_list(polygon)), "corners", "max_corners", "Send a coarser outline that contains it.")


def _member(value: Any, name: str) -> Any:
    return value.get(name) if isinstance(value, dict) else None


def _list(value: Any) -> list[Any]:
    return value if isinstance(value, list) else []


def _size(value: Any) -> int:
    return len(value) if isinstance(value, dict) else 0


def _count(generator: Any) -> int:
    count = _member(generator, "count")
    return count if isinstance(count, int) else 0
