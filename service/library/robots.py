"""Robots as JSON documents: those of the catalogue, and those that users brought."""

from __future__ import annotations

import threading
from collections import Counter
from math import ceil
from typing import Any

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import quaternion_from_rotation
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.links import LinkBody, link_bodies, provenance
from duocell.models.kinematics.kinematics import flange_poses, reach
from duocell.models.robot.robot import Robot
from duocell.models.robot.robot_frames import RobotFrame
from duocell.service.common.numbers import finite
from duocell.service.library.document_store import NAME
from duocell.service.library.library import Library
from duocell.service.library.user_robot import UserRobot, chain_document

_loading = threading.Lock()
_loaded: list[dict[str, Any]] = []


def robot_list(library: Library) -> list[dict[str, Any]]:
    """All robots in short, by name."""
    found = (library.user_robot(name) for name in library.names())
    uploaded = [_summary(user.robot, user) for user in found if user is not None]
    return sorted([*catalogue_list(), *uploaded], key=lambda robot: str(robot["name"]))


def catalogue_list() -> list[dict[str, Any]]:
    """Robots of the catalogue in short; the first call loads them, which takes seconds, the others wait for it."""
    with _loading:
        if not _loaded:
            _loaded.extend(load_catalogue())
        return list(_loaded)


def load_catalogue() -> list[dict[str, Any]]:
    """The robots of the catalogue in short, made anew."""
    return [_summary(catalogue.robot(name)) for name in catalogue.names()]


def take_catalogue(made_elsewhere: list[dict[str, Any]]) -> None:
    """Keep what another process has loaded: `catalogue_list` then takes no time."""
    with _loading:
        _loaded[:] = made_elsewhere


def robot_document(name: str, library: Library) -> dict[str, Any]:
    """A robot in full.

    Raises:
        UnknownRobot: no such name.
    """
    from duocell.models.kinematics.inverse import (  # loads engines the server can start without
        posture_definitions,
        source_of_branches,
    )

    user = library.user_robot(name) if NAME.fullmatch(name) else None
    robot = catalogue.robot(name) if user is None else user.robot
    flange = flange_poses(robot, np.zeros(robot.dof))[0]
    joints = zip(robot.joint_names, robot.joint_kinds, robot.lower, robot.upper, robot.reference, strict=True)
    return {
        **_summary(robot, user),
        "version": None if user is None else user.version,
        "created_at": user.created_at or None if user is not None else None,
        "joints": [
            {
                "name": name,
                "type": kind.value,
                "lower": finite(lower),
                "upper": finite(upper),
                "reference": float(reference),
            }
            for name, kind, lower, upper, reference in joints
        ],
        "linear_limits": _linear_limits(robot),
        "chain": None if user is None or user.chain is None else chain_document(user.chain),
        "reference_source": robot.reference_source,
        "base_frame": robot.base_frame,
        "flange_frame": robot.flange_frame,
        "flanges": _flanges(robot, flange),
        "mounting_face": None if robot.mounting_face is None else _frame(robot.mounting_face, robot.mounting_face.pose),
        "flange_at_zero": _pose(flange),
        "postures": posture_definitions(robot),
        "inverse_kinematics": source_of_branches(robot),
        "bodies": _bodies(robot, links_of(robot, user)),
        "meshes": [] if user is None else [{"filename": name, "file": file} for name, file in user.meshes.items()],
        "notes": list(robot.notes),
        "source": robot.source,
        "licence": robot.licence,
    }


def _linear_limits(robot: Robot) -> list[dict[str, Any]]:
    """Limits between joints, as a request may send them."""
    limits = robot.linear_limits
    if limits is None:
        return []
    rows = zip(limits.names, limits.matrix.tolist(), limits.lower, limits.upper, strict=True)
    return [
        {"coefficients": coefficients, "lower": float(lower), "upper": float(upper), "name": name}
        for name, coefficients, lower, upper in rows
    ]


def _flanges(robot: Robot, last_at_zero: Floats) -> list[dict[str, Any]]:
    """Frames that a tool can be attached to, the usual one first."""
    if not robot.flanges:
        only = RobotFrame(robot.flange_frame, np.eye(4), robot.source)
        return [_frame(only, last_at_zero)]
    return [_frame(frame, last_at_zero @ frame.pose) for frame in robot.flanges]


def _frame(frame: RobotFrame, pose: Floats) -> dict[str, Any]:
    """A named frame with its pose in the base frame."""
    return {"name": frame.name, "pose": _pose(pose), "source": frame.source, "checked": frame.checked}


def _pose(pose: Floats) -> dict[str, Any]:
    quaternion = quaternion_from_rotation(pose[:3, :3])
    return {"position": pose[:3, 3].tolist(), "orientation": {"quaternion": quaternion.tolist()}}


def links_of(robot: Robot, user: UserRobot | None) -> tuple[LinkBody, ...]:
    """Bodies of a robot's links, from wherever they are known best."""
    own = None if user is None else user.links
    return link_bodies(robot) if own is None else own


def _bodies(robot: Robot, bodies: tuple[LinkBody, ...]) -> list[dict[str, Any]]:
    """What is known of the shape of each link, from the base outwards."""
    carriers: list[str | None] = [None, *robot.joint_names]
    amounts = Counter((body.link, body.body.name) for body in bodies)
    return [
        {"link": name, "moves_with": carriers[index], "pieces": pieces}
        for (index, name), pieces in sorted(amounts.items(), key=lambda item: item[0][0])
    ]


def _summary(robot: Robot, user: UserRobot | None = None) -> dict[str, Any]:
    return {
        "name": robot.name,
        "title": robot.title,
        "maker": robot.maker,
        "origin": "catalogue" if user is None else "uploaded",
        "dof": robot.dof,
        "reach": ceil(reach(robot) * 1e4) / 1e4,  # a bound must not be rounded down
        "geometry": provenance(links_of(robot, user)),
    }
