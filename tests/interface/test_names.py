"""The names of `duocell`: all there, all documented, and nothing is loaded before one is used."""

import subprocess
import sys
from pathlib import Path

import pytest

import duocell

ROOT = Path(__file__).parents[2]


def printed(code: str) -> str:
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    return run.stdout.strip()


@pytest.mark.parametrize("name", duocell.__all__)
def test_every_name_is_there_and_documented(name: str) -> None:
    value = getattr(duocell, name)
    assert value.__doc__
    assert not value.__doc__.startswith(f"{name}("), "the docstring that a dataclass makes for itself"
    assert f"`{name}`" in str(duocell.__doc__)
    assert name in dir(duocell)


def test_other_names_are_not() -> None:
    with pytest.raises(AttributeError, match="no attribute 'optimise'"):
        _ = duocell.optimise  # type: ignore[attr-defined]


def test_nothing_is_loaded_before_it_is_used() -> None:
    code = (
        "import sys, duocell\n"
        "print(sorted(m for m in sys.modules if m.startswith('duocell.') or m in ('numpy', 'casadi', 'pydantic')))"
    )
    assert printed(code) == "[]"


def test_cells_are_built_and_solved_without_the_service() -> None:
    code = (
        "import sys, duocell\n"
        "duocell.make_arm, duocell.line, duocell.pose, duocell.Cell, duocell.optimize, duocell.evaluate\n"
        "print(sorted(m for m in sys.modules if m.startswith('duocell.service') or m in ('fastapi', 'pydantic')))"
    )
    assert printed(code) == "[]"
