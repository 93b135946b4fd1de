"""Robots from URDF files of this machine, for the command line; what was taken apart once is kept for the next time."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from duocell.models.base.errors import InvalidInput, InvalidRobot
from duocell.models.description.chain_choice import ChainChoice
from duocell.models.description.urdf_bodies import MeshWork, MissingMeshes, mesh_names
from duocell.models.description.urdf_meshes import meshes_near
from duocell.models.geometry.piece_cache import PieceCache
from duocell.models.robot.robot import Robot
from duocell.service.library.document_store import DocumentStore
from duocell.service.library.piece_files import PieceFiles
from duocell.service.library.user_robot import FORMAT, UserRobot, as_document, from_document
from duocell.service.uploads.robot_import import ESTIMATE, Described, RobotFiles, complete, describe, version_of

CACHE = 2
"""Of what is kept; raised when meshes are taken apart another way."""


def robot_on_disk(
    name: str,
    path: Path,
    base_link: str | None,
    tip: str | None,
    warn: Callable[[str], None],
    missing_meshes: MissingMeshes = "refuse",
    progress: Callable[[str, int, int], None] = lambda link, done, total: None,
) -> UserRobot:
    """A robot from a file, as `duocell.service.uploads.robot_import.robot_from_files` makes it from an upload.

    Args:
        name: that it is to have.
        path: of the URDF file.
        base_link: see `duocell.models.description.urdf.robot_from_urdf`. tip: likewise.
        warn: told what shapes are estimated for want of a mesh, and what other arm could be meant.
        missing_meshes: "estimate": the shape of links whose mesh is missing or unreadable is estimated.
        progress: see `duocell.models.description.urdf_bodies.MeshWork`.

    Raises:
        InvalidRobot: unreadable, no robot, or meshes that are missing or cannot be used.
    """
    try:
        files = RobotFiles(name, path.name, path.read_bytes(), None, base_link, tip, missing_meshes)
    except OSError as error:
        raise InvalidRobot(f"cannot read {path}: {error.strerror}. Check the path of the URDF file.") from error
    described = describe(files)
    _tell_of_others(described.chain, warn)
    contents, lost = _contents(described, path)
    if lost and missing_meshes == "refuse":
        raise InvalidRobot(f"{lost[0]} {ESTIMATE}")
    for sentence in lost:
        warn(f"{sentence} Its shape is estimated from the kinematics.")
    if not contents:
        return complete(described, files, contents)
    kept = _kept(described.robot, version_of(described.robot, files.urdf, contents))
    if kept is not None:
        return replace(kept, chain=described.chain)
    return _keep(complete(described, files, contents, MeshWork(_piece_cache(), progress)))


def _tell_of_others(chain: ChainChoice, warn: Callable[[str], None]) -> None:
    """Warn where the file holds another arm, or a longer one, that could be meant."""
    others = [one for one in chain.alternatives if one.joints != chain.joints]
    if others:
        named = "; ".join(f"{one.base_link}:{one.tip} ({one.reason})" for one in others)
        warn(f"The chain from {chain.base_link} to {chain.tip} was taken. {chain.reason} Or mean {named}.")


def _contents(described: Described, path: Path) -> tuple[dict[str, bytes], list[str]]:
    """Contents of every mesh that the file names and that is there, and sentences on those that are not."""
    read = meshes_near(path)
    contents, lost = {}, []
    for filename, links in mesh_names(described.document).items():
        try:
            contents[filename] = read(filename)
        except FileNotFoundError:
            lost.append(f"Mesh {filename[:120]} of link {links[0]} is not near {path.name}.")
        except InvalidInput as error:
            lost.append(f"Mesh {filename[:120]} of link {links[0]}: {error.detail}")
    return contents, lost


def _cache_folder() -> Path:
    """Where this user's programs keep what they can make again."""
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "duocell"


def _store() -> DocumentStore:
    """Where robots are kept that were taken apart before."""
    return DocumentStore(_cache_folder() / "robots")


def _piece_cache() -> PieceCache | None:
    """Where pieces of meshes are kept, for robots that share them; None without a home."""
    try:
        return PieceFiles(_cache_folder() / "pieces")
    except RuntimeError:
        return None


def _kept(robot: Robot, version: str) -> UserRobot | None:
    """The robot as it was taken apart before, or None."""
    try:
        path = _store().path(f"{FORMAT}.{CACHE}-{version}")
        found = None if path is None else from_document(json.loads(path.read_bytes()))
    except (OSError, RuntimeError, ValueError, KeyError, TypeError, InvalidInput):
        return None  # no home, damaged, of another time: taken apart again
    return None if found is None else replace(found, robot=replace(robot, notes=found.robot.notes))


def _keep(made: UserRobot) -> UserRobot:
    with suppress(OSError, RuntimeError):  # a read-only home, or none: next time it takes as long as this time
        _store().put(f"{FORMAT}.{CACHE}-{made.version}", as_document(made))
    return made
