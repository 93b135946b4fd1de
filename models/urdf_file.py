"""Reading a URDF file with Pinocchio, and saying what is wrong with it.

Only links and joints are handed to Pinocchio, so meshes, masses and extensions of other tools cannot get in the way.
Xacro is not expanded.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pinocchio as pin

from models.errors import InvalidRobot

_TURNING = ("revolute", "continuous")


def read_document(file: Path) -> ElementTree.Element:
    """The ``<robot>`` element of a file with its links and joints, stripped of everything else.

    Raises:
        InvalidRobot: unreadable, no XML, no URDF, xacro, or links and joints that cannot be told apart.
    """
    try:
        root = ElementTree.fromstring(file.read_bytes())
    except OSError as error:
        raise InvalidRobot(f"cannot read {file.name}: {error.strerror}. Check the path of the URDF file.") from error
    except ElementTree.ParseError as error:
        raise InvalidRobot(f"{file.name} is no valid XML: {error}. A URDF file is needed.") from error
    if root.tag != "robot":
        raise InvalidRobot(f"{file.name} starts with <{root.tag}>; a URDF file starts with <robot>.")
    if any("xacro" in str(element.tag) for element in root.iter()):
        raise InvalidRobot(f"{file.name} is a xacro file; expand it first (xacro {file.name} > robot.urdf).")
    for element in list(root):
        if element.tag not in ("link", "joint"):
            root.remove(element)
        elif element.tag == "link":
            element[:] = []  # meshes and masses
    _check_document(root)
    return root


def _check_document(root: ElementTree.Element) -> None:
    """Name the faults that Pinocchio only counts."""
    for tag in ("link", "joint"):
        names = [element.get("name", "") for element in root.iter(tag)]
        doubled = sorted({name for name in names if names.count(name) > 1 or not name})
        if doubled or not names:
            raise InvalidRobot(
                f"the URDF has {'no' if not names else 'unnamed or equally named'} {tag}s {doubled or ''}."
            )
    for joint in root.iter("joint"):
        name = joint.get("name")
        if joint.get("type") == "revolute" and joint.find("limit") is None:
            raise InvalidRobot(
                f"joint {name} is revolute but has no <limit>; add lower and upper, "
                'or make it type="continuous" if it turns without end.',
                f"/joints/{name}",
            )


def build_model(document: ElementTree.Element) -> Any:
    """Pinocchio's ``pin.Model`` of a document.

    Raises:
        InvalidRobot: the links form no tree.
    """
    try:
        return pin.buildModelFromXML(ElementTree.tostring(document, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise InvalidRobot(
            "Pinocchio finds no valid tree of links in this URDF: every joint needs a type, a parent and a child link "
            "that exist, every link but one must be a child exactly once."
        ) from error


def unusable_joints(document: ElementTree.Element) -> dict[str, str]:
    """Name of every moving joint that cannot be part of an arm -> why."""
    faults = {}
    for joint in document.iter("joint"):
        name, kind = str(joint.get("name")), str(joint.get("type"))
        if joint.find("mimic") is not None:
            faults[name] = "follows another joint (mimic)"
        elif kind not in (*_TURNING, "fixed"):
            faults[name] = f"is {kind}"
    return faults
