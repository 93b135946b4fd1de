"""TP programs of FANUC as text (.ls): `P[n]` in mm and degrees W, P, R, and the moves to them."""

from __future__ import annotations

import re

from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.formats.program import Program, Target
from duocell.models.task_files.found import Found, Options, stated
from duocell.models.task_files.text import Lines, collapsed, number

_SIGN = re.compile(r"^[ \t]*/(PROG|POS|MN)\b|\bGP1\s*:", re.MULTILINE)
_POINT = re.compile(r"\bP\[\s*(\d{1,6})\s*(?::[^\]\n]{0,100})?\]\s*\{([^{}]{0,4000})\}")
_GROUP = re.compile(r"\bGP(\d)\s*:")
_FRAME = re.compile(r"\bUF\s*:\s*(\w{1,4})\s*,\s*UT\s*:\s*(\w{1,4})")
_FIELD = re.compile(r"\b([XYZWPR])\s*=\s*([^\s,}]{1,40})\s*(mm|inch|deg|rad)?")
_JOINT = re.compile(r"\bJ1\s*=")
_MOVE = re.compile(r"^\s*\d{0,6}\s*:\s*[LJCAS]\s+(?=P\[|PR\[)(.*)$")
_TARGET = re.compile(r"\b(PR?)\[\s*(\d{1,6})\s*(?::[^\]\n]{0,100})?\]")
_MORE = re.compile(r"^\s*:\s*(?=P\[)(.*)$")
_PARTS = {"X": "mm", "Y": "mm", "Z": "mm", "W": "deg", "P": "deg", "R": "deg"}


def looks_like(text: str) -> bool:
    """Whether a text has the sections of such a file."""
    return _SIGN.search(text) is not None


def read(text: str, options: Options) -> Found:
    """The targets of a program; of several motion groups the first.

    Raises:
        InvalidTaskFile: a position is not complete, in other units, in a register, or not in the file.
    """
    found = Found(
        stated(options.units, "mm", "the unit", "a TP program"),
        stated(options.rotation, "wpr_deg", "the rotation", "a TP program"),
    )
    program = Program()
    text = collapsed(text)
    lines = Lines(text)
    for match in _POINT.finditer(text):
        program.declare(match[1], _target(match[2], *lines.of(match.start())))
    for line, raw in enumerate(text.split("/POS")[0].split("\n"), 1):
        move = _MOVE.match(raw) or _MORE.match(raw)
        for kind, name in _TARGET.findall(move[1]) if move is not None else []:
            if kind == "PR":
                raise InvalidTaskFile(
                    f"PR[{name}] is a position register, whose value is not in the file. Use points P[n].", line
                )
            program.move_to(name, line, f"P[{name}]")
    return program.into(found)


def _target(body: str, line: int, column: int) -> Target | None:
    """A position of the first group; None: it is joint values."""
    groups = list(_GROUP.finditer(body))
    if len(groups) > 1:
        body = body[: groups[1].start()]
    if _JOINT.search(body):
        return None
    values: dict[str, float] = {}
    for name, value, unit in _FIELD.findall(_without_configuration(body)):
        if unit and unit != _PARTS[name]:
            raise InvalidTaskFile(f"{name} is in {unit}; {_PARTS[name]} is needed: mixed units.", line, column)
        values[name] = number(value, line, column, name)
    missing = [name for name in _PARTS if name not in values]
    if missing:
        raise InvalidTaskFile(f"the position has no {missing[0]}; X, Y, Z, W, P, R are needed.", line, column)
    frame = _FRAME.search(body)
    where = "" if frame is None else f"user frame {frame[1]}, tool {frame[2]}"
    return Target(tuple(values[name] for name in "XYZ"), tuple(values[name] for name in "WPR"), line, where)


def _without_configuration(body: str) -> str:
    """The text without what stands in quotation marks."""
    return re.sub(r"'[^'\n]{0,100}'", "", body)
