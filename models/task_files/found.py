"""What is asked of the reader of a file, and what a parser finds in it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from duocell.models.task_files.errors import InvalidTaskFile

MOST_POINTS = 50_000
"""Way-points that are read from one file."""
ARC_TOLERANCE = 1e-4
"""m; how far the chords of an arc may be from it where nobody says."""


@dataclass(frozen=True, slots=True)
class Options:
    """What the sender of a file says about it; None: to be found out.

    Attributes:
        format: name in `duocell.models.task_files.reading.FORMATS`.
        units: name in `duocell.models.task_files.conventions.UNITS`.
        rotation: name in `duocell.models.task_files.conventions.ROTATIONS`.
        columns: names of the columns of a table, in their order.
        arc_tolerance: m, largest distance of a chord from its arc.
    """

    format: str | None = None
    units: str | None = None
    rotation: str | None = None
    columns: tuple[str, ...] | None = None
    arc_tolerance: float = ARC_TOLERANCE


@dataclass(slots=True)
class Found:
    """Way-points of a file in its own units and convention.

    Attributes:
        units: of the positions. rotation: convention of the orientations.
        positions: three numbers each. orientations: as many as the convention has, or none.
        lines: where each way-point stands, from 1.
        columns: what was taken for what, of tables.
        guessed: sentences about what the file does not say. notes: about what was left out or needs to be known.
    """

    units: str
    rotation: str
    positions: list[Sequence[float]] = field(default_factory=list)
    orientations: list[Sequence[float]] = field(default_factory=list)
    lines: list[int] = field(default_factory=list)
    columns: tuple[str, ...] = ()
    guessed: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)

    def add(self, position: Sequence[float], orientation: Sequence[float], line: int) -> None:
        """One more way-point.

        Raises:
            InvalidTaskFile: there are too many.
        """
        if len(self.positions) >= MOST_POINTS:
            raise InvalidTaskFile(f"more than {MOST_POINTS} way-points; split the file.", line)
        self.positions.append(position)
        self.orientations.append(orientation)
        self.lines.append(line)


def stated(given: str | None, known: str, what: str, source: str) -> str:
    """What a format fixes, unless its sender says otherwise.

    Raises:
        InvalidTaskFile: the two differ.
    """
    if given is not None and given != known:
        raise InvalidTaskFile(f"{what} is given as {given!r}, but {source} has {known}. Leave it out.")
    return known
