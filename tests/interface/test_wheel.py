"""A wheel, installed into a fresh environment, works from a folder that has a ``models/`` of its own."""

import os
import shutil
import site
import subprocess
import sys
import venv
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
SCRIPT = """
import json
import sys

import models  # the user's own
from models.cell import NAME

import duocell

assert duocell.__file__.startswith(sys.prefix), duocell.__file__
request = duocell.read_request(sys.argv[1])
layout = duocell.optimize(request.cell, request.settings)
document = request.document(layout)
print(NAME, layout.outcome, round(layout.objective, 3), document["result"]["version"])
"""


def run(*command: object, folder: Path) -> str:
    """Output of a command that sees nothing of this checkout."""
    environment = {key: value for key, value in os.environ.items() if key != "PYTHONPATH"}
    done = subprocess.run(
        [str(part) for part in command], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built with the build backend of the lock, from a copy: a build writes beside its sources."""
    folder = tmp_path_factory.mktemp("build")
    source = folder / "source"
    for name in ("models", "optimizer", "service", "src"):
        shutil.copytree(
            ROOT / name, source / name, symlinks=True, ignore=shutil.ignore_patterns("__pycache__", "*.egg-info")
        )
    for name in ("pyproject.toml", "README.md", "LICENSE", "NOTICE"):
        shutil.copy(ROOT / name, source)
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet")
    run(*pip, "wheel", "--no-index", "--no-build-isolation", "--no-deps", "--wheel-dir", folder, source, folder=folder)
    (built,) = folder.glob("duocell-*.whl")
    return built


@pytest.fixture(scope="module")
def python(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The interpreter of an environment with the wheel in it, and with the dependencies of this one."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    interpreter = folder / "bin" / "python"
    pip = (sys.executable, "-m", "pip", "--disable-pip-version-check", "--quiet", "--python", interpreter)
    run(*pip, "install", "--no-index", "--no-deps", wheel, folder=folder)
    (packages,) = folder.glob("lib/python*/site-packages")
    # A path in a .pth file brings packages and none of the .pth files beside them, so not an editable install of this
    # checkout; Pinocchio's own packages stand deeper, where a .pth file of theirs points to.
    places = [Path(place) for place in site.getsitepackages()]
    deeper = [path for place in places for path in place.glob("cmeel.prefix/lib/python*/site-packages")]
    (packages / "dependencies.pth").write_text("".join(f"{path}\n" for path in (*places, *deeper)))
    return interpreter


def test_it_holds_the_package_alone(wheel: Path) -> None:
    names = run(sys.executable, "-m", "zipfile", "--list", wheel, folder=wheel.parent).splitlines()[1:]
    assert {name.split("/")[0] for name in names} == {"duocell", f"{wheel.name.split('-py3')[0]}.dist-info"}
    held = {name.split()[0] for name in names}
    assert {f"duocell/{floor}py.typed" for floor in ("", "models/", "optimizer/", "service/")} <= held
    data = [path for path in (ROOT / "models" / "catalogue" / "robots").rglob("*") if path.is_file()]
    assert len(data) > 0
    assert {f"duocell/{path.relative_to(ROOT)}" for path in data} <= held


def test_an_example_is_solved_beside_models_of_the_users_own(python: Path, tmp_path: Path) -> None:
    for name in ("models", "optimizer", "service"):
        (tmp_path / name).mkdir()
        (tmp_path / name / "__init__.py").write_text('"""Mine."""\n')
    (tmp_path / "models" / "cell.py").write_text('NAME = "mine"\n')
    (tmp_path / "solve.py").write_text(SCRIPT)
    printed = run(python, "solve.py", ROOT / "examples" / "line.json", folder=tmp_path)
    assert printed.split()[:3] == ["mine", "optimal", "155.201"]
    assert printed.split()[3] != "0"


def test_the_command_is_installed(python: Path, tmp_path: Path) -> None:
    assert "Finds where to bolt down" in run(python.parent / "duocell", "--help", folder=tmp_path)
