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

from models.errors import InvalidRobot

MOST_BYTES = 4_000_000
"""Of a file; the largest published ones have a tenth of that."""

MOST_LINKS = 1000
"""Of a file; a humanoid with hands has a tenth of that."""

DEEPEST = 100
"""Elements within elements; a URDF needs five."""

KINDS = ("revolute", "continuous", "fixed", "prismatic", "floating", "planar")
"""Types of joints that a URDF may have; arms consist of the first three."""

_TURNING = ("revolute", "continuous")

_NUMBERS = (
    ("origin", "xyz", 3),
    ("origin", "rpy", 3),
    ("axis", "xyz", 3),
    ("limit", "lower", 1),
    ("limit", "upper", 1),
)
"""Element, attribute and amount of the numbers of a joint."""


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
    try:
        root = ElementTree.fromstring(data, ElementTree.XMLParser(target=_Builder(name)))
    except (ElementTree.ParseError, ValueError, LookupError) as error:  # broken, or in an encoding nobody knows
        raise InvalidRobot(f"{name} is no valid XML: {error}. A URDF file is needed.") from error
    if root.tag != "robot":
        raise InvalidRobot(f"{name} starts with <{str(root.tag)[:40]}>; a URDF file starts with <robot>.")
    macro = _macro(root, data)
    if macro:
        raise InvalidRobot(
            f"{name} is a xacro file (it has {macro[:60]}), which is not expanded here; expand it first, "
            "where its packages are installed: xacro arm.urdf.xacro > arm.urdf."
        )
    _check_document(root)
    return root


def _macro(root: ElementTree.Element, data: bytes) -> str:
    """Something that only xacro understands, or ""; a file that was expanded may keep the declaration of its prefix."""
    if b"<xacro:" in data:
        return "<xacro:...>"
    for element in root.iter():
        if "xacro" in element.tag:
            return f"<{element.tag}>"
        for value in element.attrib.values():
            if "${" in value or "$(" in value:
                return value
    return ""


class _Builder(ElementTree.TreeBuilder):
    """Builds the tree, unless it has what no URDF needs and only an attack uses."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name
        self._depth = 0

    def doctype(self, name: str, public_id: str | None, system_id: str | None) -> None:
        """Called before the entities of a document type are read."""
        raise InvalidRobot(f"{self._name} has a document type (<!DOCTYPE {name[:40]}>); remove it, no URDF needs one.")

    def start(self, tag: Any, attrs: Any, /) -> ElementTree.Element:
        """Called for every opening tag."""
        self._depth += 1
        if self._depth > DEEPEST:
            raise InvalidRobot(f"{self._name} has elements nested more than {DEEPEST} deep; no URDF needs that.")
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ElementTree.Element:
        """Called for every closing tag."""
        self._depth -= 1
        return super().end(tag)


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


def build_model(document: ElementTree.Element) -> Any:
    """Pinocchio's ``pin.Model`` of the links and joints of a document.

    Raises:
        InvalidRobot: the links form no tree.
    """
    bare = ElementTree.Element("robot", name=document.get("name") or "robot")
    for link in document.findall("link"):
        ElementTree.SubElement(bare, "link", name=link.get("name", ""))  # without meshes and masses
    bare.extend(document.findall("joint"))
    try:
        return pin.buildModelFromXML(ElementTree.tostring(bare, encoding="unicode"))
    except (ValueError, RuntimeError) as error:
        raise InvalidRobot(
            "Pinocchio finds no valid tree of links in this URDF: every joint needs a type, a parent and a child link "
            "that exist, every link but one must be a child exactly once."
        ) from error


def unusable_joints(document: ElementTree.Element) -> dict[str, str]:
    """Name of every moving joint that cannot be part of an arm -> why."""
    faults = {}
    for joint in document.findall("joint"):
        name, kind = str(joint.get("name")), str(joint.get("type"))
        if joint.find("mimic") is not None:
            faults[name] = "follows another joint (mimic)"
        elif kind not in (*_TURNING, "fixed"):
            faults[name] = f"is {kind}"
    return faults
