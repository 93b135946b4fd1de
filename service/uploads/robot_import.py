"""From the files of a user to a robot: checked, its chain chosen, its meshes taken apart."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar
from xml.etree import ElementTree

from duocell.models.base.errors import InvalidInput
from duocell.models.catalogue.links import LinkBody
from duocell.models.description.chain_choice import ChainChoice, choose_chain
from duocell.models.description.link_tree import LinkTree
from duocell.models.description.urdf import robot_of_chain
from duocell.models.description.urdf_bodies import IN_MEMORY, MeshWork, MissingMeshes, mesh_names, urdf_link_bodies
from duocell.models.description.urdf_file import build_model, parse_document
from duocell.models.robot.robot import Robot
from duocell.optimizer.monitoring.events import Event
from duocell.optimizer.monitoring.watch import tell
from duocell.service.common.issues import InvalidRequest, IssueCollector, shortened
from duocell.service.library.piece_files import PieceFiles
from duocell.service.library.user_robot import UserRobot
from duocell.service.requests.convert_linear_limits import linear_limits_of
from duocell.service.schemas.arm import LinearLimit
from duocell.service.settings import Limits
from duocell.service.uploads.mesh_archive import MeshArchive

_FIELDS = ("/base_link", "/tip")

ESTIMATE = 'Or let the shape of such links be estimated: missing_meshes "estimate" (--missing-meshes estimate).'


@dataclass(frozen=True, slots=True)
class RobotFiles:
    """What a user sends.

    Attributes:
        name: that the robot is to have.
        file: name of the URDF file. urdf: its contents.
        meshes: contents of the zip, or None.
        linear_limits: limits between the joints.
        missing_meshes: "estimate": the shape of links whose mesh is missing or unreadable is estimated.
        base_link: see `duocell.models.description.urdf.robot_from_urdf`. tip: likewise.
    """

    name: str
    file: str
    urdf: bytes
    meshes: bytes | None = None
    base_link: str | None = None
    tip: str | None = None
    missing_meshes: MissingMeshes = "refuse"
    linear_limits: tuple[LinearLimit, ...] = ()


@dataclass(frozen=True)
class Described:
    """A URDF that was understood, before its meshes are taken apart."""

    document: ElementTree.Element
    model: Any
    robot: Robot
    chain: ChainChoice


@dataclass(frozen=True, slots=True)
class LinkBegun(Event):
    """The meshes of a link are read and taken apart now; so many links are done, of so many that have meshes."""

    kind: ClassVar[str] = "link"
    link: str
    done: int
    total: int


def robot_from_upload(files: RobotFiles, limits: Limits, pieces: Path) -> UserRobot:
    """As `robot_from_files`, in a process whose server follows the links; pieces of meshes are kept in a folder."""
    return robot_from_files(files, limits, MeshWork(PieceFiles(pieces), lambda *told: tell(LinkBegun(*told))))


def robot_from_files(files: RobotFiles, limits: Limits, work: MeshWork = IN_MEMORY) -> UserRobot:
    """The robot in a user's files.

    Args:
        files: see there. limits: how large they may be. work: see `duocell.models.description.urdf_bodies.MeshWork`.

    Raises:
        InvalidRequest: with everything that is wrong with them; the pointers name parts of the form.
    """
    issues = IssueCollector()
    described, archive = None, None
    try:
        described = describe(files)
    except InvalidInput as error:
        _note(error, issues)
    with issues.at("/meshes"):
        archive = MeshArchive(files.meshes, limits)
    if described is not None and files.linear_limits:
        described = _with_linear_limits(described, files, issues)
    if described is None or archive is None:
        raise InvalidRequest(issues.found)
    contents = _contents(mesh_names(described.document), archive, issues)
    if files.missing_meshes == "refuse":
        issues.raise_any()
    try:
        return replace(complete(described, files, contents, work), meshes=archive.used)
    except InvalidInput as error:
        _note(error, issues)
        raise InvalidRequest(issues.found) from error


def _with_linear_limits(described: Described, files: RobotFiles, issues: IssueCollector) -> Described:
    """The kinematics with the limits between joints that were sent with the files; faults of these are noted."""
    robot, before = described.robot, len(issues.found)
    limits = linear_limits_of(files.linear_limits, robot, (robot.lower, robot.upper), "/linear_limits", issues)
    if len(issues.found) > before and files.missing_meshes == "estimate":  # which notes meshes and goes on
        raise InvalidRequest(issues.found)
    return replace(described, robot=replace(robot, linear_limits=limits))


def _contents(names: Mapping[str, Sequence[str]], archive: MeshArchive, issues: IssueCollector) -> dict[str, bytes]:
    """Contents of all meshes that a URDF names; those that are not there are noted."""
    contents = {}
    for filename, links in names.items():
        try:
            contents[filename] = archive(filename)
        except InvalidInput as error:
            named = f"{shortened(filename, 120)} of link {', '.join(links[:5])}"
            issues.add("/meshes", f"Mesh {named}: {error.detail} {ESTIMATE}", "invalid-robot")
    return contents


def _note(error: InvalidInput, issues: IssueCollector) -> None:
    """Note what is wrong with a URDF under the part of the form that has to change."""
    issues.add(error.pointer if error.pointer in _FIELDS else f"/urdf{error.pointer}", error.detail, error.code)


def describe(files: RobotFiles) -> Described:
    """The kinematics in a user's files.

    Raises:
        InvalidRobot: see `duocell.models.description.urdf.robot_from_urdf`.
    """
    document = parse_document(files.urdf, files.file)
    chain = choose_chain(LinkTree.of(document), files.base_link, files.tip)
    model = build_model(document)
    robot = robot_of_chain(document, model, files.file, chain)
    digest = hashlib.sha256(files.urdf).hexdigest()[:32]
    return Described(document, model, replace(robot, name=files.name, description=digest), chain)


def complete(
    described: Described, files: RobotFiles, contents: Mapping[str, bytes], work: MeshWork = IN_MEMORY
) -> UserRobot:
    """The whole robot.

    Args:
        described: see `describe`.
        files: what it was made from.
        contents: of the meshes of `mesh_names` that are there.
        work: see `duocell.models.description.urdf_bodies.MeshWork`.

    Raises:
        InvalidRobot: see `duocell.models.description.urdf_bodies.urdf_link_bodies`.
    """
    robot = described.robot

    def read(name: str) -> bytes:
        if name not in contents:
            raise FileNotFoundError(name)
        return contents[name]

    found = urdf_link_bodies(described.document, described.model, robot, read, files.missing_meshes, work)
    robot = replace(robot, notes=(*robot.notes, *found.notes, *_unknown_shapes(robot, found.bodies)))
    return UserRobot(robot, found.bodies or None, version_of(robot, files.urdf, contents), chain=described.chain)


def version_of(robot: Robot, urdf: bytes, contents: Mapping[str, bytes]) -> str:
    """Digest of the files and of the chain that was chosen in them."""
    digest = hashlib.sha256()
    parts = [urdf, robot.base_frame.encode(), robot.flange_frame.encode()]
    limits = robot.linear_limits
    if limits is not None:
        parts += [repr(limits.names).encode(), *(a.tobytes() for a in (limits.matrix, limits.lower, limits.upper))]
    for name in sorted(contents):
        parts += [name.encode(), contents[name]]
    for part in parts:
        digest.update(hashlib.sha256(part).digest())  # parts of a fixed length: no two lists run together the same
    return digest.hexdigest()[:32]


def _unknown_shapes(robot: Robot, bodies: tuple[LinkBody, ...]) -> list[str]:
    """What to say about links without geometry."""
    if not bodies:
        return ["Without collision geometry that can be used the shape of all links is estimated from the kinematics."]
    known = {body.link for body in bodies}
    bare = [name for i, name in enumerate(robot.joint_names) if i + 1 not in known]
    return [f"Without collision geometry, and not checked: what moves with {', '.join(bare)}."] if bare else []
