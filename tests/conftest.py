"""Nothing that a test starts writes into the tree or imports sources of another one, and properties are tried on the
same examples every time."""

import os
from pathlib import Path

import hypothesis
import pytest

# What tests start imports the sources of this tree, as the tests do (`pythonpath` in pyproject.toml).
SOURCES = str(Path(__file__).parents[1] / "src")
os.environ["PYTHONPATH"] = os.pathsep.join(filter(None, [SOURCES, os.environ.get("PYTHONPATH")]))

# A test must not fail by chance. Long random trials are commands of bench/.
hypothesis.settings.register_profile("same", derandomize=True, database=None, deadline=None)
hypothesis.settings.load_profile("same")


@pytest.fixture(autouse=True)
def _own_data_dir(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Services keep their jobs in the folder of the test, unless they are told otherwise."""
    monkeypatch.setenv("DUOCELL_DATA_DIR", str(tmp_path / "data"))
