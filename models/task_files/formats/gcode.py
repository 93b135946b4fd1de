"""G-code (ISO 6983): lines and arcs of a tool whose axis is vertical, or given by its direction (A3=, B3=, C3=).

Rotary axes mean nothing without the machine, and are refused. The tool may turn about its axis.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from math import acos, atan2, ceil, cos, hypot, pi, sin, sqrt

from duocell.models.task_files.conventions import UNITS
from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.found import Found, Options, stated
from duocell.models.task_files.text import NUMBER, number

_SIGN = re.compile(r"^[ \t/%]*(?:[NO]\d{1,8}[ \t]*)*G\s*0*(?:0|1|17|18|19|20|21|90|91)\b", re.IGNORECASE | re.MULTILINE)
_WORD = re.compile(rf"([A-Z])(?:(\d)=)?\s*({NUMBER})", re.IGNORECASE)
_COMMENT = re.compile(r"\([^()\n]{0,500}\)|;.*")
MOTIONS = {0.0: "line", 1.0: "line", 2.0: "clockwise", 3.0: "counter-clockwise"}
PLANES = {17.0: (0, 1, 2), 18.0: (2, 0, 1), 19.0: (1, 2, 0)}
"""Axes of the plane, and the one across it."""
FRAMES = (54.0, 55.0, 56.0, 57.0, 58.0, 59.0)
HARMLESS = frozenset(
    {4.0, 9.0, 40.0, 43.0, 43.1, 44.0, 49.0, 50.0, 61.0, 64.0, 69.0, 80.0, 94.0, 95.0, 96.0, 97.0, 98.0, 99.0}
)
"""Codes that do not say where the tool goes, or switch off what would."""
NO_MOTION = frozenset({4.0, 10.0, 28.0, 30.0, 53.0})
"""Codes whose X, Y, Z are something else than a point of the way."""
MOST_OF_AN_ARC = 10_000
RADIUS_TOLERANCE = 2e-3
"""Share of the radius by which both ends of an arc may differ: printed digits."""


@dataclass(slots=True)
class _Machine:
    """What holds until it is changed.

    Attributes:
        position: of the tip, in the unit of the file. known: which of its coordinates are.
        motion: of the last G0 to G3. plane: of arcs. absolute: G90, not G91. unit: by G20 or G21.
        frame: the zero point, by G54 to G59. axis: from the tip into the tool.
    """

    position: list[float] = field(default_factory=lambda: [0.0, 0.0, 0.0])
    known: set[int] = field(default_factory=set)
    motion: str = ""
    plane: tuple[int, int, int] = PLANES[17.0]
    absolute: bool = True
    unit: str | None = None
    frame: float | None = None
    axis: list[float] = field(default_factory=lambda: [0.0, 0.0, 1.0])


def looks_like(text: str) -> bool:
    """Whether a line begins with a G code."""
    return _SIGN.search(text) is not None


def read(text: str, options: Options) -> Found:
    """The way of the tool; arcs become chords.

    Raises:
        InvalidTaskFile: a code moves the tool in a way that is not followed, a rotary axis, mixed units or frames.
    """
    found = Found("", stated(options.rotation, "tool_axis", "the rotation", "G-code"))
    machine = _Machine()
    for line, raw in enumerate(text.split("\n"), 1):
        words = _words(_COMMENT.sub("", raw), line)
        codes = [value for letter, value in words if letter == "G"]
        _set_modes(codes, machine, found, line)
        _refuse(words, line)
        if not NO_MOTION & set(codes):
            _go(words, machine, found, line, options)
        elif 28.0 in codes or 30.0 in codes:  # where the reference point is, only the machine knows
            machine.known -= {index for index, letter in enumerate("XYZ") if letter in dict(words)}
    if machine.unit is None and options.units is None:
        found.guessed.append("The unit is mm: there is neither G20 nor G21.")
    found.units = (
        options.units or "mm" if machine.unit is None else stated(options.units, machine.unit, "the unit", "G20/G21")
    )
    found.notes.append(
        "The z axis of the poses points out of the tool, which may turn about it: the roll was chosen so that it "
        "changes least."
    )
    return found


def _words(code: str, line: int) -> list[tuple[str, float]]:
    """Letters with numbers; those of a direction (`A3=`) are called A3, B3, C3."""
    words = []
    for match in _WORD.finditer(code):
        letter = match[1].upper() + (match[2] or "")
        words.append((letter, number(match[3], line, match.start() + 1, letter)))
    return words


def _set_modes(codes: list[float], machine: _Machine, found: Found, line: int) -> None:
    """What the codes of a line change."""
    for code in codes:
        if code in MOTIONS:
            machine.motion = MOTIONS[code]
        elif code in PLANES:
            machine.plane = PLANES[code]
        elif code in (90.0, 91.0):
            machine.absolute = code == 90.0
        elif code in (20.0, 21.0, 70.0, 71.0):
            machine.unit = _unit(code, machine, found, line)
        elif code in FRAMES:
            if machine.frame not in (None, code) and found.positions:
                raise InvalidTaskFile(
                    f"G{code:g} after G{machine.frame:g}: points of several zero points. Split the file.", line
                )
            machine.frame = code
        elif code not in HARMLESS and code not in NO_MOTION and code != 91.1:
            raise InvalidTaskFile(
                f"G{code:g} is not followed; known are lines and arcs (G0 to G3). Write it out.", line
            )


def _unit(code: float, machine: _Machine, found: Found, line: int) -> str:
    unit = "inch" if code in (20.0, 70.0) else "mm"
    if found.positions and unit != (machine.unit or "mm"):
        raise InvalidTaskFile(f"mixed units: G{code:g} after the first point. Write the file in one unit.", line)
    return unit


def _refuse(words: list[tuple[str, float]], line: int) -> None:
    """Rotary axes and other programs."""
    for letter, value in words:
        if letter in ("A", "B", "C"):
            raise InvalidTaskFile(
                f"the rotary axis {letter} means nothing without the machine. Export APT/CL, or A3= B3= C3=.",
                line,
            )
        if letter == "M" and value == 98.0:
            raise InvalidTaskFile("M98 calls another program; write it out.", line)


def _go(words: list[tuple[str, float]], machine: _Machine, found: Found, line: int, options: Options) -> None:
    """The way of one line."""
    given = dict(words)
    direction = [given.get(f"{letter}3") for letter in "ABC"]
    if any(value is not None for value in direction):
        machine.axis = _direction(direction, line)
    end = list(machine.position)
    moved = [index for index, letter in enumerate("XYZ") if letter in given]
    for index in moved:
        value = given["XYZ"[index]]
        end[index] = value if machine.absolute else end[index] + value
    arc = machine.motion in ("clockwise", "counter-clockwise") and bool({"I", "J", "K", "R"} & given.keys())
    if not moved and not arc:
        return
    machine.known.update(moved)
    if not machine.motion:
        raise InvalidTaskFile("there is a position, but no G0 to G3 before it.", line)
    if machine.motion == "line":
        points = [end]
    else:
        unit = UNITS[options.units or machine.unit or "mm"]
        points = _arc(machine, end, given, line, options.arc_tolerance / unit)
    machine.position = end
    if len(machine.known) == 3:
        for point in points:
            found.add(point, machine.axis, line)


def _direction(values: list[float | None], line: int) -> list[float]:
    numbers = [0.0 if value is None else value for value in values]
    length = sqrt(sum(value * value for value in numbers))
    if length < 1e-9:
        raise InvalidTaskFile("the direction A3, B3, C3 of the tool is zero.", line)
    return [value / length for value in numbers]


def _arc(
    machine: _Machine, end: list[float], given: dict[str, float], line: int, tolerance: float
) -> list[list[float]]:
    """Points of an arc or a helix whose chords are within the tolerance, its end the last of them."""
    if len(machine.known) < 3:
        raise InvalidTaskFile("an arc begins before X, Y and Z are known.", line)
    first, second, across = machine.plane
    start = machine.position
    turn = -1.0 if machine.motion == "clockwise" else 1.0
    center = _center(machine, end, given, line)
    radius = hypot(start[first] - center[0], start[second] - center[1])
    other = hypot(end[first] - center[0], end[second] - center[1])
    if radius == 0.0 or abs(radius - other) > RADIUS_TOLERANCE * radius + tolerance:
        raise InvalidTaskFile(
            f"the ends of the arc are {radius:.6g} and {other:.6g} from its centre; these must be the same.", line
        )
    begin = atan2(start[second] - center[1], start[first] - center[0])
    sweep = turn * (atan2(end[second] - center[1], end[first] - center[0]) - begin)
    sweep = sweep % (2.0 * pi)
    if sweep < 1e-9:
        sweep = 2.0 * pi
    step = 2.0 * acos(max(1.0 - tolerance / radius, -1.0)) or 1e-3
    count = min(max(ceil(sweep / step), 1), MOST_OF_AN_ARC)
    points = []
    for index in range(1, count):
        share = index / count
        point = [0.0, 0.0, 0.0]
        angle, size = begin + turn * sweep * share, radius + (other - radius) * share
        point[first], point[second] = center[0] + size * cos(angle), center[1] + size * sin(angle)
        point[across] = start[across] + share * (end[across] - start[across])
        points.append(point)
    return [*points, end]


def _center(machine: _Machine, end: list[float], given: dict[str, float], line: int) -> tuple[float, float]:
    """Centre of an arc in its plane: I, J, K from its start, or by its radius R (negative: more than half a turn)."""
    first, second, _ = machine.plane
    start = machine.position
    if "R" not in given:
        return start[first] + given.get("IJK"[first], 0.0), start[second] + given.get("IJK"[second], 0.0)
    radius = given["R"]
    dx, dy = end[first] - start[first], end[second] - start[second]
    chord = hypot(dx, dy)
    if chord < 1e-12 or 2.0 * abs(radius) < chord * (1.0 - RADIUS_TOLERANCE):
        raise InvalidTaskFile(f"no arc of radius {abs(radius):g} leads over a chord of {chord:g}.", line)
    height = sqrt(max(radius * radius - 0.25 * chord * chord, 0.0))
    side = 1.0 if (machine.motion == "counter-clockwise") == (radius > 0.0) else -1.0
    return (
        start[first] + 0.5 * dx - side * height * dy / chord,
        start[second] + 0.5 * dy + side * height * dx / chord,
    )
