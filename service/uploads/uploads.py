"""Robots and meshes that users send: read, checked, kept; and removed again."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import AsyncExitStack, contextmanager
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from fastapi.concurrency import run_in_threadpool

from duocell.models.catalogue import catalogue
from duocell.service.common.issues import InvalidRequest, Issue, shortened
from duocell.service.common.problems import Problem
from duocell.service.common.timestamps import timestamp
from duocell.service.library.document_store import NAME, DocumentStore
from duocell.service.library.library import Library
from duocell.service.library.user_mesh import UserMesh, mesh_document
from duocell.service.library.user_robot import as_document
from duocell.service.schemas.arm import LinearLimit, LinearLimitRows
from duocell.service.settings import Limits, Settings
from duocell.service.uploads.arrival import Parts, Upload, arrived
from duocell.service.uploads.form import Form
from duocell.service.uploads.imports import Import, Imports
from duocell.service.uploads.mesh_import import mesh_from_file
from duocell.service.uploads.robot_import import RobotFiles, robot_from_upload
from duocell.service.validation import validate
from duocell.service.validation.strict_json import NotJson, parse
from duocell.service.workers.executor import Report
from duocell.service.workers.import_worker import ImportWorker

log = logging.getLogger(__name__)

MOST_LABEL = 200
"""Characters of the label of a mesh."""

ROBOT_FORM = Parts(
    texts=("name", "base_link", "tip", "missing_meshes", "linear_limits"),
    files=("urdf", "meshes"),
    required=("name", "urdf"),
)
MESH_FORM = Parts(texts=("name",), files=("mesh",), required=("mesh",))


async def take_robot(upload: Upload, library: Library, import_worker: ImportWorker, settings: Settings) -> str:
    """Keep the robot in the form of an upload; returns its name.

    Raises:
        Problem: the body is no form or too large, the name is taken, there is no place for another robot.
        InvalidRequest: the robot cannot be used.
    """
    async with arrived(upload, ROBOT_FORM) as form:
        files = await _robot_sent(form, library, settings)
        await _keep_robot(files, library, import_worker, settings, lambda kind, data: None)
    return files.name


async def begin_robot(
    upload: Upload,
    library: Library,
    import_worker: ImportWorker,
    settings: Settings,
    imports: Imports,
    owner: str,
) -> Import:
    """As `take_robot`, but once the body is there nobody waits for the rest.

    Raises:
        Problem, InvalidRequest: as far as that is seen without the files being read.
    """
    async with AsyncExitStack() as stack:
        form = await stack.enter_async_context(arrived(upload, ROBOT_FORM))
        files = await _robot_sent(form, library, settings)
        held = stack.pop_all()

    async def work(report: Report) -> None:
        async with held:
            await _keep_robot(files, library, import_worker, settings, report)

    return imports.begin(owner, files.name, work)


async def _robot_sent(form: Form, library: Library, settings: Settings) -> RobotFiles:
    """What a form brings, if another robot may be kept."""
    name = form.texts["name"]
    _check_missing_meshes(form)
    files = _robot_files(name, form)
    await run_in_threadpool(_check_name, name, library)
    _check_place(library.robot_store, settings)
    return files


async def _keep_robot(
    files: RobotFiles, library: Library, import_worker: ImportWorker, settings: Settings, report: Report
) -> None:
    limits = Limits(**settings.model_dump())
    robot = await import_worker.run(robot_from_upload, files, limits, _pieces(settings), report=report)
    dated = replace(robot, created_at=timestamp(datetime.now(UTC)) or "")
    if not await run_in_threadpool(_put, library, library.robot_store, files.name, as_document(dated), settings):
        raise _exists(files.name)


async def take_mesh(
    upload: Upload, library: Library, import_worker: ImportWorker, settings: Settings
) -> tuple[UserMesh, bool]:
    """Keep the mesh in the form of an upload; returns it, and whether it is new.

    Raises:
        Problem: the body is no form or too large, or there is no place for another mesh.
        InvalidRequest: the mesh cannot be used.
    """
    async with arrived(upload, MESH_FORM) as form:
        file = form.files["mesh"]
        label = form.texts.get("name", file.name)
        _check_label(label)
        _check_place(library.mesh_store, settings)
        mesh = await import_worker.run(mesh_from_file, file.data, file.name, label, _pieces(settings))
    dated = replace(mesh, created_at=timestamp(datetime.now(UTC)) or "")
    new = await run_in_threadpool(_put, library, library.mesh_store, mesh.id, mesh_document(dated), settings)
    kept = await run_in_threadpool(library.user_mesh, mesh.id)
    return kept or dated, new


def drop_robot(name: str, library: Library, settings: Settings) -> None:
    """Remove a user's robot; layouts that were accepted before still get it for a while.

    Raises:
        Problem: there is no such robot, it is one of the catalogue, or everybody's where keys are told apart.
    """
    if name in catalogue.names():
        raise Problem(
            "catalogue-robot", f"{name} belongs to the catalogue and stays. Only uploaded robots can be deleted."
        )
    found = library.user_robot(name) if NAME.fullmatch(name) else None
    store = library.store_of_robot(name)
    _check_own(store, library.robot_store, library, shortened(name))
    with _writing():
        taken = found is not None and store is not None and store.take(name, found.version)
        library.forget(settings.keep_deleted)
    if not taken:
        raise Problem("robot-not-found", f"No uploaded robot is called {shortened(name)}. `GET /v1/robots` lists them.")


def drop_mesh(mesh_id: str, library: Library, settings: Settings) -> None:
    """Remove a mesh; layouts that were accepted before still get it for a while.

    Raises:
        Problem: there is no such mesh.
    """
    store = library.store_of_mesh(mesh_id)
    _check_own(store, library.mesh_store, library, f"mesh {shortened(mesh_id)}")
    with _writing():
        taken = store is not None and store.take(mesh_id, mesh_id)
        library.forget(settings.keep_deleted)
    if not taken:
        raise no_mesh(mesh_id)


def _check_own(store: DocumentStore | None, own: DocumentStore, library: Library, what: str) -> None:
    """Refuse to delete for one key what all of them use."""
    if store is not None and store is not own and not library.sees_everything:
        raise Problem(
            "belongs-to-all",
            f"{what} was brought while no keys were in use, or all was shared, and belongs to everybody. The operator "
            "can delete it.",
        )


def no_mesh(mesh_id: str) -> Problem:
    """What to say about a mesh that is not there."""
    return Problem("mesh-not-found", f"There is no mesh {shortened(mesh_id)}. `GET /v1/meshes` lists all of them.")


def _pieces(settings: Settings) -> Path:
    """Where convex pieces of meshes are kept: they belong to nobody, for who has the same mesh has them too."""
    return settings.data_dir.absolute() / "pieces"


def _robot_files(name: str, form: Form) -> RobotFiles:
    urdf, meshes = form.files["urdf"], form.files.get("meshes")
    return RobotFiles(
        name=name,
        file=_printable(urdf.name) or "robot.urdf",
        urdf=urdf.data,
        meshes=None if meshes is None else meshes.data,
        base_link=form.texts.get("base_link"),
        tip=form.texts.get("tip"),
        missing_meshes="estimate" if form.texts.get("missing_meshes") == "estimate" else "refuse",
        linear_limits=_linear_limits(form),
    )


def _linear_limits(form: Form) -> tuple[LinearLimit, ...]:
    """Limits between joints, read but for what they mean to the robot.

    Raises:
        InvalidRequest: the part is no such list.
    """
    text = form.texts.get("linear_limits", "[]")
    try:
        rows = parse(text.encode())
    except NotJson as error:
        raise InvalidRequest([Issue("/linear_limits", error.detail)]) from error
    return tuple(validate(LinearLimitRows, {"linear_limits": rows}).linear_limits)


def _check_missing_meshes(form: Form) -> None:
    """Refuse other words than there are."""
    word = form.texts.get("missing_meshes", "refuse")
    if word not in ("refuse", "estimate"):
        detail = f'{shortened(word)} is not known; allowed are "refuse" and "estimate". Choose one.'
        raise InvalidRequest([Issue("/missing_meshes", detail)])


def _printable(name: str) -> str:
    """A file name as it may appear in documents and tables."""
    return "".join(letter for letter in name if letter.isprintable())[:100]


def _check_name(name: str, library: Library) -> None:
    """Refuse names that are no file names, and those that are taken, whatever the case of their letters."""
    if not NAME.fullmatch(name):
        detail = (
            f"{shortened(name)} is no name for a robot; allowed are 1 to 64 letters a-z and A-Z, digits, '.', '_' and "
            "'-', the first a letter or digit. Choose such a name."
        )
        raise InvalidRequest([Issue("/name", detail)])
    if name.lower() in {known.lower() for known in catalogue.names()}:
        detail = f"{name!r} is a robot of the catalogue. Choose another name."
        raise Problem("catalogue-robot", detail, errors=[Issue("/name", detail)])
    if name.lower() in {known.lower() for known in library.names()}:
        raise _exists(name)


def _exists(name: str) -> Problem:
    detail = f"There is a robot {name!r} already. Choose another name, or delete it first."
    return Problem("robot-exists", detail, errors=[Issue("/name", detail)])


def _check_label(label: str) -> None:
    if len(label) > MOST_LABEL or not label.isprintable():
        detail = f"The name must have at most {MOST_LABEL} printable characters. Shorten it."
        raise InvalidRequest([Issue("/name", detail)])


def _check_place(store: DocumentStore, limits: Limits) -> None:
    if store.count() >= limits.max_kept:
        raise Problem(
            "too-many-kept",
            f"{store.count()} are kept, lately deleted ones included; allowed are {limits.max_kept} "
            "(DUOCELL_MAX_KEPT). Delete some that are not needed any more.",
        )


def _put(library: Library, store: DocumentStore, name: str, document: dict[str, Any], limits: Limits) -> bool:
    """Put a document into its store; False if there is one already."""
    with _writing():
        library.forget(limits.keep_deleted)
        return store.put(name, document)


@contextmanager
def _writing() -> Iterator[None]:
    """A block in which a full disk or a read-only folder is a problem and no crash."""
    try:
        yield
    except OSError as error:
        log.error("the data directory cannot be written: %s", error)
        detail = f"The data directory cannot be written ({error.strerror}); nothing was changed. Try again later."
        raise Problem("not-writable", detail) from error
