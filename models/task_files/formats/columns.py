"""What the columns of a table mean, by their names."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

from duocell.models.task_files.conventions import ROTATIONS, UNITS
from duocell.models.task_files.errors import InvalidTaskFile, quoted
from duocell.models.task_files.found import Found, Options

MOST_COLUMNS = 200
POSITION = (
    frozenset({"x", "px", "posx", "positionx", "tx", "xpos"}),
    frozenset({"y", "py", "posy", "positiony", "ty", "ypos"}),
    frozenset({"z", "pz", "posz", "positionz", "tz", "zpos"}),
)
"""Names of the columns of a position."""
ORIENTATIONS: dict[tuple[str, ...], tuple[str, ...]] = {
    ("qx", "qy", "qz", "qw"): ("quaternion",),
    ("orientationx", "orientationy", "orientationz", "orientationw"): ("quaternion",),
    ("q1", "q2", "q3", "q4"): ("quaternion_wxyz",),
    ("roll", "pitch", "yaw"): ("rpy", "rpy_deg"),
    ("a", "b", "c"): ("abc_deg",),
    ("w", "p", "r"): ("wpr_deg",),
    ("i", "j", "k"): ("tool_axis",),
    ("rx", "ry", "rz"): tuple(name for name, convention in ROTATIONS.items() if convention.count == 3),
    tuple(f"r{row}{column}" for row in (1, 2, 3) for column in (1, 2, 3)): ("matrix",),
}
"""Names of the columns of an orientation -> the conventions that they can be meant in."""
_UNIT = re.compile(r"^(.{1,60}?)[\s_(\[]{1,3}(mm|cm|m|inch|in|deg|degrees|°|rad)[\])]?$")
_LENGTHS = {"mm": "mm", "cm": "cm", "m": "m", "in": "inch", "inch": "inch"}
_NOT_IN_NAMES = re.compile(r"[\s_.\-]")
LARGEST_IN_METRES = 10.0
"""m; where no unit is told, a file with a larger coordinate is taken for one in mm."""
LARGEST_IN_RADIANS = 6.3
"""Likewise for angles: a turn."""


@dataclass(frozen=True, slots=True)
class Columns:
    """Which columns hold what.

    Attributes:
        position: of x, y, z. orientation: of the numbers of the convention, in its order.
        units: as far as the names tell. conventions: that the orientation can be meant in; one if that is known.
        names: as they were read, of all columns.
    """

    position: tuple[int, ...]
    orientation: tuple[int, ...]
    units: str | None
    conventions: tuple[str, ...]
    names: tuple[str, ...]


def columns_of(names: Sequence[str], options: Options, line: int) -> Columns:
    """What the columns mean.

    Args:
        names: of all columns. options: what is known about them. line: where the names stand, 0: nowhere.

    Raises:
        InvalidTaskFile: some are missing, there twice, in different units, or can be meant in several ways.
    """
    if len(names) > MOST_COLUMNS:
        raise InvalidTaskFile(f"{len(names)} columns; at most {MOST_COLUMNS} are read.", line)
    split = [_split(name) for name in names]
    known = [name for name, _ in split]
    twice = {name for name in known if name and known.count(name) > 1}
    position = tuple(_position(axis, index, known, names, line) for index, axis in enumerate(POSITION))
    orientation, conventions = _orientation(known, names, options, line)
    repeated = twice & {known[index] for index in (*position, *orientation)}
    if repeated:
        raise InvalidTaskFile(f"there are several columns {sorted(repeated)[0]!r}; one is needed.", line)
    units = _one_unit([split[index][1] for index in position], [names[index] for index in position], line)
    if units is not None and units not in _LENGTHS:
        raise InvalidTaskFile(f"the positions are in {units!r}; a unit of length is needed: {', '.join(UNITS)}.", line)
    angles = _one_unit([split[index][1] for index in orientation], [names[index] for index in orientation], line)
    return Columns(
        position,
        orientation,
        None if units is None else _LENGTHS[units],
        _in_unit(conventions, angles, line),
        tuple(names),
    )


def found_in(rows: Sequence[tuple[int, Sequence[float]]], columns: Columns, options: Options) -> Found:
    """The way-points of a table.

    Args:
        rows: line and numbers of each. columns: what they mean. options: what is known about them.

    Raises:
        InvalidTaskFile: units or convention contradict what is known.
    """
    found = Found("m", "none", columns=columns.names)
    for line, row in rows:
        found.add([row[index] for index in columns.position], [row[index] for index in columns.orientation], line)
    if columns.units is not None and options.units not in (None, columns.units):
        raise InvalidTaskFile(
            f"units are given as {options.units!r}, but the columns say {columns.units}: mixed units. Correct one."
        )
    found.units = options.units or columns.units or _guessed_units(found)
    found.rotation = columns.conventions[0] if len(columns.conventions) == 1 else _guessed_rotation(columns, found)
    used = {*columns.position, *columns.orientation}
    rest = [name for index, name in enumerate(columns.names) if index not in used]
    if rest:
        found.notes.append(f"Columns that were left out: {', '.join(map(quoted, rest[:10]))}.")
    return found


def _split(name: str) -> tuple[str, str | None]:
    """The name of a column as it is looked for, and its unit."""
    text = name.strip().strip("\"'").strip().lower()
    match = _UNIT.fullmatch(text)
    if match is not None:
        text, unit = match[1], {"degrees": "deg", "°": "deg"}.get(match[2], match[2])
        return _NOT_IN_NAMES.sub("", text), unit
    return _NOT_IN_NAMES.sub("", text), None


def _position(axis: frozenset[str], index: int, known: Sequence[str], names: Sequence[str], line: int) -> int:
    """The column of x, y or z."""
    for column, name in enumerate(known):
        if name in axis:
            return column
    there = ", ".join(map(quoted, names[:20]))
    raise InvalidTaskFile(
        f"column {'xyz'[index]} is missing; there are {there}. Name it, or say what the columns are with `columns`.",
        line,
    )


def _orientation(
    known: Sequence[str], names: Sequence[str], options: Options, line: int
) -> tuple[tuple[int, ...], tuple[str, ...]]:
    """The columns of the orientation and what they can be meant in."""
    if options.rotation == "none":
        return (), ("none",)
    whole = [group for group in ORIENTATIONS if all(name in known for name in group)]
    if options.rotation is not None:
        fitting = [group for group in whole if options.rotation in ORIENTATIONS[group]]
        if whole and not fitting:
            raise InvalidTaskFile(
                f"columns {'/'.join(whole[0])} are {' or '.join(ORIENTATIONS[whole[0]])}, not {options.rotation}. "
                "Leave `rotation` out, or name them otherwise with `columns`: rx, ry, rz can be any three angles.",
                line,
            )
        whole = fitting
    if len(whole) == 1:
        (group,) = whole
        conventions = ORIENTATIONS[group] if options.rotation is None else (options.rotation,)
        return tuple(known.index(name) for name in group), conventions
    if whole:
        groups = " and ".join("/".join(group) for group in whole)
        raise InvalidTaskFile(f"there are several orientations, {groups}; say which with `rotation`.", line)
    for group in ORIENTATIONS:
        missing = [name for name in group if name not in known]
        if len(missing) <= len(group) // 2:
            raise InvalidTaskFile(f"column {missing[0]} is missing beside {'/'.join(group)}. Add it.", line)
    raise InvalidTaskFile(
        f"no columns of an orientation are among {', '.join(map(quoted, names[:20]))}; known are "
        f"{'; '.join('/'.join(group) for group in ORIENTATIONS)}. If nothing is to turn, send `rotation` as none.",
        line,
    )


def _one_unit(units: Sequence[str | None], names: Sequence[str], line: int) -> str | None:
    """The unit of some columns."""
    if len(set(units)) > 1:
        raise InvalidTaskFile(f"mixed units in {', '.join(map(quoted, names))}; all need the same.", line)
    return units[0] if units else None


def _in_unit(conventions: tuple[str, ...], unit: str | None, line: int) -> tuple[str, ...]:
    """The conventions that go with the unit of the columns."""
    if unit is None:
        return conventions
    if unit not in ("deg", "rad"):
        raise InvalidTaskFile(f"an orientation is in {unit!r}; deg or rad is needed.", line)
    left = tuple(name for name in conventions if name.endswith("_deg") == (unit == "deg"))
    if not left:
        raise InvalidTaskFile(
            f"mixed units: the columns of the orientation are in {unit}, but {' or '.join(conventions)} is not.", line
        )
    return left


def _guessed_units(found: Found) -> str:
    largest = max((abs(value) for position in found.positions for value in position), default=0.0)
    units = "mm" if largest > LARGEST_IN_METRES else "m"
    found.guessed.append(f"The unit is {units}, since the largest coordinate is {largest:g}.")
    return units


def _guessed_rotation(columns: Columns, found: Found) -> str:
    """Degrees or radians; what else differs is not guessed."""
    bare = {name.removesuffix("_deg") for name in columns.conventions}
    if len(bare) > 1:
        names = "/".join(columns.names[index] for index in columns.orientation)
        raise InvalidTaskFile(
            f"columns {names} can be meant as {', '.join(columns.conventions)}; say which with `rotation`."
        )
    largest = max((abs(value) for row in found.orientations for value in row), default=0.0)
    (name,) = bare
    rotation = f"{name}_deg" if largest > LARGEST_IN_RADIANS else name
    unit = "degrees" if rotation.endswith("_deg") else "radians"
    found.guessed.append(f"Angles are in {unit}, since the largest is {largest:g}.")
    return rotation
