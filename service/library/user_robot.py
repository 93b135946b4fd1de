"""Robots that users brought: kinematics, bodies of the links, and how both are kept as a JSON document."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from math import inf
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.catalogue.links import LinkBody
from duocell.models.description.chain_choice import Alternative, ChainChoice
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from duocell.models.robot.joint import JointKind
from duocell.models.robot.linear_limits import LinearLimits
from duocell.models.robot.robot import Robot

FORMAT = 1
"""Of the documents; raised when their meaning changes."""

_ARRAYS = ("joint_placements", "joint_axes", "flange_placement", "reference")
_LIMITS = ("lower", "upper")
_SUMS = ("matrix", *_LIMITS)
_TEXTS = ("name", "reference_source", "base_frame", "flange_frame", "maker", "title", "source", "licence")
_LISTS = ("joint_names", "notes")


@dataclass(frozen=True, eq=False)
class UserRobot:
    """A robot from a URDF file.

    Attributes:
        robot: its kinematics; ``robot.name`` is the name it goes by.
        links: bodies from its collision geometry, or None if the file has none (they are then estimated).
        version: digest of what it was made from: equal for equal files, on every machine.
        meshes: ``filename`` in the URDF -> file that was taken for it.
        created_at: RFC 3339, when it was brought; empty for robots that are not kept.
        chain: which chain of the file it is and what else it could be; None for those brought when that was not kept.
    """

    robot: Robot
    links: tuple[LinkBody, ...] | None
    version: str
    meshes: Mapping[str, str] = field(default_factory=dict)
    created_at: str = ""
    chain: ChainChoice | None = None


def as_document(user_robot: UserRobot) -> dict[str, Any]:
    """A robot as plain JSON; numbers keep every digit."""
    robot = user_robot.robot
    kinematics: dict[str, Any] = {name: getattr(robot, name).tolist() for name in _ARRAYS}
    kinematics |= {name: [float(v) if np.isfinite(v) else None for v in getattr(robot, name)] for name in _LIMITS}
    kinematics |= {name: getattr(robot, name) for name in _TEXTS}
    kinematics |= {name: list(getattr(robot, name)) for name in _LISTS} | {"description": robot.description}
    if robot.slides:
        kinematics["joint_kinds"] = [kind.value for kind in robot.joint_kinds]
    kinematics["linear_limits"] = _linear_limits_document(robot.linear_limits)
    links = None if user_robot.links is None else [_link_document(link) for link in user_robot.links]
    return {
        "format": FORMAT,
        "version": user_robot.version,
        "created_at": user_robot.created_at,
        "meshes": dict(user_robot.meshes),
        "robot": kinematics,
        "links": links,
        "chain": None if user_robot.chain is None else chain_document(user_robot.chain),
    }


def from_document(document: dict[str, Any]) -> UserRobot:
    """A robot from its document.

    Raises:
        ValueError, KeyError, TypeError, InvalidInput: it is no such document.
    """
    if document["format"] != FORMAT:
        raise ValueError(f"format {document['format']!r} is not known")
    kinematics = document["robot"]
    open_ends = {"lower": -inf, "upper": inf}
    values: dict[str, Any] = {name: np.array(kinematics[name], dtype=np.float64) for name in _ARRAYS}
    values |= {name: np.array([open_ends[name] if v is None else v for v in kinematics[name]]) for name in _LIMITS}
    values |= {name: str(kinematics[name]) for name in _TEXTS}
    values |= {name: tuple(kinematics[name]) for name in _LISTS}
    limits = _linear_limits_from(kinematics.get("linear_limits"))
    kinds = tuple(JointKind(kind) for kind in kinematics.get("joint_kinds", ()))
    values |= {"description": str(kinematics.get("description", "")), "linear_limits": limits, "joint_kinds": kinds}
    robot = Robot(**values)
    chain = document.get("chain")
    links = document["links"]
    return UserRobot(
        robot=robot,
        links=None if links is None else tuple(map(_link_from, links)),
        version=str(document["version"]),
        meshes=dict(document["meshes"]),
        created_at=str(document["created_at"]),
        chain=None if chain is None else _chain_from(chain),
    )


def chain_document(chain: ChainChoice) -> dict[str, Any]:
    """The choice of a chain as plain JSON, as ``GET /v1/robots/{name}`` shows it too."""
    return {
        "base_link": chain.base_link,
        "tip": chain.tip,
        "joints": list(chain.joints),
        "reason": chain.reason,
        "left_out": list(chain.left_out),
        "alternatives": [
            {"base_link": one.base_link, "tip": one.tip, "joints": list(one.joints), "reason": one.reason}
            for one in chain.alternatives
        ],
    }


def _chain_from(document: dict[str, Any]) -> ChainChoice:
    return ChainChoice(
        str(document["base_link"]),
        str(document["tip"]),
        tuple(document["joints"]),
        str(document["reason"]),
        tuple(document["left_out"]),
        tuple(
            Alternative(str(one["base_link"]), str(one["tip"]), tuple(one["joints"]), str(one["reason"]))
            for one in document["alternatives"]
        ),
    )


def _linear_limits_document(limits: LinearLimits | None) -> dict[str, Any] | None:
    if limits is None:
        return None
    return {"names": list(limits.names)} | {name: getattr(limits, name).tolist() for name in _SUMS}


def _linear_limits_from(document: dict[str, Any] | None) -> LinearLimits | None:
    if document is None:
        return None
    return LinearLimits(tuple(document["names"]), *(np.array(document[name]) for name in _SUMS))


def _link_document(link: LinkBody) -> dict[str, Any]:
    return {
        "link": link.link,
        "name": link.body.name,
        "pose": link.body.pose.tolist(),
        "shape": shape_document(link.body.shape),
        "provenance": link.provenance,
        "source": link.source,
    }


def _link_from(document: dict[str, Any]) -> LinkBody:
    body = Body(document["name"], np.array(document["pose"]), shape_from(document["shape"]))
    return LinkBody(int(document["link"]), body, document["provenance"], document["source"])


# --- shapes -----------------------------------------------------------------------------------------------------------

_KINDS: dict[str, type[Shape]] = {
    "box": Box,
    "sphere": Sphere,
    "cylinder": Cylinder,
    "capsule": Capsule,
    "half_space": HalfSpace,
    "hull": ConvexHull,
}


def shape_document(shape: Shape) -> dict[str, Any]:
    """A shape as plain JSON."""
    kind = next(name for name, class_ in _KINDS.items() if type(shape) is class_)
    given = [one.name for one in fields(shape) if one.init]
    values = {name: getattr(shape, name) for name in given}
    return {"type": kind} | {n: v.tolist() if isinstance(v, np.ndarray) else float(v) for n, v in values.items()}


def shape_from(document: dict[str, Any]) -> Shape:
    """A shape from its document.

    Raises:
        KeyError, TypeError, InvalidInput: it is none.
    """
    values: dict[str, Floats | float] = {
        name: np.array(value) if isinstance(value, list) else float(value)
        for name, value in document.items()
        if name != "type"
    }
    make: Any = _KINDS[document["type"]]
    shape: Shape = make(**values)
    return shape
