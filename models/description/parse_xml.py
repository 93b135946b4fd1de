"""Parsing XML without namespaces, as URDF files need it: many use prefixes that they never declare."""

from __future__ import annotations

from typing import Any
from xml.etree import ElementTree
from xml.parsers import expat

from duocell.models.base.errors import InvalidRobot

DEEPEST = 100
"""Elements within elements; a URDF needs five."""


class _Builder(ElementTree.TreeBuilder):
    """Builds the tree, unless it has what no URDF needs and only an attack uses."""

    def __init__(self, name: str) -> None:
        super().__init__()
        self._name = name
        self._depth = 0

    def refuse_doctype(self, name: str, *rest: object) -> None:
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


def parse_xml(data: bytes, name: str) -> ElementTree.Element:
    """The root element; tags and attributes keep their prefixes.

    Args:
        data: the document.
        name: what to call it when something is wrong with it.

    Raises:
        InvalidRobot: no XML, an encoding nobody knows, a document type (its entities could grow without bound), or
            elements nested too deep.
    """
    builder, parser = _Builder(name), expat.ParserCreate()
    parser.buffer_text = True
    parser.StartElementHandler = builder.start
    parser.EndElementHandler = builder.end
    parser.CharacterDataHandler = builder.data
    parser.StartDoctypeDeclHandler = builder.refuse_doctype
    try:
        parser.Parse(data, True)
        return builder.close()
    except (expat.ExpatError, ValueError, LookupError, AssertionError) as error:
        raise InvalidRobot(f"{name} is no valid XML: {error}. A URDF file is needed.") from error
