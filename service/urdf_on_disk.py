"""Robots from URDF files of this machine, for the command line; what was taken apart once is kept for the next time."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from models.errors import InvalidInput, InvalidRobot
from models.robot import Robot
from models.urdf_bodies import mesh_names
from models.urdf_meshes import meshes_near
from service.robot_intake import Described, RobotFiles, complete, describe, version_of
from service.shelf import Shelf
from service.user_robot import FORMAT, UserRobot, as_document, from_document

ESTIMATED = "The shape of its links is estimated from the kinematics."


def robot_on_disk(
    name: str, path: Path, base_link: str | None, tip: str | None, warn: Callable[[str], None]
) -> UserRobot:
    """A robot from a file.

    Args:
        name: that it is to have.
        path: of the URDF file.
        base_link: see `models.urdf.robot_from_urdf`. tip: likewise.
        warn: told if the collision geometry cannot be used; the robot then goes without.

    Raises:
        InvalidRobot: unreadable, or no robot.
    """
    try:
        files = RobotFiles(name, path.name, path.read_bytes(), base_link=base_link, tip=tip)
    except OSError as error:
        raise InvalidRobot(f"cannot read {path}: {error.strerror}. Check the path of the URDF file.") from error
    described = describe(files)
    try:
        contents = _contents(described, path)
        if not contents:
            return complete(described, files, contents)
        kept = _kept(described.robot, version_of(described.robot, files.urdf, contents))
        return kept or _keep(complete(described, files, contents))
    except InvalidInput as error:
        warn(f"{error.detail} {ESTIMATED}")
        return UserRobot(described.robot, None, version_of(described.robot, files.urdf, {}), chain=described.chain)


def _contents(described: Described, path: Path) -> dict[str, bytes]:
    """Contents of every mesh that the file names."""
    read = meshes_near(path)
    contents = {}
    for filename, links in mesh_names(described.document).items():
        try:
            contents[filename] = read(filename)
        except FileNotFoundError as error:
            raise InvalidRobot(f"Mesh {filename[:120]} of link {links[0]} is not near {path.name}.") from error
    return contents


def _shelf() -> Shelf:
    """Where robots are kept that were taken apart before."""
    cache = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Shelf(Path(cache) / "duocell" / "robots")


def _kept(robot: Robot, version: str) -> UserRobot | None:
    """The robot as it was taken apart before, or None."""
    try:
        path = _shelf().path(f"{FORMAT}-{version}")
        found = None if path is None else from_document(json.loads(path.read_bytes()))
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, InvalidInput):
        return None  # no home, damaged, of another time: taken apart again
    return None if found is None else replace(found, robot=replace(robot, notes=found.robot.notes))


def _keep(made: UserRobot) -> UserRobot:
    with suppress(OSError, RuntimeError):  # a read-only home, or none: next time it takes as long as this time
        _shelf().put(f"{FORMAT}-{made.version}", as_document(made))
    return made
