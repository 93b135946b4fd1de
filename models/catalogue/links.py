"""The metal of an arm: bodies for every link, from the catalogue's data or estimated from the kinematic chain.

The estimate: each link is a string of capsules along its skeleton, from one joint origin to the next by way of the
common normal of the two axes (where the maker's frames lie, as in a D-H table: along the axis, then across). The radius
shrinks evenly from 0.085 of the arm's reach at the base to 0.04 at the last link; common arms between 3 kg and 200 kg
payload measure 0.05 to 0.1 and 0.03 to 0.06. At the mounting face and at the flange the capsules end flush with the
frame where the link is long enough. `robots/links.toml` holds better numbers for some arms, each with its source.
"""

from __future__ import annotations

import tomllib
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise
from pathlib import Path
from typing import Any, Literal

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.geometry.shapes import Body, Capsule, Sphere
from duocell.models.kinematics.kinematics import carriage_ends, reach
from duocell.models.robot.robot import Robot

AT_BASE, AT_FLANGE = 0.085, 0.04
"""Radius over reach of the first and the last link."""

LONGEST_DETOUR = 2.0
"""A way along the common normal that is longer than this, relative to the straight one, is no shape of a link."""

DENT = 0.25
"""Corners of the skeleton this near to the straight line, relative to the radius, are left out: they stay inside."""

Provenance = Literal["mesh", "cited", "estimated"]

_DATA = Path(__file__).parent / "robots" / "links.toml"


@dataclass(frozen=True, eq=False)
class LinkBody:
    """A body that moves with a link.

    Attributes:
        link: 0 for the base, i for what moves with joint i.
        body: in the frame of the link (`duocell.models.kinematics.link_frames`).
        provenance: "mesh" from the maker's collision meshes, "cited" measured with a source, "estimated" by rule.
        source: where it comes from.
    """

    link: int
    body: Body
    provenance: Provenance
    source: str


@lru_cache(maxsize=128)
def link_bodies(robot: Robot) -> tuple[LinkBody, ...]:
    """Bodies of all links of a robot, from the base outwards; links without extent have none."""
    entry = _entry(robot)
    if entry is None:
        return estimated_bodies(robot)
    bodies = []
    for link, *numbers in entry["capsules"]:
        ends, radius = np.array(numbers[:6], dtype=np.float64).reshape(2, 3), float(numbers[6])
        bodies.append(LinkBody(int(link), _capsule(int(link), ends, radius), "cited", entry["source"]))
    return tuple(bodies)


def provenance(bodies: Iterable[LinkBody]) -> Provenance:
    """The weakest of the bodies' provenances: what may be claimed of the arm."""
    found = {body.provenance for body in bodies}
    if "estimated" in found or not found:
        return "estimated"
    return "cited" if "cited" in found else "mesh"


def _entry(robot: Robot) -> dict[str, Any] | None:
    """Hand-written data of a catalogue robot; a robot from elsewhere may bear the same name."""
    if robot.ssik_name is None:
        return None
    entry: dict[str, Any] | None = _data().get(robot.name)
    return _data()[entry["same_as"]] if entry is not None and "same_as" in entry else entry


@lru_cache(maxsize=1)
def _data() -> dict[str, Any]:
    return tomllib.loads(_DATA.read_text(encoding="utf-8"))


# --- the estimate -----------------------------------------------------------------------------------------------------


def estimated_radius(robot: Robot, link: int) -> float:
    """Radius [m] that the rule gives a link (0 to n); the rail of a linear axis is as thick as the arm's own base."""
    if robot.carried is not None:
        return estimated_radius(robot.carried, max(link - 1, 0))
    return reach(robot) * (AT_BASE + (AT_FLANGE - AT_BASE) * link / robot.dof)


def estimated_bodies(robot: Robot) -> tuple[LinkBody, ...]:
    """Capsules along the kinematic chain, by the rule at the top of this file."""
    strings = [skeleton(robot, link) for link in range(robot.dof + 1)]
    extended = [link for link, points in enumerate(strings) if len(points) > 1]
    bodies = []
    for link in extended:
        radius = estimated_radius(robot, link)
        points = _straightened(strings[link], radius)
        segments = [np.array(ends) for ends in pairwise(points)]
        if link == extended[0] and _leaves_upright(robot, link, segments[0]):
            segments[0] = _drawn_in(segments[0], radius)
        if link == extended[-1]:
            segments[-1] = _drawn_in(segments[-1][::-1], radius)[::-1]
        rule = f"estimated from the reach ({reach(robot.carried or robot):.2f} m)"
        bodies += [LinkBody(link, _capsule(link, ends, radius), "estimated", rule) for ends in segments]
    return tuple(bodies)


