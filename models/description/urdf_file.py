"""Reading a URDF file with Pinocchio, and saying what is wrong with it.

Only links and joints are handed to Pinocchio, so meshes, masses and extensions of other tools cannot get in the way.
Xacro is not expanded: its expressions are programs.
"""

from __future__ import annotations

from collections import Counter
from math import isfinite
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pinocchio as pin

from duocell.models.base.errors import InvalidRobot
from duocell.models.description.link_tree import LinkTree
from duocell.models.description.parse_xml import parse_xml
from duocell.models.description.xacro_leftovers import without_definitions

MOST_BYTES = 4_000_000
"""Of a file; the largest published ones have a tenth of that."""

MOST_LINKS = 1000
"""Of a file; a humanoid with hands has a tenth of that."""

KINDS = ("revolute", "continuous", "fixed", "prismatic", "floating", "planar")
"""Types of joints that a URDF may have; arms consist of the first three, and may stand on one of the fourth."""

_NUMBERS = (
    ("origin", "xyz", 3),
    ("origin", "rpy", 3),
    ("axis", "xyz", 3),
    ("limit", "lower", 1),
    ("limit", "upper", 1),
)
"""Element, attribute and amount of the numbers of a joint."""


_ATTRIBUTES = ("xyz", "rpy", "link", "lower", "upper")
_ANY_EFFORT = {"effort": "1", "velocity": "1"}


def read_document(file: Path) -> ElementTree.Element:
    """The ``<robot>`` element of a file.

    Raises:
        InvalidRobot: unreadable, or see `parse_document`.
    """
    try:
        data = file.read_bytes()
    except OSError as error:
        raise InvalidRobot(f"cannot read {file.name}: {error.strerror}. Check the path of the URDF file.") from error
    return parse_document(data, file.name)


def parse_document(data: bytes, name: str = "the URDF") -> ElementTree.Element:
    """The ``<robot>`` element of a file's contents.

    Args:
        data: the contents.
        name: what to call the file when something is wrong with it.

    Raises:
        InvalidRobot: too large, no XML, XML with a document type (its entities could grow without bound), no URDF,
            xacro, or links and joints that cannot be told apart.
    """
    if len(data) > MOST_BYTES:
        raise InvalidRobot(
            f"{name} has {len(data)} bytes; a URDF file has at most {MOST_BYTES}. Leave out what is no arm."
        )
    root = parse_xml(data, name)
    if root.tag != "robot":
        raise InvalidRobot(f"{name} starts with <{str(root.tag)[:40]}>; a URDF file starts with <robot>.")
    macro = without_definitions(root)
    if macro:
        raise InvalidRobot(
            f"{name} is a xacro file (it has {macro[:60]}), which is not expanded here; expand it first, "
            "where its packages are installed: xacro arm.urdf.xacro > arm.urdf."
        )
    _check_document(root)
    return root


def _check_document(root: ElementTree.Element) -> None:
    """Name the faults that Pinocchio only counts."""
    for tag in ("link", "joint"):
        count = Counter(element.get("name", "") for element in root.findall(tag))
        doubled = sorted(name for name, times in count.items() if times > 1 or not name)
        if doubled or not count:
            raise InvalidRobot(
                f"the URDF has {'no' if not count else 'unnamed or equally named'} {tag}s {doubled[:10] or ''}."
            )
        if len(count) > MOST_LINKS:
            raise InvalidRobot(f"the URDF has {len(count)} {tag}s; at most {MOST_LINKS} are read.")
    links = {link.get("name", "") for link in root.findall("link")}
    for joint in root.findall("joint"):
        fault = _fault(joint, links)
        if fault:
            raise InvalidRobot(f"joint {joint.get('name')} {fault}", f"/joints/{joint.get('name')}")
    LinkTree.of(root)


def _fault(joint: ElementTree.Element, links: set[str]) -> str:
    """What is wrong with a joint by itself, or ""."""
    kind = joint.get("type")
    if kind not in KINDS:
        return f"is of the type {kind!r}; a URDF knows {', '.join(KINDS)}."
    for end in ("parent", "child"):
        element = joint.find(end)
        link = None if element is None else element.get("link")
        if link not in links:
            return f"has the {end} {link!r}, which is no link of this URDF."
    if kind == "revolute" and joint.find("limit") is None:
        return (
            'is revolute but has no <limit>; add lower and upper, or make it type="continuous" if it turns without end.'
        )
    for tag, attribute, count in _NUMBERS:
        element = joint.find(tag)
        text = None if element is None else element.get(attribute)
        if text is not None and not _numeric(text, count):
            return f"has {attribute}={text[:60]!r} in <{tag}>; {count} finite number(s) are needed."
    return ""


def _numeric(text: str, count: int) -> bool:
    """Whether a text is so many finite numbers."""
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return False
    return len(values) == count and all(map(isfinite, values))


def _bare(joint: ElementTree.Element) -> ElementTree.Element:
    """A joint without anything that Pinocchio could stumble over: effort and speed, calibration, extensions."""
    bare = ElementTree.Element("joint", name=joint.get("name", ""), type=joint.get("type", ""))
    for tag in ("origin", "parent", "child", "axis", "limit"):
        element = joint.find(tag)
        if element is not None:
            kept = {key: value for key, value in element.attrib.items() if key in _ATTRIBUTES}
            ElementTree.SubElement(bare, tag, kept | (_ANY_EFFORT if tag == "limit" else {}))
    return bare


def build_model(document: ElementTree.Element) -> Any:
    """Pinocchio's ``pin.Model`` of the links and joints of a document.

    Raises:
        InvalidRobot: the links form no tree.
    """
    bare = ElementTree.Element("robot", name=document.get("name") or "robot")
    for link in document.findall("link"):
        ElementTree.SubElement(bare, "link", name=link.get("name", ""))  # without meshes and masses
    bare.extend(_bare(joint) for joint in document.findall("joint"))
    try:
        return pin.buildModelFromXML(ElementTree.tostring(bare, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise InvalidRobot(
            "Pinocchio finds no valid tree of links in this URDF: every joint needs a type, a parent and a child link "
            "that exist, every link but one must be a child exactly once."
        ) from error
