"""The three floors: arrows only downwards, small modules."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
FLOORS = ("service", "optimizer", "models")
MODULES = sorted(path for floor in FLOORS for path in (ROOT / floor).rglob("*.py"))


def imported_roots(path: Path) -> set[str]:
    roots = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            roots |= {alias.name.split(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            roots.add(node.module.split(".")[0])
    return roots


@pytest.mark.parametrize(("floor", "above"), [("models", {"optimizer", "service"}), ("optimizer", {"service"})])
def test_no_floor_imports_one_above(floor: str, above: set[str]) -> None:
    offenders = {path.name: found for path in (ROOT / floor).rglob("*.py") if (found := imported_roots(path) & above)}
    assert not offenders


@pytest.mark.parametrize("floor", ["models", "optimizer"])
def test_lower_floors_load_no_web_framework(floor: str) -> None:
    code = (
        f"import importlib, pkgutil, sys, {floor}\n"
        f"[importlib.import_module(m.name) for m in pkgutil.walk_packages({floor}.__path__, '{floor}.')]\n"
        "print(sorted({'fastapi', 'uvicorn', 'pydantic', 'rich', 'matplotlib', 'service'} & set(sys.modules)))"
    )
    run = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.stdout.strip() == "[]", run.stderr


@pytest.mark.parametrize("path", MODULES, ids=lambda path: str(path.relative_to(ROOT)))
def test_modules_stay_small(path: Path) -> None:
    assert len(path.read_text().splitlines()) <= 350
