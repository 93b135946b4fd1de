"""The text of a file, and numbers in it."""

from __future__ import annotations

import re
from bisect import bisect_right
from math import isfinite

from duocell.models.task_files.errors import InvalidTaskFile, quoted

NUMBER = r"[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:[eE][-+]?\d{1,4})?"
"""A decimal number, as every format here writes it."""
LARGEST = 1e9
"""Of the numbers of a file, in whatever unit."""
_NUMBER = re.compile(NUMBER)
_BLANKS = re.compile(r"[ \t\f\v]+")


def decoded(data: bytes) -> str:
    """The text of a file: UTF-8, or the Latin letters of older controllers, whose lines may end in any way.

    Raises:
        InvalidTaskFile: it is no text, or empty.
    """
    if b"\0" in data:
        raise InvalidTaskFile(
            "the file is no text: it has zero bytes. Save it as text; a binary program (.tp) has to be exported."
        )
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError:
        text = data.decode("latin-1")
    if not text.strip():
        raise InvalidTaskFile("the file is empty.")
    return text.replace("\r\n", "\n").replace("\r", "\n")


def number(text: str, line: int, column: int = 0, what: str = "this value") -> float:
    """A number of a file.

    Raises:
        InvalidTaskFile: it is none, or larger than anything that is meant.
    """
    stripped = text.strip()
    if _NUMBER.fullmatch(stripped) is None:
        raise InvalidTaskFile(
            f"{what} is {quoted(stripped)}; a plain number with a decimal point is needed.", line, column
        )
    return checked(float(stripped), line, column, what)


def checked(value: float, line: int, column: int = 0, what: str = "this value") -> float:
    """A number that no position and no angle is larger than.

    Raises:
        InvalidTaskFile: it is larger, or not finite.
    """
    if not isfinite(value) or abs(value) > LARGEST:
        raise InvalidTaskFile(f"{what} is {value:g}; at most {LARGEST:g} either way makes sense.", line, column)
    return value


def collapsed(text: str) -> str:
    """The text with one blank for many: what searches it cannot be made slow by them."""
    return _BLANKS.sub(" ", text)


class Lines:
    """Where the lines of a text begin."""

    def __init__(self, text: str) -> None:
        self._starts = [0, *(match.end() for match in re.finditer("\n", text))]

    def of(self, offset: int) -> tuple[int, int]:
        """Line and column, from 1, of a character."""
        line = bisect_right(self._starts, offset)
        return line, offset - self._starts[line - 1] + 1
