"""Robots from URDF files: the kinematics of one chain, nothing else. Bodies of its links:
`duocell.models.description.urdf_bodies`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRobot
from duocell.models.base.pose import inverse
from duocell.models.catalogue.dh import MAX_ANGLE, MAX_LENGTH, check_full_rank
from duocell.models.catalogue.reference import working_reference
from duocell.models.description.chain_choice import ChainChoice, choose_chain
from duocell.models.description.link_tree import LinkTree
from duocell.models.description.urdf_file import build_model, read_document
from duocell.models.kinematics.kinematics import chain
from duocell.models.kinematics.nominal import as_drawn
from duocell.models.robot.arm import TURN
from duocell.models.robot.joint import JointKind
from duocell.models.robot.robot import Robot


@dataclass(frozen=True, slots=True)
class _Path:
    """A chain in a model.

    Attributes:
        base: frame index of the base link. tip: of the flange link.
        joints: indices of the moving joints between them.
    """

    base: int
    tip: int
    joints: tuple[int, ...]


def robot_from_urdf(path: Path | str, base_link: str | None = None, tip: str | None = None) -> Robot:
    """The chain from one link of a URDF file to another.

    Args:
        path: the file.
        base_link: link that becomes the base frame; default: see `duocell.models.description.chain_choice`. It may be
            any link that is rigidly fixed to the one on which the first joint hangs.
        tip: link that becomes the flange frame; default: likewise.

    Raises:
        InvalidRobot: unreadable file, no valid URDF, unknown links, a chain with mimicking or other unsupported joints,
            sliding ones other than a linear axis in front, not 6 or 7 joints, joints without
            range, or a geometry that is singular everywhere.
    """
    file = Path(path)
    document = read_document(file)
    return robot_from_document(document, build_model(document), file.name, base_link, tip)


def robot_from_document(
    document: ElementTree.Element, model: Any, file: str, base_link: str | None = None, tip: str | None = None
) -> Robot:
    """The chain from one link of a URDF document to another.

    Args:
        document: see `duocell.models.description.urdf_file.parse_document`.
        model: ``pin.Model`` of the document (`duocell.models.description.urdf_file.build_model`).
        file: name of the file it came from.
        base_link: see `robot_from_urdf`. tip: likewise.

    Raises:
        InvalidRobot: see `robot_from_urdf`.
    """
    return robot_of_chain(document, model, file, choose_chain(LinkTree.of(document), base_link, tip))


def robot_of_chain(document: ElementTree.Element, model: Any, file: str, choice: ChainChoice) -> Robot:
    """The robot of a chain that was chosen.

    Args:
        document: see `robot_from_document`. model, file: likewise.
        choice: the chain.

    Raises:
        InvalidRobot: joints without axis or range, absurd lengths, or a geometry that is singular everywhere.
    """
    links = {frame.name: i for i, frame in enumerate(model.frames) if frame.type == pin.FrameType.BODY}
    joints = tuple(model.getJointId(name) for name in choice.joints)
    robot = _robot(document, file, model, _Path(links[choice.base_link], links[choice.tip], joints), choice)
    check_full_rank(robot)
    return robot


# --- building ---------------------------------------------------------------------------------------------------------


def _robot(document: ElementTree.Element, file: str, model: Any, way: _Path, choice: ChainChoice) -> Robot:
    """The robot of a chain."""
    name = document.get("name") or Path(file).stem
    placements, axes = chain(model, way.joints)
    for joint, axis in zip(way.joints, axes, strict=True):
        if not abs(np.linalg.norm(axis) - 1.0) < 1e-6:
            raise InvalidRobot(
                f"joint {model.names[joint]} has no axis; give a direction.", f"/joints/{model.names[joint]}"
            )
    placements[0] = inverse(model.frames[way.base].placement.homogeneous) @ placements[0]
    _check_lengths(model, way, [*placements, model.frames[way.tip].placement.homogeneous])
    kinds = _kinds(model, document, way.joints)
    lower, upper = _limits(model, document, way.joints, kinds)
    turning = np.array([kind is JointKind.REVOLUTE for kind in kinds])
    limit_warnings = _in_degrees(way, model, np.where(turning, lower, np.nan), np.where(turning, upper, np.nan))
    names = tuple(model.names[joint] for joint in way.joints)
    ends = choice.base_link, choice.tip
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
        "joint_kinds": kinds,
        "notes": (
            f"The chain from {ends[0]} to {ends[1]} over {', '.join(names)}. {choice.reason}",
            *choice.left_out,
            *_stand(model, way),
            *limit_warnings,
        ),
    }
    bare = Robot(**fields, reference=np.zeros(len(names)))
    reference, reason = working_reference(as_drawn(bare))  # rounded angles must not decide between mirror images
    return Robot(**fields, reference=reference, reference_source=reason)


def _stand(model: Any, way: _Path) -> tuple[str, ...]:
    """Where the base frame is in the root of the file, if that is another place."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    place = data.oMf[way.base].homogeneous
    if np.allclose(place, np.eye(4), atol=1e-9):
        return ()
    root = next(frame.name for frame in model.frames if frame.type == pin.FrameType.BODY)
    x, y, z = (float(value) for value in place[:3, 3])
    base = model.frames[way.base].name
    return (f"A layout places {base}, which stands at ({x:g}, {y:g}, {z:g}) m in {root} in the file.",)


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


