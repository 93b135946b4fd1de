"""URScript of Universal Robots: `p[x, y, z, rx, ry, rz]` in m, with a rotation vector in rad."""

from __future__ import annotations

import re

from duocell.models.task_files.errors import InvalidTaskFile, quoted
from duocell.models.task_files.formats.program import Program, Target
from duocell.models.task_files.found import Found, Options, stated
from duocell.models.task_files.text import collapsed, number

_POSE = re.compile(r"p\s*\[([^\]\n]{0,400})\]")
_SIGN = re.compile(r"\bp\s*\[[^\]\n]{0,400}\]")
_ASSIGNED = re.compile(r"^\s*(?:global\s+|local\s+)?([A-Za-z_]\w{0,80})\s*=\s*(p?)\s*\[([^\]\n]{0,400})\]\s*$")
_MOVE = re.compile(r"^\s*(move[jlpc]|servo[jc]|movec)\s*\(\s*(.*)$")
_NAME = re.compile(r"[A-Za-z_]\w{0,80}")
_COMPUTED = ("pose_trans", "pose_add", "interpolate_pose", "get_inverse_kin", "get_forward_kin", "pose_inv")


def looks_like(text: str) -> bool:
    """Whether there is a pose as URScript writes it."""
    return _SIGN.search(text) is not None


def read(text: str, options: Options) -> Found:
    """The targets of a script.

    Raises:
        InvalidTaskFile: a pose has other than six numbers, or is computed by the script.
    """
    found = Found(
        stated(options.units, "m", "the unit", "URScript"),
        stated(options.rotation, "axis_angle", "the rotation", "URScript"),
    )
    program = Program()
    moves: list[tuple[int, str, int]] = []
    for line, raw in enumerate(collapsed(text).split("\n"), 1):
        code = raw.split("#")[0]
        assigned, move = _ASSIGNED.match(code), _MOVE.match(code)
        if assigned is not None:
            values = assigned[3]
            program.declare(assigned[1], _target(values, line, assigned.start(3)) if assigned[2] else None)
        elif move is not None:
            moves.append((line, move[2], move.start(2)))
        else:
            for index, match in enumerate(_POSE.finditer(code)):
                program.declare(f"{line}.{index}", _target(match[1], line, match.start(1)))
    for line, arguments, column in moves:
        _move(arguments, line, column, program)
    return program.into(found)


def _move(arguments: str, line: int, column: int, program: Program) -> None:
    """The targets of one move; that of a circle has two."""
    if arguments.startswith(_COMPUTED):
        raise InvalidTaskFile(
            f"the target {quoted(arguments)} is computed by the script; write the pose out as p[x, y, z, rx, ry, rz].",
            line,
        )
    poses = list(_POSE.finditer(arguments))
    if poses:
        for match in poses:
            program.move(_target(match[1], line, column + match.start(1)))
        return
    if arguments.startswith("["):
        program.skipped += 1
        return
    for part in arguments.split(")")[0].split(",")[:2]:
        name = part.strip()
        if _NAME.fullmatch(name) and (name in program.points or name in program.joints):
            program.move_to(name, line)
        elif part is arguments.split(")")[0].split(",")[0]:
            raise InvalidTaskFile(f"the target {quoted(name)} is no pose and no name of one in this file.", line)


def _target(values: str, line: int, column: int) -> Target:
    """A pose of six numbers."""
    parts = values.split(",")
    if len(parts) != 6:
        raise InvalidTaskFile(f"a pose p[…] has {len(parts)} numbers; six are needed.", line, column + 1)
    numbers = [number(part, line, column + 1, f"p[{index}]") for index, part in enumerate(parts)]
    return Target(tuple(numbers[:3]), tuple(numbers[3:]), line)
