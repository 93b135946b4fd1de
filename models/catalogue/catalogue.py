"""Robots by name: the source's PUMA 560 and every arm that ssik ships.

Names are those of ssik without ``_ik``; ssik's own PUMA variant is ``puma560_ssik``. An arm is loaded when it is asked
for and then kept. Geometry and limits are ssik's; `robots/arms.toml` adds what ssik does not know.
"""

from __future__ import annotations

import re
import tomllib
from dataclasses import replace
from difflib import get_close_matches
from functools import lru_cache
from importlib.metadata import version
from math import inf, radians
from pathlib import Path
from typing import Any

import numpy as np
import ssik
from ssik.prebuilt._manifest import Arm as ShippedArm
from ssik.prebuilt._manifest import load_manifest

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import UnknownRobot
from duocell.models.catalogue.dh import DhRow, robot_from_dh
from duocell.models.catalogue.reference import working_reference
from duocell.models.robot.linear_limits import LinearLimits, row_name
from duocell.models.robot.robot import Robot
from duocell.models.robot.robot_frames import frames_of

SOURCE_PUMA = "puma560"

_DATA = Path(__file__).parent / "robots" / "arms.toml"
_LICENCES = re.compile(r"\b(Apache-2\.0|BSD-3-Clause|MIT)\b")
_UNKNOWN_LICENCE = "see source"

# Table 4.1 of the source with its two misprints repaired (α4 and α5 are printed 0): α [°], a [mm], d [mm], limits [°].
_PUMA_TABLE = (
    (-90.0, 0.0, 0.0, -160.0, 160.0),
    (0.0, 431.8, 149.1, -185.0, 45.0),
    (90.0, -20.3, 0.0, -45.0, 225.0),
    (-90.0, 0.0, 433.1, -110.0, 170.0),
    (90.0, 0.0, 0.0, -100.0, 100.0),
    (0.0, 0.0, 56.3, -266.0, 266.0),
)


def names() -> list[str]:
    """Names of all robots, sorted."""
    return sorted([SOURCE_PUMA, *_artifacts()])


@lru_cache(maxsize=128)
def robot(name: str) -> Robot:
    """The robot of a catalogue name.

    Raises:
        UnknownRobot: no such name; the detail lists near ones.
    """
    if name == SOURCE_PUMA:
        return _source_puma()
    if name not in _artifacts():
        near = get_close_matches(name, names(), n=5, cutoff=0.4) or names()[:5]
        raise UnknownRobot(
            f"no robot is called {name[:80]!r}; the nearest of {len(names())} names are {', '.join(near)}. "
            "See the list of robots, or send a D-H table."
        )
    return _shipped(name)


@lru_cache(maxsize=1)
def _artifacts() -> dict[str, ShippedArm]:
    """Catalogue name -> entry of ssik's manifest."""
    entries = {name.removesuffix("_ik"): arm for name, arm in load_manifest().items()}
    return {f"{name}_ssik" if name == SOURCE_PUMA else name: arm for name, arm in entries.items()}


@lru_cache(maxsize=1)
def _remarks() -> dict[str, Any]:
    """The hand-written data."""
    return tomllib.loads(_DATA.read_text(encoding="utf-8"))


def _source_puma() -> Robot:
    """The PUMA 560 of every example of the source."""
    rows = [
        DhRow(alpha=radians(alpha), a=a / 1000.0, d=d / 1000.0, lower=radians(lower), upper=radians(upper))
        for alpha, a, d, lower, upper in _PUMA_TABLE
    ]
    robot = robot_from_dh(SOURCE_PUMA, rows)
    flanges, mounting_face = frames_of(SOURCE_PUMA, robot.flange_frame)
    return replace(
        robot,
        flanges=flanges,
        mounting_face=mounting_face,
        reference_source="mid-range, as the source defines it",
        maker="Unimation",
        title="Unimation PUMA 560 (table of the source)",
        source="F. Ranjbaran, M.A.Sc. thesis, Concordia University, 1991: Table 4.1, with α4 and α5 from its (4.1)",
        licence="published table of numbers",
        notes=(
            "The base frame is at shoulder height, where joint axes 1 and 2 meet, not at floor or mounting face.",
            "The mid-range reference has joint 5 at 0°, a wrist singularity; send a reference to steer away from it.",
        ),
    )


def _shipped(name: str) -> Robot:
    """An arm of ssik as a Robot."""
    arm = _artifacts()[name]
    remarks = _remarks()
    own: dict[str, Any] = remarks["arms"].get(name, {})
    joints = ssik.Manipulator.from_prebuilt(arm.name).kinbody.joints
    placements, before = [], np.eye(4)
    for joint in joints:
        placements.append(before @ joint.T_left)
        before = joint.T_right
    flanges, mounting_face = frames_of(name, arm.ee_link)
    limits = np.array([joint.limits or (-inf, inf) for joint in joints], dtype=np.float64)
    licence = _LICENCES.search(arm.fixture_source)
    bare = Robot(
        name=name,
        joint_names=tuple(joint.name for joint in joints),
        joint_placements=np.array(placements),
        joint_axes=np.array([joint.axis for joint in joints]),
        flange_placement=before,
        lower=limits[:, 0],
        upper=limits[:, 1],
        reference=np.zeros(len(joints)),
        base_frame=arm.base_link,
        flange_frame=arm.ee_link,
        maker=remarks["makers"].get(arm.vendor, arm.vendor),
        title=own.get("title", arm.display_name),
        source=f"{arm.fixture_source}; geometry and limits as shipped with ssik {version('ssik')} (BSD-3-Clause)",
        licence=own.get("licence", licence.group() if licence else _UNKNOWN_LICENCE),
        notes=_notes(arm.vendor, own),
        ssik_name=arm.name,
        flanges=flanges,
        mounting_face=mounting_face,
        linear_limits=linear_limits_in(own.get("linear_limits", []), tuple(joint.name for joint in joints)),
    )
    reference, reason = _reference(bare, arm.vendor)
    return replace(bare, reference=reference, reference_source=reason)


def linear_limits_in(rows: list[dict[str, Any]], joints: tuple[str, ...]) -> LinearLimits | None:
    """Limits between joints from the tables of `robots/arms.toml`; None where there are none.

    Raises:
        InvalidRobot: a table that defines no limit.
    """
    if not rows:
        return None
    degrees = np.radians([row["degrees"] for row in rows])
    return LinearLimits(
        names=tuple(row.get("name") or row_name(row["coefficients"], joints) for row in rows),
        matrix=np.array([row["coefficients"] for row in rows]),
        lower=degrees[:, 0],
        upper=degrees[:, 1],
    )


def _notes(vendor: str, own: dict[str, Any]) -> tuple[str, ...]:
    """Remarks on an arm: the maker's, its own, and which joints turn without end."""
    notes = [*_remarks()["maker_notes"].get(vendor, ()), *own.get("notes", ())]
    if "endless" in own:
        joints = ", ".join(str(joint) for joint in own["endless"])
        notes.append(f"Without limits, weight 0 and no margin: joint {joints} ({own['endless_source']}).")
    return tuple(notes)


def _reference(bare: Robot, vendor: str) -> tuple[Floats, str]:
    """Reference [rad] of an arm and its reason: the maker's working posture if one is on file, else by rule."""
    chosen = _remarks()["references"].get(vendor)
    if chosen is None:
        return working_reference(bare)
    return np.radians(chosen["degrees"]), str(chosen["reason"])
