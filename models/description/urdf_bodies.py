"""Bodies of a robot's links from the collision geometry of its URDF file.

Primitives are taken as they are, meshes as the convex pieces of `duocell.models.geometry`. Links on joints that are
not part of the chain (a gripper's fingers, a torso's other arm) are taken where these joints are neutral.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput, InvalidRobot
from duocell.models.base.pose import inverse, rotation_from_rpy, transform
from duocell.models.catalogue.links import LinkBody, estimated_bodies
from duocell.models.geometry.link_meshes import LONGEST, LinkMeshes, MeshSource
from duocell.models.geometry.piece_cache import PieceCache
from duocell.models.geometry.shapes import Body, Box, Capsule, Cylinder, Shape, Sphere
from duocell.models.kinematics.kinematics import reach
from duocell.models.robot.robot import Robot

MOST_BODIES = 1000
"""Of a robot; one that was taken apart with care has a hundred."""

LONGEST_LINK = 3.0
"""A moving link's mesh may be this many times as long as the arm reaches."""

MissingMeshes = Literal["refuse", "estimate"]
"""What becomes of links whose mesh is missing or cannot be read."""


def _nobody(link: str, done: int, total: int) -> None:
    """Follows nothing."""


@dataclass(frozen=True, slots=True)
class MeshWork:
    """How meshes are taken apart, which takes a second each.

    Attributes:
        cache: where pieces are kept; None: in the memory of this process.
        progress: told the link that is begun, how many with meshes are done, and how many there are.
    """

    cache: PieceCache | None = None
    progress: Callable[[str, int, int], None] = _nobody


IN_MEMORY = MeshWork()


@dataclass(frozen=True, slots=True)
class LinkGeometry:
    """Bodies of a robot's links.

    Attributes:
        bodies: of every link that the chain carries or stands on; none if the file has no usable collision geometry.
        notes: sentences on what they leave out, fill or estimate.
    """

    bodies: tuple[LinkBody, ...]
    notes: tuple[str, ...]


def urdf_link_bodies(
    document: ElementTree.Element,
    model: Any,
    robot: Robot,
    meshes: MeshSource,
    missing: MissingMeshes = "refuse",
    work: MeshWork = IN_MEMORY,
) -> LinkGeometry:
    """Collision bodies of every link that the chain carries or stands on.

    Args:
        document: the whole ``<robot>`` element, with its ``<collision>`` elements.
        model: ``pin.Model`` of the same file (`duocell.models.description.urdf_file.build_model`).
        robot: the chain, as `duocell.models.description.urdf.robot_from_urdf` made it.
        meshes: where meshes come from.
        missing: "estimate": links whose mesh is missing or unreadable get the capsules of
        `duocell.models.catalogue.links`.
        work: where pieces of meshes are kept, and who follows.

    Raises:
        InvalidRobot: a missing or unusable mesh or primitive, or too many bodies; the pointer names the link.
    """
    carriers = _carriers(model, robot)
    source = f"collision geometry of {robot.source}"
    bodies: list[LinkBody] = []
    taken = _Taken(LinkMeshes(document, meshes, work.cache), missing == "estimate", reach(robot))
    followed = [
        link.get("name", "") for link in document.findall("link") if link.find("collision/geometry/mesh") is not None
    ]
    for link in document.findall("link"):
        name = link.get("name", "")
        index, place = carriers[name]
        if name in followed:
            work.progress(name, followed.index(name), len(followed))
        for number, element in enumerate(link.findall("collision")):
            try:
                shapes = taken.shapes(element, name, index)
                origin = _origin(element)
            except FileNotFoundError as error:
                raise InvalidRobot(f"a mesh of link {name} is missing: {error}.", f"/links/{name}") from error
            except InvalidInput as error:
                raise InvalidRobot(
                    f"collision {number + 1} of link {name}: {error.detail}", f"/links/{name}"
                ) from error
            bodies += [LinkBody(index, Body(name, place @ origin, shape), "mesh", source) for shape in shapes]
            if len(bodies) > MOST_BODIES:
                raise InvalidRobot(
                    f"with link {name} the robot consists of more than {MOST_BODIES} convex bodies. Use fewer and "
                    "simpler <collision> elements.",
                    f"/links/{name}",
                )
    if bodies:
        bodies += [body for body in estimated_bodies(robot) if body.link in taken.estimated]
    return LinkGeometry(tuple(bodies), taken.notes(robot))


def mesh_names(document: ElementTree.Element) -> dict[str, list[str]]:
    """``filename`` of every mesh of the collision geometry -> the links that are made of it."""
    found: dict[str, list[str]] = {}
    for link in document.findall("link"):
        for mesh in link.iterfind("collision/geometry/mesh"):
            found.setdefault(mesh.get("filename", ""), []).append(link.get("name", ""))
    return found


