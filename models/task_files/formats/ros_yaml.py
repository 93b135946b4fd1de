"""ROS messages and MoveIt requests in YAML: whatever holds a position and an orientation, in its order.

Read event by event: an own small tree knows where everything stands, is bounded in depth, and follows no aliases.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Any

import yaml

from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.found import Found, Options, stated
from duocell.models.task_files.text import number

DEEPEST = 40
_SIGN = re.compile(r"^[ \t-]*(poses|pose|position|header|waypoints|items)\s*:", re.MULTILINE)
_Loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


@dataclass(slots=True)
class Node:
    """A part of a document: a text, a list, or fields; ``line`` and ``column`` from 1."""

    line: int
    column: int
    text: str | None = None
    items: list[Node] = field(default_factory=list)
    fields: dict[str, Node] = field(default_factory=dict)


def looks_like(text: str) -> bool:
    """Whether a text has a field that such messages have."""
    return _SIGN.search(text[:20_000]) is not None


def read(text: str, options: Options) -> Found:
    """The poses of all documents of a file (REP 103: m, quaternions x, y, z, w).

    Raises:
        InvalidTaskFile: it is no YAML, or holds no pose.
    """
    found = Found(stated(options.units, "m", "the unit", "ROS"), "quaternion")
    found.rotation = stated(options.rotation, "quaternion", "the rotation", "ROS")
    frames: dict[str, int] = {}
    for document in documents(text):
        for pose in _poses(document, frames):
            _add(pose, found)
    if len(frames) > 1:
        (first, _), (other, line) = list(frames.items())[:2]
        raise InvalidTaskFile(f"frame_id is {other!r}, before it was {first!r}; all poses need one frame.", line)
    if frames:
        found.notes.append(f"Poses are given in the frame {next(iter(frames))!r}.")
    return found


def documents(text: str) -> Iterator[Node]:
    """The documents of a YAML text.

    Raises:
        InvalidTaskFile: it is none, too deep, or has aliases.
    """
    stack: list[tuple[Node, list[Node]]] = []
    try:
        for event in yaml.parse(text, Loader=_Loader):
            node = _opened(event)
            if node is not None:
                if stack:
                    stack[-1][1].append(node)
                if isinstance(event, yaml.ScalarEvent):
                    if not stack:
                        yield node
                    continue
                stack.append((node, []))
                if len(stack) > DEEPEST:
                    raise InvalidTaskFile(f"nested deeper than {DEEPEST} levels.", node.line, node.column)
            elif isinstance(event, (yaml.SequenceEndEvent, yaml.MappingEndEvent)):
                done, children = stack.pop()
                _fill(done, children, isinstance(event, yaml.MappingEndEvent))
                if not stack:
                    yield done
    except yaml.YAMLError as error:
        mark = getattr(error, "problem_mark", None) or getattr(error, "context_mark", None)
        place = (mark.line + 1, mark.column + 1) if mark is not None else (0, 0)
        what = getattr(error, "problem", None) or getattr(error, "reason", None) or "it breaks off"
        raise InvalidTaskFile(f"this is no YAML: {what}.", *place) from error


def _opened(event: Any) -> Node | None:
    """The node that an event begins."""
    if isinstance(event, yaml.AliasEvent):
        mark = event.start_mark
        raise InvalidTaskFile("aliases are not followed; write the values out.", mark.line + 1, mark.column + 1)
    if isinstance(event, (yaml.ScalarEvent, yaml.SequenceStartEvent, yaml.MappingStartEvent)):
        mark = event.start_mark
        return Node(mark.line + 1, mark.column + 1, event.value if isinstance(event, yaml.ScalarEvent) else None)
    return None


def _fill(node: Node, children: list[Node], mapping: bool) -> None:
    """Put the parts of a list or of fields in."""
    if not mapping:
        node.items = children
        return
    for key, value in zip(children[::2], children[1::2], strict=False):
        if key.text is not None:
            node.fields[key.text] = value


def _poses(top: Node, frames: dict[str, int]) -> Iterator[tuple[Node, Node]]:
    """Positions with their orientations, in the order of the text."""
    waiting = [top]
    while waiting:
        node = waiting.pop()
        fields = node.fields
        frame = fields.get("frame_id")
        if frame is not None and frame.text:
            frames.setdefault(frame.text, frame.line)
        if "position" in fields and "orientation" in fields:
            yield fields["position"], fields["orientation"]
        elif "position_constraints" in fields and "orientation_constraints" in fields:
            yield _goal(node)
        else:
            waiting += reversed([*node.items, *fields.values()])


def _goal(node: Node) -> tuple[Node, Node]:
    """Position and orientation of MoveIt's constraints of a goal."""
    try:
        (region,) = node.fields["position_constraints"].items
        shapes = region.fields["constraint_region"].fields
        pose = (shapes.get("primitive_poses") or shapes["mesh_poses"]).items[0]
        (turned,) = node.fields["orientation_constraints"].items
        return pose.fields["position"], turned.fields["orientation"]
    except (KeyError, ValueError, IndexError) as error:
        raise InvalidTaskFile(
            "these constraints of a goal are no pose: one position_constraint with a pose of its region and one "
            "orientation_constraint are needed.",
            node.line,
        ) from error


def _add(pose: tuple[Node, Node], found: Found) -> None:
    position, orientation = pose
    found.add(_numbers(position, "xyz", "position"), _numbers(orientation, "xyzw", "orientation"), position.line)


def _numbers(node: Node, names: str, what: str) -> list[float]:
    """Numbers by their names, or in a list in that order."""
    if node.items:
        if len(node.items) != len(names):
            raise InvalidTaskFile(f"{what} has {len(node.items)} numbers; {len(names)} are needed.", node.line)
        parts = node.items
    else:
        missing = [name for name in names if name not in node.fields]
        if missing:
            raise InvalidTaskFile(f"{what}: {missing[0]} is missing.", node.line, node.column)
        parts = [node.fields[name] for name in names]
    return [
        number(part.text or "", part.line, part.column, f"{what} {name}")
        for name, part in zip(names, parts, strict=True)
    ]
