"""What xacro leaves in a file that was expanded, and what shows that a file was not expanded.

Definitions that nothing uses (properties, arguments, macros), comments and declarations change nothing and are taken
out. A file needs expansion if a macro is called or included, or an expression stands where a robot's links and joints
are.
"""

from __future__ import annotations

from xml.etree import ElementTree

_DEFINITIONS = ("property", "arg", "macro", "insert_block")
"""xacro elements that by themselves change nothing (a block that is inserted belongs to a macro)."""

_READ = ("link", "joint")
_NOT_READ = ("visual", "inertial", "gazebo", "transmission", "ros2_control", "dynamics", "safety_controller")
"""Elements whose contents are not looked at."""


def without_definitions(root: ElementTree.Element) -> str:
    """Take out of a document what changes nothing; returns what shows that it was not expanded, or "".

    Args:
        root: the ``<robot>`` element, parsed without namespaces; it is changed.
    """
    prefixes = _prefixes(root)
    for element in list(root):
        tag = _xacro_tag(element, prefixes)
        if tag in _DEFINITIONS and tag != "insert_block":
            root.remove(element)
        elif tag:
            return f"<{element.tag}>"
    for element in root:
        if element.tag in _READ:
            found = _left(element, prefixes)
            if found:
                return found
    return ""


def _left(element: ElementTree.Element, prefixes: set[str]) -> str:
    """The first call or expression in an element that is read, or ""."""
    for value in element.attrib.values():
        if "${" in value or "$(" in value:
            return value
    for inside in list(element):
        tag = _xacro_tag(inside, prefixes)
        if tag in _DEFINITIONS and tag != "insert_block":
            element.remove(inside)
        elif tag:
            return f"<{inside.tag}>"
        elif inside.tag not in _NOT_READ:
            found = _left(inside, prefixes)
            if found:
                return found
    return ""


def _prefixes(root: ElementTree.Element) -> set[str]:
    """Prefixes that mean xacro in a document."""
    declared = {
        name.removeprefix("xmlns:")
        for element in root.iter()
        for name, value in element.attrib.items()
        if name.startswith("xmlns:") and "xacro" in value
    }
    return declared | {"xacro"}


def _xacro_tag(element: ElementTree.Element, prefixes: set[str]) -> str:
    """Local name of an element of xacro, or ""."""
    prefix, colon, name = element.tag.partition(":")
    return name if colon and prefix in prefixes else ""
