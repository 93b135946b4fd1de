"""What programs of robots have in common: points with names, and moves to them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.found import MOST_POINTS, Found


@dataclass(frozen=True, slots=True)
class Target:
    """A point of a program, in its own units and convention.

    Attributes:
        position, orientation: its numbers. line: where it stands, from 1.
        frame: what it is given in, "" if that is not told.
    """

    position: tuple[float, ...]
    orientation: tuple[float, ...]
    line: int
    frame: str = ""

    def shifted(self, offset: Sequence[float], line: int) -> Target:
        """The same orientation at another position."""
        position = tuple(a + b for a, b in zip(self.position, offset, strict=True))
        return Target(position, self.orientation, line, self.frame)


@dataclass(slots=True)
class Program:
    """Points by their names in the order in which they are declared, and moves in the order of the program.

    Attributes:
        points: by name, upper case where the language does not tell cases apart. joints: names of points that are
            joint values.
        moves: targets in order. skipped: moves to joint values.
    """

    points: dict[str, Target] = field(default_factory=dict)
    joints: set[str] = field(default_factory=set)
    moves: list[Target] = field(default_factory=list)
    skipped: int = 0

    def declare(self, name: str, target: Target | None) -> None:
        """A point; None: it is joint values."""
        if len(self.points) >= MOST_POINTS:
            raise InvalidTaskFile(f"more than {MOST_POINTS} points; split the file.")
        if target is None:
            self.joints.add(name)
        else:
            self.points[name] = target

    def move_to(self, name: str, line: int, shown: str = "") -> None:
        """A move to a point that was declared, before or after it.

        Raises:
            InvalidTaskFile: there is none of that name.
        """
        if name in self.joints:
            self.skipped += 1
            return
        if name not in self.points:
            raise InvalidTaskFile(
                f"there is no point {(shown or name)[:60]!r} in this file. Put the file with the points behind it.",
                line,
            )
        self.move(self.points[name])

    def move(self, target: Target) -> None:
        """A move to a point."""
        if len(self.moves) >= MOST_POINTS:
            raise InvalidTaskFile(f"more than {MOST_POINTS} moves; split the file.", target.line)
        self.moves.append(target)

    def into(self, found: Found) -> Found:
        """Way-points: the moves in their order, or the points where nothing moves.

        Raises:
            InvalidTaskFile: they are given in several frames.
        """
        targets = self.moves or list(self.points.values())
        frames = {target.frame: target.line for target in targets if target.frame}
        if len(frames) > 1:
            (first, _), (other, line) = list(frames.items())[:2]
            raise InvalidTaskFile(f"given in {other}, others in {first}; all need one frame.", line)
        if frames:
            found.notes.append(f"Points are given in {next(iter(frames))}.")
        if self.skipped or (self.joints and not self.moves):
            number = self.skipped or len(self.joints)
            found.notes.append(f"{number} targets were left out: they are joint values, not poses.")
        if not self.moves:
            found.notes.append("Nothing moves: the points are taken in the order in which they stand.")
        for target in targets:
            found.add(target.position, target.orientation, target.line)
        return found
