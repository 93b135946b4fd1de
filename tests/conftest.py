"""Nothing that a test starts writes into the tree."""

from pathlib import Path

import pytest


@pytest.fixture(autouse=True)
def _own_data_dir(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """Services keep their jobs in the folder of the test, unless they are told otherwise."""
    monkeypatch.setenv("DUOCELL_DATA_DIR", str(tmp_path / "data"))
