"""Tables: a way-point a line, columns with names or named by the sender."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterator

from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.formats.columns import columns_of, found_in
from duocell.models.task_files.found import MOST_POINTS, Found, Options
from duocell.models.task_files.text import number

_COMMENT = ("#", "//", "%")
_WORD = re.compile(r"[A-Za-z°]")
_DECIMAL_COMMA = re.compile(r"\s*[-+]?\d{0,20},\d{1,20}([eE][-+]?\d{1,3})?\s*")


def looks_like(text: str) -> bool:
    """Whether the first line of a text has several cells."""
    first = next((line for _, line in _lines(text)), "")
    return len(_cells(first, _delimiter(first))) >= 3


def read(text: str, options: Options) -> Found:
    """The way-points of a table.

    Raises:
        InvalidTaskFile: a column is missing, a cell is no number, a line has other cells than the first.
    """
    lines = list(_lines(text))
    if not lines:
        raise InvalidTaskFile("there is no line but comments.")
    delimiter = _delimiter(lines[0][1])
    first = _cells(lines[0][1], delimiter)
    headed = any(_is_name(cell) for cell in first)
    if not headed and options.columns is None:
        raise InvalidTaskFile(
            f"the first line has {len(first)} numbers and no names; say what the columns are with `columns`, such as "
            "x,y,z,qx,qy,qz,qw.",
            lines[0][0],
        )
    names = options.columns or tuple(first)
    if len(names) != len(first):
        raise InvalidTaskFile(f"{len(first)} cells, but {len(names)} columns are named.", lines[0][0])
    columns = columns_of(names, options, lines[0][0])
    used = sorted({*columns.position, *columns.orientation})
    rows: list[tuple[int, list[float]]] = []
    for line, content in lines[1:] if headed else lines:
        if len(rows) >= MOST_POINTS:
            raise InvalidTaskFile(f"more than {MOST_POINTS} way-points; split the file.", line)
        cells = _cells(content, delimiter)
        if len(cells) != len(names):
            raise InvalidTaskFile(f"{len(cells)} cells, but the table has {len(names)} columns.", line)
        values = [0.0] * len(names)
        for index in used:
            values[index] = number(_with_point(cells[index], delimiter), line, index + 1, f"column {names[index]!r}")
        rows.append((line, values))
    return found_in(rows, columns, options)


def _lines(text: str) -> Iterator[tuple[int, str]]:
    """Lines that hold something, with their numbers."""
    for index, line in enumerate(text.split("\n"), 1):
        if line.strip() and not line.lstrip().startswith(_COMMENT):
            yield index, line


def _delimiter(line: str) -> str:
    """What separates the cells; a blank stands for any number of them."""
    return next((mark for mark in ("\t", ";", ",") if mark in line), " ")


def _cells(line: str, delimiter: str) -> list[str]:
    if delimiter == " ":
        return line.split()
    try:
        return next(csv.reader(io.StringIO(line), delimiter=delimiter, skipinitialspace=True), [])
    except csv.Error:
        return line.split(delimiter)


def _is_name(cell: str) -> bool:
    """Whether a cell is no number: exponents and `nan` apart, numbers have no letters."""
    return bool(_WORD.search(re.sub(r"(?<=\d)[eE](?=[-+\d])", "", cell)))


def _with_point(cell: str, delimiter: str) -> str:
    """A number with a decimal comma, as some spreadsheets write them between semicolons, with a point."""
    return cell.replace(",", ".") if delimiter != "," and _DECIMAL_COMMA.fullmatch(cell) else cell
