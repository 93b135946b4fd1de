"""Files and commands that documents and docstrings name are there."""

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
SOURCES = [
    path for folder in ("models", "optimizer", "service", "bench", "src") for path in (ROOT / folder).rglob("*.py")
]

FILES = re.compile(r"(?<![\w/.])(?:models|optimizer|service|bench|tests|examples|docs)/[\w./-]+\.(?:py|toml|md|json)\b")
MODULES = re.compile(r"(?:python -m |`)((?:duocell\.(?:models|optimizer|service)|bench|tests)\.[a-z][\w.]*\w)")


def is_there(module: str) -> bool:
    """A module or package, or something that a module defines."""
    parts = module.split(".")
    for count in range(len(parts), 0, -1):
        path = ROOT.joinpath(*(["src"] if parts[0] == "duocell" else []), *parts[:count])
        source = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        if source.exists() or (path.is_dir() and count == len(parts)):
            return count == len(parts) or re.search(rf"\b{parts[count]}\b", source.read_text()) is not None
    return False


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_what_a_page_names_is_there(page: Path) -> None:
    text = page.read_text()
    assert [name for name in sorted(set(FILES.findall(text))) if not (ROOT / name).exists()] == []
    assert [name for name in sorted(set(MODULES.findall(text))) if not is_there(name)] == []


def test_what_docstrings_name_is_there() -> None:
    named = {(path, name) for path in SOURCES for name in FILES.findall(path.read_text())}
    assert [(path.name, name) for path, name in sorted(named) if not (ROOT / name).exists()] == []
    assert len({name for _, name in named if name.startswith("docs/")}) > 3
    modules = {(path, name) for path in SOURCES for name in MODULES.findall(path.read_text())}
    assert [(path.name, name) for path, name in sorted(modules) if not is_there(name)] == []


def test_every_decision_has_a_number_of_its_own() -> None:
    pages = sorted((ROOT / "docs" / "decisions").glob("*.md"))
    numbers = [page.name[:4] for page in pages]
    assert [number for number in numbers if numbers.count(number) > 1] == []
    assert [page.name for page in pages if not page.read_text().startswith(f"# {page.name[:4]} ")] == []
