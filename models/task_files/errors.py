"""What is wrong with a file that holds a task."""

from __future__ import annotations

from duocell.models.base.errors import InvalidTask

LONGEST = 60
"""Characters of a value that is quoted."""


class InvalidTaskFile(InvalidTask):
    """A file that holds no task that could be understood.

    Attributes:
        line: number of the line that is to blame, from 1; 0: the file as a whole.
        column: likewise in that line; 0: the line as a whole.
    """

    def __init__(self, detail: str, line: int = 0, column: int = 0) -> None:
        place = f"line {line}" + (f", column {column}" if column else "") if line else ""
        super().__init__(f"{place}: {detail}" if place else detail)
        self.line = line
        self.column = column


def quoted(value: object) -> str:
    """A value as it may stand in a sentence: never pages of it."""
    text = repr(value[: LONGEST + 1] if isinstance(value, str) else value)
    return text if len(text) <= LONGEST else text[: LONGEST - 1] + "…"
