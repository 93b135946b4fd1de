"""Bodies of a robot's links from the collision geometry of its URDF file.

Primitives are taken as they are, meshes as the convex pieces of `models.meshes`. Links on joints that are not part of
the chain (a gripper's fingers, a torso's other arm) are taken where these joints are neutral.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from math import isfinite
from typing import Any
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from models.arrays import Floats
from models.errors import InvalidInput, InvalidRobot
from models.links import LinkBody
from models.meshes import convex_pieces, in_metres, read_triangles
from models.pose import inverse, rotation_from_rpy, transform
from models.robot import Robot
from models.shapes import Body, Box, Capsule, Cylinder, Shape, Sphere

MeshSource = Callable[[str], bytes]
"""Gives the contents of a mesh by the ``filename`` of the URDF; raises `FileNotFoundError` or `InvalidInput`."""

MOST_BODIES = 1000
"""Of a robot; one that was taken apart with care has a hundred."""

_Pieces = Callable[[str, tuple[float, ...]], tuple[Shape, ...]]
"""Convex pieces of a mesh by ``filename`` and scale."""


def urdf_link_bodies(
    document: ElementTree.Element, model: Any, robot: Robot, meshes: MeshSource
) -> tuple[LinkBody, ...]:
    """Collision bodies of every link that the chain carries or stands on.

    Args:
        document: the whole ``<robot>`` element, with its ``<collision>`` elements.
        model: ``pin.Model`` of the same file (`models.urdf_file.build_model`).
        robot: the chain, as `models.urdf.robot_from_urdf` made it.
        meshes: where meshes come from.

    Raises:
        InvalidRobot: a missing or unusable mesh or primitive, or too many bodies; the pointer names the link.
    """
    carriers = _carriers(model, robot)
    source = f"collision geometry of {robot.source}"
    bodies: list[LinkBody] = []
    pieces = _pieces_of(meshes)
    for link in document.findall("link"):
        name = link.get("name", "")
        index, place = carriers[name]
        for number, element in enumerate(link.findall("collision")):
            try:
                shapes = _shapes(element, pieces)
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
    return tuple(bodies)


def mesh_names(document: ElementTree.Element) -> dict[str, list[str]]:
    """``filename`` of every mesh of the collision geometry -> the links that are made of it."""
    found: dict[str, list[str]] = {}
    for link in document.findall("link"):
        for mesh in link.iterfind("collision/geometry/mesh"):
            found.setdefault(mesh.get("filename", ""), []).append(link.get("name", ""))
    return found


def _pieces_of(meshes: MeshSource) -> _Pieces:
    """Convex pieces of meshes, each taken apart only once."""

    @cache
    def pieces(name: str, scale: tuple[float, ...]) -> tuple[Shape, ...]:
        suffix = name.rsplit(".", 1)[-1]
        return convex_pieces(in_metres(read_triangles(meshes(name), suffix), np.array(scale)))

    return pieces


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


def _shapes(collision: ElementTree.Element, pieces: _Pieces) -> list[Shape]:
    """Convex shapes of one ``<collision>``."""
    geometry = collision.find("geometry")
    element = next(iter(geometry), None) if geometry is not None else None
    if element is None:
        raise InvalidInput("it has no geometry.")
    match element.tag:
        case "box":
            return [Box(_numbers(element, "size", 3))]
        case "sphere":
            return [Sphere(float(_numbers(element, "radius", 1)[0]))]
        case "cylinder":
            return [Cylinder(float(_numbers(element, "radius", 1)[0]), float(_numbers(element, "length", 1)[0]))]
        case "capsule":
            return [Capsule(float(_numbers(element, "radius", 1)[0]), float(_numbers(element, "length", 1)[0]))]
        case "mesh":
            return list(_mesh_pieces(element, pieces))
        case other:
            raise InvalidInput(f"geometry <{other}> is not known.")


def _mesh_pieces(element: ElementTree.Element, pieces: _Pieces) -> tuple[Shape, ...]:
    """Pieces of a mesh; a URDF may stretch it differently along each axis."""
    scale = _numbers(element, "scale", 3) if element.get("scale") is not None else np.ones(3)
    if np.any(scale == 0.0):
        raise InvalidInput("a scale of 0 leaves nothing of the mesh.")
    return pieces(element.get("filename", ""), tuple(scale))


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