def _kinds(model: Any, document: ElementTree.Element, joints: tuple[int, ...]) -> tuple[JointKind, ...]:
    """Which joints turn and which shift."""
    types = {joint.get("name"): joint.get("type") for joint in document.findall("joint")}
    shifts = [types[model.names[joint]] == "prismatic" for joint in joints]
    return tuple(JointKind.PRISMATIC if one else JointKind.REVOLUTE for one in shifts)


def _limits(
    model: Any, document: ElementTree.Element, joints: tuple[int, ...], kinds: Sequence[JointKind]
) -> tuple[Floats, Floats]:
    """(n,) lower and (n,) upper limits [rad or m]; infinite for continuous joints."""
    lower, upper = np.full(len(joints), -inf), np.full(len(joints), inf)
    elements = {joint.get("name"): joint.find("limit") for joint in document.findall("joint")}
    for i, joint in enumerate(joints):
        if model.joints[joint].nq != 1:
            continue  # continuous: Pinocchio keeps cosine and sine
        index, name, unit = model.joints[joint].idx_q, model.names[joint], kinds[i].unit
        lower[i], upper[i] = model.lowerPositionLimit[index], model.upperPositionLimit[index]
        limit = elements.get(name)
        missing = [bound for bound in ("lower", "upper") if limit is None or limit.get(bound) is None]
        if not lower[i] < upper[i]:
            what = f"has no {' and no '.join(missing)}, which then counts as 0" if missing else "leaves it no range"
            endless = ', or make it type="continuous" if it turns without end' if unit == "rad" else ""
            raise InvalidRobot(
                f"the <limit> of joint {name} {what} ({lower[i]:g} to {upper[i]:g} {unit}). Give both bounds, lower "
                f"below upper{endless}.",
                f"/joints/{name}",
            )
        if unit == "m" and max(-lower[i], upper[i]) > MAX_LENGTH:
            raise InvalidRobot(
                f"limits {lower[i]:g} to {upper[i]:g} m of joint {name} go beyond {MAX_LENGTH:g} m. Lengths are "
                "metres.",
                f"/joints/{name}",
            )
        if unit == "rad" and max(-lower[i], upper[i]) > MAX_ANGLE:
            raise InvalidRobot(
                f"limits {lower[i]:g} to {upper[i]:g} rad of joint {name} go beyond {MAX_ANGLE:.4g} rad. Limits are "
                'radians; a joint that turns without end has type="continuous".',
                f"/joints/{name}",
            )
    return lower, upper


def _in_degrees(way: _Path, model: Any, lower: Floats, upper: Floats) -> tuple[str, ...]:
    """A note where limits look like degrees: whole numbers beyond a turn, as no arm has them in radians."""
    limits = np.stack([lower, upper])
    whole = np.all((limits == np.round(limits)) & np.isfinite(limits), axis=0) & np.any(np.abs(limits) > TURN, axis=0)
    found = [
        f"{model.names[joint]}: {low:g} to {high:g} rad ({np.radians(low):.4g} to {np.radians(high):.4g} rad if these "
        "are degrees)"
        for joint, low, high, odd in zip(way.joints, lower, upper, whole, strict=True)
        if odd
    ]
    return (f"Limits are whole numbers beyond a turn; did you mean degrees? {'; '.join(found)}.",) if found else ()
