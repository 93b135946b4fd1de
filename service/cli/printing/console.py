"""What all tables have in common."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import IO

from rich.console import Console
from rich.markup import escape
from rich.table import Table

NONE = "-"
PLAIN_WIDTH = 160
"""Columns where the output is no terminal."""
WORDS = ("arm", "posture", "name", "model", "joint", "job", "class", "nearest pair", "where")
"""Headings of columns that hold words; the others hold numbers."""


def console_on(file: IO[str] | None = None) -> Console:
    """A console that does not fold tables in files and pipes."""
    console = Console(file=file, highlight=False, soft_wrap=False)
    return console if console.is_terminal else Console(file=file, highlight=False, width=PLAIN_WIDTH)


def table(title: str, headings: Sequence[str]) -> Table:
    """A table without rows."""
    made = Table(title=escape(title) or None, title_justify="left")
    for heading in headings:
        made.add_column(escape(heading), justify="left" if heading in WORDS else "right")
    return made


def in_degrees(value: float | None) -> str:
    """An angle [rad]."""
    return NONE if value is None else f"{degrees(value):.1f}"


def in_millimetres(value: float | None) -> str:
    """A length [m]."""
    return NONE if value is None else f"{round(1000.0 * value, 1) + 0.0:.1f}"  # never -0.0


def in_its_unit(value: float | None, unit: str) -> str:
    """An angle [rad] in degrees, without a unit, as tables of angles have it; a length [m] with millimetres."""
    return in_degrees(value) if unit == "rad" or value is None else f"{in_millimetres(value)} mm"


def number(value: float | None, digits: int) -> str:
    """A number with some decimals."""
    return NONE if value is None else f"{value:.{digits}f}"