def skeleton(robot: Robot, link: int) -> Floats:
    """Corners (k, 3) [m] of a link's centre line in its frame, from its joint or the base to the next or the flange.

    One point only where the two coincide. Link 0 of an arm on a linear axis is the rail, from end to end of its travel.
    """
    if link == 0 and robot.slides:
        return carriage_ends(robot)
    n = robot.dof
    place = robot.joint_placements[link] if link < n else robot.flange_placement @ robot.flange()
    end = place[:3, 3]
    length = float(np.linalg.norm(end))
    if length < 1e-6:
        return np.zeros((1, 3))
    straight = np.array([np.zeros(3), end])
    if link == 0 or robot.prismatic[link - 1]:
        return straight
    axis = robot.joint_axes[link - 1]
    after = place[:3, :3] @ robot.joint_axes[link] if link < n else axis
    bent = _along_common_normal(axis, after, end)
    way = float(np.sum(np.linalg.norm(np.diff(bent, axis=0), axis=1)))
    return bent if way <= LONGEST_DETOUR * length else straight


def _along_common_normal(axis: Floats, after: Floats, end: Floats) -> Floats:
    """From the origin along ``axis``, across to the line through ``end`` along ``after``, and along that to ``end``."""
    cosine = float(axis @ after)
    sine_squared = 1.0 - cosine**2
    if sine_squared < 1e-12:
        along, back = float(end @ axis), 0.0  # parallel: all of the offset on the first axis
    else:
        along = (float(end @ axis) - cosine * float(end @ after)) / sine_squared
        back = (float(end @ after) - cosine * float(end @ axis)) / sine_squared
    kept = [np.zeros(3)]
    for point in (along * axis, end - back * after):
        if min(np.linalg.norm(point - kept[-1]), np.linalg.norm(point - end)) > 1e-6:
            kept.append(point)
    return np.array([*kept, end])


def _straightened(points: Floats, radius: float) -> Floats:
    """A string without the corners that a capsule around the rest contains anyway."""
    kept = list(points)
    while len(kept) > 2:
        away = [_off_line(kept[i], kept[i - 1], kept[i + 1]) for i in range(1, len(kept) - 1)]
        if min(away) > DENT * radius:
            break
        del kept[1 + int(np.argmin(away))]
    return np.array(kept)


def _off_line(point: Floats, start: Floats, end: Floats) -> float:
    """Distance of a point from a segment."""
    way = end - start
    share = np.clip((point - start) @ way / max(float(way @ way), 1e-300), 0.0, 1.0)
    return float(np.linalg.norm(point - start - share * way))


def _leaves_upright(robot: Robot, link: int, ends: Floats) -> bool:
    """True if the first link rises from the base frame's xy plane, the mounting face."""
    if link > 1:
        return False
    placed = ends if link == 0 else ends @ robot.joint_placements[0][:3, :3].T
    way = placed[1] - placed[0]
    return bool(abs(way[2]) > 0.7 * np.linalg.norm(way))


def _drawn_in(ends: Floats, radius: float) -> Floats:
    """A segment whose first end is moved inwards by the radius, at most to the other end."""
    way = ends[1] - ends[0]
    share = min(1.0, radius / float(np.linalg.norm(way)))
    return np.array([ends[0] + share * way, ends[1]])


def _capsule(link: int, ends: Floats, radius: float) -> Body:
    """Everything within ``radius`` of a segment (2, 3), as a body."""
    way = ends[1] - ends[0]
    length = float(np.linalg.norm(way))
    middle = 0.5 * (ends[0] + ends[1])
    name = f"link {link}"
    if length < 1e-6:
        return Body(name, transform(np.eye(3), middle), Sphere(radius))
    return Body(name, transform(_turned_to(way / length), middle), Capsule(radius, length))


def _turned_to(direction: Floats) -> Floats:
    """(3, 3) a rotation whose z axis is a unit direction."""
    start = np.eye(3)[int(np.argmin(np.abs(direction)))]
    x = np.cross(start, direction)
    x /= np.linalg.norm(x)
    return np.column_stack([x, np.cross(direction, x), direction])
