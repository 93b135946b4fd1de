"""Robots from URDF files: the kinematics of one chain, nothing else. Bodies of its links: `models.urdf_bodies`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from models.arrays import Floats
from models.dh import JOINT_COUNTS, MAX_ANGLE, MAX_LENGTH, check_full_rank
from models.errors import InvalidRobot
from models.kinematics import chain
from models.pose import inverse
from models.reference import working_reference
from models.robot import Robot
from models.urdf_file import build_model, read_document, unusable_joints

_MOST_NAMES = 40


@dataclass(frozen=True, slots=True)
class _Path:
    """A way down the tree of links.

    Attributes:
        tip: frame index of the last link.
        frames: indices of all frames after the base link, down to the tip.
        joints: indices of the moving joints among them.
    """

    tip: int
    frames: tuple[int, ...]
    joints: tuple[int, ...]


def robot_from_urdf(path: Path | str, base_link: str | None = None, tip: str | None = None) -> Robot:
    """The chain from one link of a URDF file to another.

    Args:
        path: the file.
        base_link: link that becomes the base frame; default: the root of the file.
        tip: link that becomes the flange frame; default: the end of the longest chain of turning joints, and among
            equals the one with most links, then the first by name.

    Raises:
        InvalidRobot: unreadable file, no valid URDF, unknown links, a chain with sliding, mimicking or other
            unsupported joints, not 6 or 7 joints, joints without range, or a geometry that is singular everywhere.
    """
    file = Path(path)
    document = read_document(file)
    return robot_from_document(document, build_model(document), file.name, base_link, tip)


def robot_from_document(
    document: ElementTree.Element, model: Any, file: str, base_link: str | None = None, tip: str | None = None
) -> Robot:
    """The chain from one link of a URDF document to another.

    Args:
        document: see `models.urdf_file.parse_document`.
        model: ``pin.Model`` of the document (`models.urdf_file.build_model`).
        file: name of the file it came from.
        base_link: see `robot_from_urdf`. tip: likewise.

    Raises:
        InvalidRobot: see `robot_from_urdf`.
    """
    links = {frame.name: i for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
    unusable = unusable_joints(document)
    base = _find(links, base_link, "base_link") if base_link is not None else min(links.values())
    if tip is None:
        way = _longest(model, base, links, unusable)
    else:
        way = _way(model, base, _find(links, tip, "tip"))
        _check_joints(model, way, unusable)
    _check_count(model, base, way, links)
    robot = _robot(document.get("name") or Path(file).stem, file, model, base, way)
    check_full_rank(robot)
    return robot


# --- choosing the chain -----------------------------------------------------------------------------------------------


def _find(links: dict[str, int], name: str, what: str) -> int:
    """Frame of a link named by the user."""
    if name not in links:
        raise InvalidRobot(f"{what} {name!r} is no link of this URDF; its links are {_listed(links)}.", f"/{what}")
    return links[name]


def _way(model: Any, base: int, tip: int) -> _Path:
    """The way from one link to another below it."""
    frames = []
    frame = tip
    while frame != base:
        if frame == 0:
            below = model.frames[tip].name, model.frames[base].name
            raise InvalidRobot(
                f"link {below[0]} does not hang on {below[1]}; swap base link and tip or name others.", "/tip"
            )
        frames.append(frame)
        frame = model.frames[frame].parentFrame
    frames.reverse()
    joints = tuple(model.frames[f].parentJoint for f in frames if model.frames[f].type == pin.FrameType.JOINT)
    return _Path(tip, tuple(frames), joints)


def _longest(model: Any, base: int, links: dict[str, int], unusable: dict[str, str]) -> _Path:
    """The longest chain of turning joints below the base link."""
    ways = []
    for _, link in sorted(links.items()):
        try:
            way = _way(model, base, link)
        except InvalidRobot:
            continue  # another branch
        if not any(model.names[joint] in unusable for joint in way.joints):
            ways.append(way)
    return max(ways, key=lambda way: (len(way.joints), len(way.frames)))  # max keeps the first of equals


def _check_joints(model: Any, way: _Path, unusable: dict[str, str]) -> None:
    """Refuse chains with joints that are no plain turning joints."""
    for joint in way.joints:
        name = model.names[joint]
        if name in unusable:
            raise InvalidRobot(
                f"joint {name} on the way to {model.frames[way.tip].name} {unusable[name]}; "
                "only revolute and continuous joints are supported. Name a tip in front of it.",
                "/tip",
            )


def _check_count(model: Any, base: int, way: _Path, links: dict[str, int]) -> None:
    """Refuse chains without inverse kinematics."""
    if len(way.joints) in JOINT_COUNTS:
        return
    names = ", ".join(model.names[joint] for joint in way.joints) or "none"
    raise InvalidRobot(
        f"the chain from {model.frames[base].name} to {model.frames[way.tip].name} has {len(way.joints)} turning "
        f"joints ({names}); arms of 6 or 7 are supported. Name base link and tip of an arm; "
        f"the links are {_listed(links)}.",
        "/tip",
    )


def _listed(links: dict[str, int]) -> str:
    """Names for an error message."""
    names = list(links)
    return ", ".join(names[:_MOST_NAMES]) + (
        f" and {len(names) - _MOST_NAMES} more" if len(names) > _MOST_NAMES else ""
    )


# --- building ---------------------------------------------------------------------------------------------------------


def _robot(name: str, file: str, model: Any, base: int, way: _Path) -> Robot:
    """The robot of a chain."""
    placements, axes = chain(model, way.joints)
    for joint, axis in zip(way.joints, axes, strict=True):
        if not abs(np.linalg.norm(axis) - 1.0) < 1e-6:
            raise InvalidRobot(
                f"joint {model.names[joint]} has no axis; give a direction.", f"/joints/{model.names[joint]}"
            )
    placements[0] = inverse(model.frames[base].placement.homogeneous) @ placements[0]
    _check_lengths(model, way, [*placements, model.frames[way.tip].placement.homogeneous])
    lower, upper = _limits(model, way.joints)
    names = tuple(model.names[joint] for joint in way.joints)
    ends = model.frames[base].name, model.frames[way.tip].name
    fields: dict[str, Any] = {
        "name": name,
        "joint_names": names,
        "joint_placements": placements,
        "joint_axes": axes,
        "flange_placement": model.frames[way.tip].placement.homogeneous,
        "lower": lower,
        "upper": upper,
        "base_frame": ends[0],
        "flange_frame": ends[1],
        "title": name,
        "source": f"URDF file {file}",
        "licence": "see source",
        "notes": (f"The chain from {ends[0]} to {ends[1]} over {', '.join(names)}.",),
    }
    reference, reason = working_reference(Robot(**fields, reference=np.zeros(len(names))))
    return Robot(**fields, reference=reference, reference_source=reason)


def _check_lengths(model: Any, way: _Path, placements: Sequence[Floats]) -> None:
    """Refuse joints that are nowhere or absurdly far from the joint before."""
    for joint, placement in zip([*way.joints, None], placements, strict=True):
        length = float(np.linalg.norm(placement[:3, 3]))
        if not np.all(np.isfinite(placement)) or length > MAX_LENGTH:
            name = model.frames[way.tip].name if joint is None else model.names[joint]
            raise InvalidRobot(
                f"{name} is {length:g} m from the joint before it; allowed is {MAX_LENGTH:g} m. Lengths are metres.",
                f"/links/{name}" if joint is None else f"/joints/{name}",
            )


def _limits(model: Any, joints: tuple[int, ...]) -> tuple[Floats, Floats]:
    """(n,) lower and (n,) upper limits [rad]; infinite for continuous joints."""
    lower, upper = np.full(len(joints), -inf), np.full(len(joints), inf)
    for i, joint in enumerate(joints):
        if model.joints[joint].nq != 1:
            continue  # continuous: Pinocchio keeps cosine and sine
        index, name = model.joints[joint].idx_q, model.names[joint]
        lower[i], upper[i] = model.lowerPositionLimit[index], model.upperPositionLimit[index]
        if not lower[i] < upper[i]:
            raise InvalidRobot(
                f"limits {lower[i]:g} to {upper[i]:g} rad leave joint {name} no range; lower must be below upper.",
                f"/joints/{name}",
            )
        if max(-lower[i], upper[i]) > MAX_ANGLE:
            raise InvalidRobot(
                f"limits {lower[i]:g} to {upper[i]:g} rad of joint {name} go beyond {MAX_ANGLE:.4g} rad. Limits are "
                'radians; a joint that turns without end has type="continuous".',
                f"/joints/{name}",
            )
    return lower, upper
