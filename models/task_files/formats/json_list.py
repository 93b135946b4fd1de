"""JSON: lists of poses, of numbers, or of objects whose fields are the columns of a table."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

from duocell.models.task_files.conventions import ROTATIONS
from duocell.models.task_files.errors import InvalidTaskFile, quoted
from duocell.models.task_files.formats.columns import columns_of, found_in
from duocell.models.task_files.found import MOST_POINTS, Found, Options, stated
from duocell.models.task_files.text import checked

LISTS = ("poses", "waypoints", "points", "targets", "path", "data", "task")
"""Fields that may hold the list."""
FORMS = ("quaternion", "quaternion_wxyz", "axis_angle", "matrix", "rpy", "euler_zyz", "abc_deg", "wpr_deg")
"""Of orientations, as requests have them."""
AMBIGUOUS = {
    6: "axis_angle, rpy, rpy_deg, abc_deg, wpr_deg, euler_zyz or tool_axis",
    7: "quaternion or quaternion_wxyz",
}
"""How many numbers a way-point has -> the conventions that they can be meant in."""

NAMES: dict[Any, tuple[str, ...]] = {
    3: (),
    6: ("rx", "ry", "rz"),
    "quaternion": ("qx", "qy", "qz", "qw"),
    "quaternion_wxyz": ("q1", "q2", "q3", "q4"),
    12: tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)),
}
"""How many numbers a way-point has, or their convention -> columns of the orientation."""


def looks_like(text: str) -> bool:
    """Whether a text begins like JSON."""
    return text.lstrip()[:1] in ("[", "{")


def read(text: str, options: Options) -> Found:
    """The way-points of a JSON document.

    Raises:
        InvalidTaskFile: it is none, or holds no list of way-points.
    """
    try:
        document = json.loads(text)
    except json.JSONDecodeError as error:
        raise InvalidTaskFile(f"this is no JSON: {error.msg}.", error.lineno, error.colno) from error
    except (RecursionError, ValueError) as error:
        raise InvalidTaskFile("this JSON is nested too deeply, or has a number with too many digits.") from error
    items = _list_in(document)
    if len(items) > MOST_POINTS:
        raise InvalidTaskFile(f"more than {MOST_POINTS} way-points; split the file.")
    if isinstance(items[0], Mapping) and "position" in items[0]:
        return _of_poses(items, options)
    if isinstance(items[0], Mapping):
        return _of_objects(items, options)
    return _of_numbers(items, options)


def _list_in(document: Any) -> Sequence[Any]:
    """The list of way-points."""
    for _ in range(3):
        if isinstance(document, Mapping):
            document = next((document[name] for name in LISTS if name in document), None)
    if not isinstance(document, list) or not document:
        raise InvalidTaskFile(
            f"a list of way-points is needed, at the top or in one of {', '.join(LISTS)}; an empty one holds no task."
        )
    return document


def _of_poses(items: Sequence[Any], options: Options) -> Found:
    """Poses as requests have them, or as ROS writes them; one form of orientation for all."""
    found = Found(options.units or "m", "none")
    if options.units is None:
        found.guessed.append("The unit is m, as in requests and ROS.")
    form = ""
    for index, item in enumerate(items):
        if not isinstance(item, Mapping) or "position" not in item or "orientation" not in item:
            raise InvalidTaskFile(f"item {index} is no pose: position and orientation are needed.")
        own, values = _orientation(item["orientation"], index)
        if form and own != form:
            raise InvalidTaskFile(f"item {index} has a {own}, those before a {form}; all need the same form.")
        form = own
        found.add(_named(item["position"], "xyz", f"item {index}, position"), values, 0)
    found.rotation = stated(options.rotation, form, "the rotation", "the file")
    return found


def _orientation(value: Any, index: int) -> tuple[str, list[float]]:
    """Convention and numbers of one orientation."""
    what = f"item {index}, orientation"
    if isinstance(value, Mapping):
        given = [name for name in FORMS if name in value]
        if len(given) == 1:
            name = given[0]
            return name, _flat(value[name], ROTATIONS[name].count, f"{what}, {name}")
        if not given:
            return "quaternion", _named(value, "xyzw", what)
        raise InvalidTaskFile(f"{what} has {' and '.join(given)}; one is needed.")
    return "quaternion", _flat(value, 4, what)


def _of_objects(items: Sequence[Any], options: Options) -> Found:
    """Objects whose fields are columns."""
    names = options.columns or tuple(items[0])
    columns = columns_of(names, options, 0)
    used = {*columns.position, *columns.orientation}
    rows: list[tuple[int, list[float]]] = []
    for index, item in enumerate(items):
        if not isinstance(item, Mapping):
            raise InvalidTaskFile(f"item {index} is {quoted(item)}; an object as the first is needed.")
        missing = [names[column] for column in sorted(used) if names[column] not in item]
        if missing:
            raise InvalidTaskFile(f"item {index}: column {missing[0]!r} is missing.")
        row = [_number(item[name], f"item {index}, {name!r}") if k in used else 0.0 for k, name in enumerate(names)]
        rows.append((0, row))
    return found_in(rows, columns, options)


def _of_numbers(items: Sequence[Any], options: Options) -> Found:
    """Lists of numbers: position and orientation, or transforms row by row."""
    rows = [(0, _flat(item, None, f"item {index}")) for index, item in enumerate(items)]
    count = len(rows[0][1])
    wrong = next((index for index, (_, row) in enumerate(rows) if len(row) != count), None)
    if wrong is not None:
        raise InvalidTaskFile(f"item {wrong} has {len(rows[wrong][1])} numbers, the first has {count}.")
    if count in (12, 16) and options.columns is None and options.rotation is None:
        return _of_transforms([row for _, row in rows], options)
    if options.columns is not None:
        names = options.columns
    elif options.rotation in ROTATIONS and ROTATIONS[options.rotation].count == count - 3:
        names = ("x", "y", "z", *NAMES[options.rotation if count == 7 else count])
    else:
        meant = AMBIGUOUS.get(count, "a transform of 12 or 16 numbers")
        raise InvalidTaskFile(
            f"way-points of {count} numbers can be meant as {meant}; say which with `rotation`, or name the `columns`."
        )
    if len(names) != count:
        raise InvalidTaskFile(f"{count} numbers, but {len(names)} columns are named.")
    return found_in(rows, columns_of(names, options, 0), options)


def _of_transforms(rows: Sequence[Sequence[float]], options: Options) -> Found:
    """3 × 4 or 4 × 4 transforms."""
    names = tuple(f"r{row}{column}" if column < 4 else "xyz"[row - 1] for row in (1, 2, 3) for column in (1, 2, 3, 4))
    for index, row in enumerate(rows):
        if len(row) == 16 and list(row[12:]) != [0.0, 0.0, 0.0, 1.0]:
            raise InvalidTaskFile(f"item {index}: the last row of a transform is 0, 0, 0, 1; send it row by row.")
    return found_in([(0, row[:12]) for row in rows], columns_of(names, options, 0), options)


def _named(value: Any, names: str, what: str) -> list[float]:
    """Numbers by their names, or in a list in that order."""
    if isinstance(value, Mapping):
        missing = [name for name in names if name not in value]
        if missing:
            raise InvalidTaskFile(f"{what}: {missing[0]} is missing.")
        return [_number(value[name], f"{what}, {name}") for name in names]
    return _flat(value, len(names), what)


def _flat(value: Any, count: int | None, what: str) -> list[float]:
    """The numbers of a list, or of a list of lists."""
    if not isinstance(value, list):
        raise InvalidTaskFile(f"{what} is {quoted(value)}; a list of numbers is needed.")
    flat = [number for item in value for number in (item if isinstance(item, list) else [item])]
    if (count is not None and len(flat) != count) or len(flat) > 16:
        raise InvalidTaskFile(f"{what} has {len(flat)} numbers; {count or 'at most 16'} are needed.")
    return [_number(number, what) for number in flat]


def _number(value: Any, what: str) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise InvalidTaskFile(f"{what} is {quoted(value)}; a number is needed.")
    try:
        return checked(float(value), 0, 0, what)
    except OverflowError as error:
        raise InvalidTaskFile(f"{what} is too large for a number.") from error
