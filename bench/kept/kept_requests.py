"""Requests kept with the tests, as they were meant: each names the flange that was the only one when it was written."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from duocell.models.catalogue import catalogue

FOLDER = Path(__file__).resolve().parents[2] / "tests" / "data" / "acceptance" / "search"


def kept(name: str) -> dict[str, Any]:
    """A file of the folder with all that it says; its ``request`` names the flange of every robot of the catalogue."""
    read: dict[str, Any] = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))
    for arm in read["request"]["arms"]:
        if isinstance(arm["robot"], str) and arm["robot"] in catalogue.names():
            arm.setdefault("flange", catalogue.robot(arm["robot"]).flange_frame)
    return read
