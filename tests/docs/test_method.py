"""The page of the mathematics: its sections are numbered in order, and code cites sections that are there."""

from __future__ import annotations

import re
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
HEADING = re.compile(r"^(##|###) (\d+(?:\.\d+)?) \S", re.MULTILINE)
CITED = re.compile(r"docs/method\.md, section (\d+(?:\.\d+)?)")
MENTIONED = re.compile(r"docs/method\.md")


def sections() -> list[str]:
    """Numbers of the sections in the order of the page."""
    return [number for _, number in HEADING.findall((ROOT / "docs" / "method.md").read_text())]


def sources() -> dict[Path, str]:
    """Texts of the sources, with every stretch of blanks as one: a citation may be broken by the end of a line."""
    rooms = ("models", "optimizer", "service", "bench")
    files = (path for room in rooms for path in (ROOT / room).rglob("*.py"))
    return {path: re.sub(r"\s+", " ", path.read_text()) for path in files}


def test_sections_are_numbered_in_order() -> None:
    numbers = [tuple(map(int, number.split("."))) for number in sections()]
    assert numbers == sorted(set(numbers))
    for *parent, last in numbers:
        assert last == 1 or (*parent, last - 1) in numbers
        assert not parent or tuple(parent) in numbers


def test_no_section_is_without_a_number() -> None:
    page = (ROOT / "docs" / "method.md").read_text()
    assert len(re.findall(r"^#{2,} ", page, re.MULTILINE)) == len(sections())


def test_sections_that_code_cites_are_there() -> None:
    known = set(sections())
    cited = {(path.name, number) for path, text in sources().items() for number in CITED.findall(text)}
    assert len(cited) > 10
    assert {(name, number) for name, number in cited if number not in known} == set()


def test_code_says_which_section_it_means() -> None:
    vague = [path.name for path, text in sources().items() if len(MENTIONED.findall(text)) != len(CITED.findall(text))]
    assert vague == []
