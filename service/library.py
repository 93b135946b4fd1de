"""What users brought to the service and requests may name: robots and meshes, kept as files in the data directory.

Server and workers are separate processes; each has a library of its own over the same files.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from models.errors import InvalidInput, UnknownMesh
from models.links import LinkBody
from models.robot import Robot
from models.shapes import ConvexHull
from service.shelf import Shelf
from service.user_mesh import UserMesh, mesh_from_document
from service.user_robot import UserRobot, from_document

log = logging.getLogger(__name__)

Kept = TypeVar("Kept")


class Library:
    """Robots and meshes of users.

    A robot goes by its name, which means the present one, or by ``name@version``, which means that one and no other.

    Args:
        data_dir: the service's folder; it need not exist.
        given: robots that are no files of this folder, by name; they come first.
        deleted: whether what was deleted lately still counts: for requests that were accepted before.
    """

    def __init__(self, data_dir: Path, *, given: Mapping[str, UserRobot] | None = None, deleted: bool = False) -> None:
        self.robot_shelf = Shelf(data_dir / "robots")
        self.mesh_shelf = Shelf(data_dir / "meshes")
        self._given = dict(given or {})
        self._deleted = deleted

    def robots(self) -> Mapping[str, Robot]:
        """Robots by name; a robot is loaded when it is asked for, and is then always the same object."""
        return _Robots(self)

    def links(self, name: str) -> tuple[LinkBody, ...] | None:
        """Bodies of a robot's links, or None if the robot is not one of these or has no collision geometry."""
        found = self.user_robot(name)
        return None if found is None else found.links

    def hulls(self, mesh_id: str, scale: float = 1.0) -> list[ConvexHull]:
        """Convex pieces of a mesh.

        Args:
            mesh_id: its identifier.
            scale: factor to metres, 0.001 for a file in millimetres.

        Raises:
            UnknownMesh: no such mesh; pointer ``/id``.
            InvalidInput: a scale that makes no solid of it; pointer ``/scale``.
        """
        found = self.user_mesh(mesh_id)
        if found is None:
            raise UnknownMesh(
                f"there is no mesh {mesh_id[:80]!r}. `GET /v1/meshes` lists what was uploaded; upload it first.", "/id"
            )
        return list(found.scaled(scale))

    def pieces(self, mesh_id: str) -> int:
        """Number of the convex pieces of a mesh; 0 if there is no such mesh."""
        found = self.user_mesh(mesh_id)
        return 0 if found is None else len(found.pieces)

    def names(self) -> list[str]:
        """Names of all robots, sorted."""
        return sorted({*self._given, *self.robot_shelf.names()})

    def version(self, name: str) -> str | None:
        """Version of the robot that goes by a name at present, or None if there is none."""
        found = self.user_robot(name)
        return None if found is None else found.version

    def user_robot(self, name: str) -> UserRobot | None:
        """A robot with all that belongs to it, or None."""
        bare, _, version = name.partition("@")
        found = self._given.get(bare) or _kept(self.robot_shelf.path(bare), from_document)
        if not version or (found is not None and found.version == version):
            return found
        return _kept(self.robot_shelf.aside(bare, version), from_document) if self._deleted else None

    def user_mesh(self, mesh_id: str) -> UserMesh | None:
        """A mesh with all that belongs to it, or None."""
        path = self.mesh_shelf.path(mesh_id)
        if path is None and self._deleted:
            path = self.mesh_shelf.aside(mesh_id, mesh_id)
        return _kept(path, mesh_from_document)


class _Robots(Mapping[str, Robot]):
    """Robots of a library."""

    def __init__(self, library: Library) -> None:
        self._library = library

    def __getitem__(self, name: str) -> Robot:
        found = self._library.user_robot(name)
        if found is None:
            raise KeyError(name)
        return found.robot

    def __iter__(self) -> Iterator[str]:
        return iter(self._library.names())

    def __len__(self) -> int:
        return len(self._library.names())


def _kept(path: Path | None, build: Callable[[dict[str, Any]], Kept]) -> Kept | None:
    """What a file holds; None if there is no file or it is damaged."""
    if path is None:
        return None
    try:
        stat = path.stat()
        kept: Kept = _loaded(path, (stat.st_ino, stat.st_mtime_ns, stat.st_size), build)
        return kept
    except FileNotFoundError:
        return None  # deleted in between
    except (ValueError, KeyError, TypeError, InvalidInput) as error:
        log.error("%s is damaged and is left out: %s", path, error)
        return None


@lru_cache(maxsize=2048)
def _loaded(path: Path, stamp: tuple[int, ...], build: Callable[[dict[str, Any]], Kept]) -> Kept:
    """A file's contents as an object, kept while the file stays what it is."""
    return build(json.loads(path.read_bytes()))
