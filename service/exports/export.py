"""What an export is."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from duocell.service.library.library import Library

Resource = Mapping[str, Any]
"""A layout as ``GET /v1/layouts/{id}`` answers it: ``request`` and ``result`` are used."""


@dataclass(frozen=True, slots=True)
class Export:
    """One kind of file.

    Attributes:
        name: what the file is called, and in the address.
        title: what is in it, for a list.
        media_type: of the file.
        make: its bytes, of a layout with a result; the library is where robots come from that the catalogue does not
            hold. Raises `NothingToExport`.
    """

    name: str
    title: str
    media_type: str
    make: Callable[[Resource, Library | None], bytes]


class NothingToExport(Exception):
    """A layout has nothing of what an export is made of; ``detail`` says what is missing."""

    def __init__(self, detail: str) -> None:
        super().__init__(detail)
        self.detail = detail
