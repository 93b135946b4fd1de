"""What users brought to the service and requests may name: robots and meshes, kept as files in the data directory.

Server and workers are separate processes; each has a library of its own over the same files.
"""

from __future__ import annotations

import json
import logging
from collections.abc import Callable, Iterator, Mapping
from copy import copy
from functools import lru_cache
from pathlib import Path
from typing import Any, TypeVar

from duocell.models.base.errors import InvalidInput, UnknownMesh
from duocell.models.catalogue.links import LinkBody
from duocell.models.geometry.shapes import ConvexHull
from duocell.models.robot.robot import Robot
from duocell.service.library.document_store import DocumentStore
from duocell.service.library.document_stores import DocumentStores, View
from duocell.service.library.user_mesh import UserMesh, mesh_from_document
from duocell.service.library.user_robot import UserRobot, from_document

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
        self._view = View(data_dir)
        self._robots, self._meshes = DocumentStores(data_dir / "robots"), DocumentStores(data_dir / "meshes")
        self._given = dict(given or {})
        self._deleted = deleted

    def seen_by(self, view: View) -> Library:
        """The same library as somebody sees it."""
        other = copy(self)
        other._view = view
        return other

    @property
    def sees_everything(self) -> bool:
        """Whether what belongs to whomever is seen."""
        return self._view.everything

    @property
    def robot_store(self) -> DocumentStore:
        """Where robots are kept that its user brings."""
        return self._robots.of(self._view.brings_for)

    @property
    def mesh_store(self) -> DocumentStore:
        """Where meshes are kept that its user brings."""
        return self._meshes.of(self._view.brings_for)

    def forget(self, age: float) -> None:
        """Remove what anybody deleted more than ``age`` s ago; see `DocumentStore.forget`."""
        self._robots.forget(age)
        self._meshes.forget(age)

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
        return sorted({*self._given, *(name for store in self._robots.seen_by(self._view) for name in store.names())})

    def mesh_ids(self) -> list[str]:
        """Identifiers of all meshes, sorted."""
        return sorted({name for store in self._meshes.seen_by(self._view) for name in store.names()})

    def version(self, name: str) -> str | None:
        """Version of the robot that goes by a name at present, or None if there is none."""
        found = self.user_robot(name)
        return None if found is None else found.version

    def user_robot(self, name: str) -> UserRobot | None:
        """A robot with all that belongs to it, or None."""
        bare, _, version = name.partition("@")
        stores = self._robots.seen_by(self._view)
        kept = (_kept(store.path(bare), from_document) for store in stores)
        for found in (self._given.get(bare), *kept):
            if found is not None and version in ("", found.version):
                return found
        tombstones = (store.tombstone(bare, version) for store in stores if version and self._deleted)
        return next((found for path in tombstones if (found := _kept(path, from_document))), None)

    def user_mesh(self, mesh_id: str) -> UserMesh | None:
        """A mesh with all that belongs to it, or None."""
        stores = self._meshes.seen_by(self._view)
        paths = [store.path(mesh_id) for store in stores]
        paths += [store.tombstone(mesh_id, mesh_id) for store in stores if self._deleted]
        return next((found for path in paths if (found := _kept(path, mesh_from_document))), None)

    def store_of_robot(self, name: str) -> DocumentStore | None:
        """Where a robot is kept; None if it is not there."""
        return next((store for store in self._robots.seen_by(self._view) if store.path(name)), None)

    def store_of_mesh(self, mesh_id: str) -> DocumentStore | None:
        """Where a mesh is kept; None if it is not there."""
        return next((store for store in self._meshes.seen_by(self._view) if store.path(mesh_id)), None)


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
