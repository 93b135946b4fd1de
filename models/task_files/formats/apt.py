"""APT and CL files of CAM systems: `GOTO/x, y, z, i, j, k`, the tool's tip and its axis (ISO 4343).

The tool may turn about its axis: what it turns there is chosen, see `duocell.models.task_files.tool_axis`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator

from duocell.models.task_files.errors import InvalidTaskFile, quoted
from duocell.models.task_files.found import Found, Options, stated
from duocell.models.task_files.text import number

_SIGN = re.compile(
    r"^[ \t]*(?:\d{1,8}[ \t]+)?(GOTO|GODLTA|FROM|PARTNO|MULTAX|TLAXIS|FEDRAT)\b", re.IGNORECASE | re.MULTILINE
)
_STATEMENT = re.compile(r"\s*(?:\d{1,8}\s+)?([A-Za-z]\w{0,30})\s*/\s*(.*)", re.DOTALL)
_UNITS = {"MM": "mm", "CM": "cm", "M": "m", "INCH": "inch", "INCHES": "inch", "IN": "inch"}
_CIRCLES = ("CIRCLE", "MOVARC", "ARCSLP", "ARCDAT")
LONGEST = 20
"""Lines of one statement."""


def looks_like(text: str) -> bool:
    """Whether there is a statement of such a file."""
    return _SIGN.search(text) is not None


def read(text: str, options: Options) -> Found:
    """The way of the tool.

    Raises:
        InvalidTaskFile: a statement is not complete, or an arc that stands for many points.
    """
    found = Found("", stated(options.rotation, "tool_axis", "the rotation", "an APT file"))
    axis, position = [0.0, 0.0, 1.0], [0.0, 0.0, 0.0]
    units: str | None = None
    frame = ""
    for line, word, arguments in _statements(text):
        if word == "UNITS":
            units = _units(arguments, units, found, line)
        elif word in _CIRCLES or "CIRCLE" in arguments:
            raise InvalidTaskFile("arcs are not followed; write the file with points only (linear output).", line)
        elif word == "MSYS":
            frame = _frame(arguments, frame, found, line)
        elif word == "TLAXIS":
            axis = _numbers(arguments, line, word, (3,))
        elif word in ("GOTO", "FROM", "GODLTA"):
            values = _numbers(arguments, line, word, (3, 6))
            given = values[:3]
            position = [a + b for a, b in zip(position, given, strict=True)] if word == "GODLTA" else given
            axis = values[3:] or axis
            if word != "FROM":
                found.add(position, axis, line)
    if units is None and options.units is None:
        found.guessed.append("The unit is mm: there is no UNITS statement.")
    found.units = options.units or "mm" if units is None else stated(options.units, units, "the unit", "UNITS")
    found.notes.append(
        "The z axis of the poses points out of the tool, against i, j, k. It may turn about it: the roll was chosen so "
        "that it changes least."
    )
    return found


def _statements(text: str) -> Iterator[tuple[int, str, str]]:
    """Line, word and arguments of each statement; a `$` at the end goes on in the next line, `$$` begins a comment."""
    begun, parts = 0, []
    for line, raw in enumerate(text.split("\n"), 1):
        content = raw.split("$$")[0].rstrip()
        begun = begun or line
        parts.append(content.removesuffix("$"))
        if content.endswith("$") and len(parts) < LONGEST:
            continue
        match = _STATEMENT.fullmatch("".join(parts))
        if match is not None:
            yield begun, match[1].upper(), match[2].upper().strip()
        begun, parts = 0, []


def _frame(arguments: str, before: str, found: Found, line: int) -> str:
    """The coordinate system that points are given in (Siemens NX)."""
    if found.positions and arguments != before:
        raise InvalidTaskFile("MSYS changes after the first point: points of several frames. Split the file.", line)
    return arguments


def _units(arguments: str, before: str | None, found: Found, line: int) -> str:
    unit = _UNITS.get(arguments.strip())
    if unit is None:
        raise InvalidTaskFile(f"UNITS is {quoted(arguments)}; one of {', '.join(_UNITS)} is needed.", line)
    if before not in (None, unit) or (found.positions and before is None):
        raise InvalidTaskFile("mixed units: UNITS changes after the first point. Write the file in one unit.", line)
    return unit


def _numbers(arguments: str, line: int, word: str, counts: tuple[int, ...]) -> list[float]:
    parts = arguments.split(",")
    if len(parts) not in counts:
        needed = " or ".join(map(str, counts))
        raise InvalidTaskFile(
            f"{word} has {len(parts)} values, {quoted(arguments)}; {needed} numbers are needed.", line
        )
    return [number(part, line, 0, word) for part in parts]