class _Taken:
    """Shapes of collision elements, and what there is to say about them.

    Attributes:
        estimated: the chain's links whose shape is estimated -> names of the file's links and why.
    """

    def __init__(self, meshes: LinkMeshes, estimate: bool, reach: float) -> None:
        self._meshes, self._estimate, self._reach = meshes, estimate, reach
        self._left_out: list[str] = []
        self._deepest = 0.0, ""
        self.estimated: dict[int, list[str]] = {}

    def shapes(self, collision: ElementTree.Element, link: str, index: int) -> list[Shape]:
        """Convex shapes of one ``<collision>`` of a link that the chain's link ``index`` carries."""
        geometry = collision.find("geometry")
        element = next(iter(geometry), None) if geometry is not None else None
        if element is None:
            raise InvalidInput("it has no geometry.")
        if element.tag != "mesh":
            return [_primitive(element)]
        try:
            return self._pieces(element, link, index)
        except (FileNotFoundError, InvalidInput) as error:
            if not self._estimate or getattr(error, "pointer", "") == "/scale":
                raise
            why = "is missing" if isinstance(error, FileNotFoundError) else error.detail
            file = element.get("filename", "").rsplit("/", 1)[-1]
            self.estimated.setdefault(index, []).append(f"{link} ({file[:80]}: {why})")
            return []

    def _pieces(self, element: ElementTree.Element, link: str, index: int) -> list[Shape]:
        """Pieces of a mesh; a URDF may stretch it differently along each axis."""
        scale = _numbers(element, "scale", 3) if element.get("scale") is not None else np.ones(3)
        if np.any(scale == 0.0):
            raise InvalidInput("a scale of 0 leaves nothing of the mesh.", "/scale")
        longest = LONGEST_LINK * self._reach if index > 0 else LONGEST
        found = self._meshes.pieces(link, element.get("filename", ""), scale, longest)
        if found.left_out:
            self._left_out.append(f"{link} ({found.left_out})")
        self._deepest = max(self._deepest, (found.dent, link))
        return list(found.pieces)

    def notes(self, robot: Robot) -> tuple[str, ...]:
        """What is to be said about the shapes."""
        found = []
        if self.estimated:
            names = "; ".join(name for index in sorted(self.estimated) for name in self.estimated[index])
            found.append(f"Estimated from the kinematics, for want of a mesh: the shape of {names}.")
        if self._left_out:
            found.append(f"Flat parts of meshes, without volume, were left out: {', '.join(self._left_out)}.")
        if self._deepest[1]:
            dent, link = self._deepest
            found.append(
                f"The convex pieces contain their meshes and stick out of them by at most about {1000.0 * dent:.0f} mm "
                f"(at {link}, as sampled)."
            )
        return tuple(found)


def _carriers(model: Any, robot: Robot) -> dict[str, tuple[int, Floats]]:
    """Name of a link -> the chain's link that carries it, and (4, 4) its frame in that link's frame."""
    data = model.createData()
    pin.framesForwardKinematics(model, data, pin.neutral(model))
    chain = {model.getJointId(name): i + 1 for i, name in enumerate(robot.joint_names)}
    origins = {0: data.oMf[model.getFrameId(robot.base_frame)].homogeneous}
    origins |= {i: data.oMi[joint].homogeneous for joint, i in chain.items()}
    carriers = {}
    for number, frame in enumerate(model.frames):
        if frame.type == pin.FrameType.BODY:
            joint = frame.parentJoint
            while joint not in chain and joint > 0:
                joint = model.parents[joint]
            index = chain.get(joint, 0)
            carriers[frame.name] = index, inverse(origins[index]) @ data.oMf[number].homogeneous
    return carriers


def _primitive(element: ElementTree.Element) -> Shape:
    """The shape of a ``<geometry>`` that is no mesh."""
    match element.tag:
        case "box":
            return Box(_numbers(element, "size", 3))
        case "sphere":
            return Sphere(float(_numbers(element, "radius", 1)[0]))
        case "cylinder":
            return Cylinder(float(_numbers(element, "radius", 1)[0]), float(_numbers(element, "length", 1)[0]))
        case "capsule":
            return Capsule(float(_numbers(element, "radius", 1)[0]), float(_numbers(element, "length", 1)[0]))
        case other:
            raise InvalidInput(f"geometry <{other}> is not known.")


def _origin(collision: ElementTree.Element) -> Floats:
    """(4, 4) the geometry's frame in the link's frame."""
    origin = collision.find("origin")
    if origin is None:
        return np.eye(4)
    position = _numbers(origin, "xyz", 3) if origin.get("xyz") is not None else np.zeros(3)
    angles = _numbers(origin, "rpy", 3) if origin.get("rpy") is not None else np.zeros(3)
    return transform(rotation_from_rpy(angles), position)


def _numbers(element: ElementTree.Element, attribute: str, count: int) -> Floats:
    """Numbers of an attribute."""
    text = element.get(attribute, "")
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or not all(isfinite(value) for value in values):
        raise InvalidInput(f"<{element.tag}> needs {count} number(s) in {attribute!r}; got {text[:60]!r}.")
    return np.array(values)
