"""Nothing that a test starts writes into the tree, and properties are tried on the same examples every time."""

from pathlib import Path

import hypothesis
import pytest

# A test must not fail by chance. Long random trials are commands of bench/.
hypothesis.settings.register_profile("same", derandomize=True, database=None, deadline=None)
hypothesis.settings.load_profile("same")


@pytest.fixture(autouse=True)
def _own_data_dir(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Services keep their jobs in the folder of the test, unless they are told otherwise."""
    monkeypatch.setenv("DUOCELL_DATA_DIR", str(tmp_path / "data"))
