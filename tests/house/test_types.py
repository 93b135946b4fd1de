"""What mypy looks at is everything that people write here, and nothing is let off."""

from __future__ import annotations

import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
SETTINGS = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["mypy"]


def test_all_folders_with_sources_are_checked_strictly() -> None:
    assert SETTINGS["strict"] is True
    assert {"ignore-without-code", "redundant-expr", "truthy-bool"} <= set(SETTINGS["enable_error_code"])
    assert set(SETTINGS["packages"]) == {"duocell", "bench", "examples", "tests"}
    assert "exclude" not in SETTINGS


def test_only_packages_of_others_are_let_off_for_what_they_do_not_publish() -> None:
    for exception in SETTINGS["overrides"]:
        assert set(exception) == {"module", "ignore_missing_imports"}
        assert not any(name.split(".")[0] in SETTINGS["packages"] for name in exception["module"])
