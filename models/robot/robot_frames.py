"""Named frames at both ends of a robot: flanges that a tool can be attached to, and the face it is mounted with."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import lru_cache
from math import radians
from pathlib import Path
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.base.pose import rotation_from_rpy

ISO_9787 = "iso9787"
"""Name of the frame of the mechanical interface: z points out of the flange, its origin lies in the flange's face."""

_DATA = Path(__file__).parents[1] / "catalogue" / "robots" / "frames.toml"


@dataclass(frozen=True, eq=False)
class RobotFrame:
    """A frame that moves with one end of a robot.

    Attributes:
        name: what requests call it.
        pose: (4, 4) m, of a flange in the last frame of the chain, of a mounting face in the base frame.
        source: where its place comes from.
        checked: a second source that says the same, or what it says otherwise; None where none was found.
    """

    name: str
    pose: Floats
    source: str
    checked: str | None = None

    def __post_init__(self) -> None:
        set_frozen(self, "pose", self.pose, (4, 4))


def frames_of(name: str, last_frame: str) -> tuple[tuple[RobotFrame, ...], RobotFrame | None]:
    """Flanges of a robot of the catalogue, the one of ISO 9787 first, and its mounting face, None where unknown.

    Args:
        name: of the robot in the catalogue.
        last_frame: name of the last frame of its chain, which is a flange too.
    """
    entry = _data()[name]
    iso = _frame(ISO_9787, entry["flange"])
    last = RobotFrame(last_frame, np.eye(4), "the last frame of the chain as its description has it")
    face = entry.get("mounting_face")
    return (iso, last), None if face is None else _frame("mounting face", face)


def _frame(name: str, entry: dict[str, Any]) -> RobotFrame:
    """A frame from its position [m], its roll, pitch and yaw [°] and its sources."""
    pose = np.eye(4)
    pose[:3, :3] = np.round(rotation_from_rpy([radians(angle) for angle in entry.get("rpy", [0.0, 0.0, 0.0])]), 15)
    pose[:3, 3] = entry.get("position", [0.0, 0.0, 0.0])
    return RobotFrame(name, pose, entry["source"], entry.get("checked"))


@lru_cache(maxsize=1)
def _data() -> dict[str, Any]:
    return tomllib.loads(_DATA.read_text(encoding="utf-8"))
