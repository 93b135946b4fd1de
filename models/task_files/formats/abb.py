"""RAPID of ABB: `robtarget` [[x, y, z], [q1, q2, q3, q4], …] in mm, with quaternions whose scalar is first."""

from __future__ import annotations

import re

from duocell.models.task_files.errors import InvalidTaskFile, quoted
from duocell.models.task_files.formats.program import Program, Target
from duocell.models.task_files.found import Found, Options, stated
from duocell.models.task_files.text import Lines, collapsed, number

_LIST = r"\[([^\[\]]{0,300})\]"
_TARGET = rf"\[\s{{0,20}}{_LIST}\s{{0,20}},\s{{0,20}}{_LIST}"
_SIGN = re.compile(r"\brobtarget\b|\bMove[LJC]\s+[\w\[]|^[ \t]*MODULE\b", re.IGNORECASE | re.MULTILINE)
_GAP = r"\s{0,20}"
_DECLARED = re.compile(
    rf"\b(robtarget|jointtarget)\s{{1,20}}(\w{{1,64}}){_GAP}(\{{{_GAP}\d{{1,6}}{_GAP}\}})?{_GAP}:={_GAP}(?={_TARGET})",
    re.IGNORECASE,
)
_MOVE = re.compile(r"\bMove(L|J|C|AbsJ)(?:DO|Sync|AO|GO)?\b([^;]{0,1000});", re.IGNORECASE)
_NAME = re.compile(r"\s*(?:\\Conc\s*,)?\s*(\w{1,64})\s*(?:\\[^,]*)?(?:,|$)")
_OFFSET = re.compile(r"\s*Offs\s*\(\s*(\w{1,64})\s*,([^,()]*),([^,()]*),([^,()]*)\)", re.IGNORECASE)
_WORK_OBJECT = re.compile(r"\\WObj\s*:=\s*(\w{1,64})", re.IGNORECASE)


def looks_like(text: str) -> bool:
    """Whether there is something of RAPID in a text."""
    return _SIGN.search(text) is not None


def read(text: str, options: Options) -> Found:
    """The targets of a module.

    Raises:
        InvalidTaskFile: a target is not complete, computed by the program, or not in the file.
    """
    found = Found(
        stated(options.units, "mm", "the unit", "RAPID"),
        stated(options.rotation, "quaternion_wxyz", "the rotation", "RAPID"),
    )
    program = Program()
    code = collapsed(_without_comments(text))
    lines = Lines(code)
    for match in _DECLARED.finditer(code):
        name, line = match[2].upper(), lines.of(match.start())[0]
        if match[3]:
            raise InvalidTaskFile(f"{match[2]} is a list of targets; declare each by its own name.", line)
        program.declare(name, _target(match[4], match[5], line) if match[1].lower() == "robtarget" else None)
    for match in _MOVE.finditer(code):
        if match[1].upper() == "ABSJ":
            program.skipped += 1
        else:
            _move(match[2], lines.of(match.start())[0], 2 if match[1].upper() == "C" else 1, program)
    return program.into(found)


def _without_comments(text: str) -> str:
    """The same text, no comments; everything else stays where it is."""
    return "\n".join(
        line.split("!")[0] if '"' not in line or line.lstrip().startswith("!") else line for line in text.split("\n")
    )


def _move(arguments: str, line: int, count: int, program: Program) -> None:
    """The targets of one move; a circle has two."""
    frame = _WORK_OBJECT.search(arguments)
    rest, before = arguments, len(program.moves)
    for _ in range(count):
        rest = _next_target(rest, line, program)
    if frame is not None and frame[1].lower() != "wobj0":
        moved = program.moves[before:]
        framed = [Target(one.position, one.orientation, one.line, f"work object {frame[1]}") for one in moved]
        program.moves[before:] = framed


def _next_target(arguments: str, line: int, program: Program) -> str:
    """Take the first target of a list of arguments; returns what is behind it."""
    offset, written = _OFFSET.match(arguments), re.match(rf"\s*{_TARGET}", arguments)
    if offset is not None:
        name = offset[1].upper()
        program.move_to(name, line, offset[1])
        if name in program.points:
            shift = [number(offset[k], line, 0, "Offs") for k in (2, 3, 4)]
            program.moves[-1] = program.moves[-1].shifted(shift, line)
        return arguments[offset.end() :].lstrip().removeprefix(",")
    if written is not None:
        program.move(_target(written[1], written[2], line))
        return _behind_brackets(arguments)
    named = _NAME.match(arguments)
    if named is None:
        raise InvalidTaskFile(
            f"the target {quoted(arguments.strip())} is computed by the program; only names, numbers and Offs of a "
            "name are followed. Write it out.",
            line,
        )
    program.move_to(named[1].upper(), line, named[1])
    return arguments[named.end() :]


def _behind_brackets(arguments: str) -> str:
    """What follows the first list and its comma."""
    depth = 0
    for index, letter in enumerate(arguments):
        depth += (letter == "[") - (letter == "]")
        if letter == "]" and depth == 0:
            return arguments[index + 1 :].lstrip().removeprefix(",")
    return ""


def _target(position: str, orientation: str, line: int) -> Target:
    """A target of its first two lists."""
    where, turned = position.split(","), orientation.split(",")
    if len(where) != 3 or len(turned) != 4:
        raise InvalidTaskFile(
            f"a robtarget has {len(where)} and {len(turned)} numbers; [x, y, z] and [q1, q2, q3, q4] are needed.", line
        )
    return Target(
        tuple(number(part, line, 0, name) for name, part in zip("xyz", where, strict=True)),
        tuple(number(part, line, 0, f"q{k + 1}") for k, part in enumerate(turned)),
        line,
    )
