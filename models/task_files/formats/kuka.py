"""KRL of KUKA: `{X 1, Y 2, Z 3, A 4, B 5, C 6}` in mm and degrees, in .dat and .src files."""

from __future__ import annotations

import re

from duocell.models.task_files.errors import InvalidTaskFile, quoted
from duocell.models.task_files.formats.program import Program, Target
from duocell.models.task_files.found import Found, Options, stated
from duocell.models.task_files.text import NUMBER, collapsed, number

_SIGN = re.compile(r"\b(E6POS|E6AXIS|FRAME|POS)\b.{0,120}=\s*\{|\{\s*(E6POS\s*:\s*)?X\s+[-+.\d]|&ACCESS", re.IGNORECASE)
_PART = re.compile(r"\s*(\{[^{}]{0,1000}\}|[A-Za-z_$]\w{0,60}(?:\[\d{1,6}\])?)[^,]{0,200}(?:,|$)")
_DECLARED = re.compile(r"([A-Za-z_$]\w{0,60}(?:\[\d{1,6}\])?)\s*=\s*\{([^{}]{0,1000})\}")
_MOVE = re.compile(r"^\s*(S?PTP|S?LIN|S?CIRC)(?:_REL)?\s+(.*)$", re.IGNORECASE)
_RELATIVE = re.compile(r"^\s*S?(PTP|LIN|CIRC)_REL\b", re.IGNORECASE)
HOMES = ("XHOME", "HOME", "$H_POS")
"""Joint values that stand in a file of the controller."""
_FIELD = re.compile(rf"\b(X|Y|Z|A|B|C|A1|E1)\s+({NUMBER})", re.IGNORECASE)
_PARTS = ("X", "Y", "Z", "A", "B", "C")


def looks_like(text: str) -> bool:
    """Whether there is a position as KRL writes it."""
    return _SIGN.search(text) is not None


def read(text: str, options: Options) -> Found:
    """The positions of a .dat or .src file, or of both one after the other.

    Raises:
        InvalidTaskFile: a position has not all of X, Y, Z, A, B, C, or a move goes to what is not in the file.
    """
    found = Found(
        stated(options.units, "mm", "the unit", "KRL"), stated(options.rotation, "abc_deg", "the rotation", "KRL")
    )
    program = Program()
    moves: list[tuple[int, str, int]] = []
    for line, raw in enumerate(collapsed(text).split("\n"), 1):
        code = raw.split(";")[0]
        if _RELATIVE.match(code):
            raise InvalidTaskFile("relative moves are not followed; write the positions out.", line)
        move = _MOVE.match(code)
        if move is not None:
            moves.append((line, move[2], 2 if "CIRC" in move[1].upper() else 1))
            continue
        for match in _DECLARED.finditer(code):
            target = _target(match[2], line, match.start(2))
            if target is not None:
                program.declare(match[1].upper(), target)
            elif re.search(r"\bA1\b", match[2], re.IGNORECASE):
                program.declare(match[1].upper(), None)
    for line, arguments, count in moves:
        _move(arguments, line, count, program)
    return program.into(found)


def _move(arguments: str, line: int, count: int, program: Program) -> None:
    """The targets of one move, names or numbers; a circle has two."""
    start = 0
    for _ in range(count):
        match = _PART.match(arguments, start)
        if match is None:
            raise InvalidTaskFile(f"the target {quoted(arguments.strip())} is no position and no name of one.", line)
        start = match.end()
        if match[1].startswith("{"):
            target = _target(match[1], line, 0)
            if target is None:
                program.skipped += 1
            else:
                program.move(target)
        elif match[1].upper() in HOMES:
            program.skipped += 1
        else:
            program.move_to(match[1].upper(), line, match[1])


def _target(structure: str, line: int, column: int) -> Target | None:
    """A position; None: it is something else, joint values or a tool's data."""
    values: dict[str, float] = {}
    for name, value in _FIELD.findall(structure):
        values[name.upper()] = number(value, line, column + 1, name.upper())
    if "A1" in values or not {"X", "Y", "Z"} & values.keys():
        return None
    missing = [name for name in _PARTS if name not in values]
    if missing:
        raise InvalidTaskFile(
            f"the position has no {missing[0]}, or that is no number; X, Y, Z, A, B, C are needed.", line, column + 1
        )
    return Target(tuple(values[name] for name in "XYZ"), tuple(values[name] for name in "ABC"), line)
