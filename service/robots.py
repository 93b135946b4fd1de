"""Robots of the catalogue as JSON documents."""

from __future__ import annotations

import threading
from functools import lru_cache
from math import ceil
from typing import Any

import numpy as np

from models import catalogue
from models.kinematics import flange_poses, reach
from models.pose import quaternion_from_rotation
from models.robot import Robot
from service.numbers import finite

_loading = threading.Lock()


def robot_list() -> list[dict[str, Any]]:
    """All robots in short; the first call loads them, which takes seconds, the others wait for it."""
    with _loading:
        return _robot_list()


@lru_cache(maxsize=1)
def _robot_list() -> list[dict[str, Any]]:
    return [_summary(catalogue.robot(name)) for name in catalogue.names()]


def robot_document(name: str) -> dict[str, Any]:
    """A robot in full.

    Raises:
        UnknownRobot: no such name.
    """
    from models.inverse import posture_definitions, source_of_branches  # loads engines the server can start without

    robot = catalogue.robot(name)
    flange = flange_poses(robot, np.zeros(robot.dof))[0]
    joints = zip(robot.joint_names, robot.lower, robot.upper, robot.reference, strict=True)
    return {
        **_summary(robot),
        "joints": [
            {"name": name, "lower": finite(lower), "upper": finite(upper), "reference": float(reference)}
            for name, lower, upper, reference in joints
        ],
        "reference_source": robot.reference_source,
        "base_frame": robot.base_frame,
        "flange_frame": robot.flange_frame,
        "flange_at_zero": {
            "position": flange[:3, 3].tolist(),
            "orientation": {"quaternion": quaternion_from_rotation(flange[:3, :3]).tolist()},
        },
        "postures": posture_definitions(robot),
        "inverse_kinematics": source_of_branches(robot),
        "notes": list(robot.notes),
        "source": robot.source,
        "licence": robot.licence,
    }


def _summary(robot: Robot) -> dict[str, Any]:
    return {
        "name": robot.name,
        "title": robot.title,
        "maker": robot.maker,
        "dof": robot.dof,
        "reach": ceil(reach(robot) * 1e4) / 1e4,  # a bound must not be rounded down
    }
