"""The registry of exports: every kind of file that can be made of a finished layout, by the name of the file.

The command line lists them and the service describes them without making any, so what makes one is loaded when it is
asked for.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING

from duocell.service.exports.export import Export, NothingToExport, Resource

if TYPE_CHECKING:
    from duocell.service.library.library import Library


def export_of(name: str) -> Export | None:
    """The export of a name, if there is one."""
    return next((export for export in EXPORTS if export.name == name), None)


def exported(export: Export, resource: Resource, library: Library | None) -> bytes:
    """The file.

    Args:
        export: its kind. resource: a layout. library: see `Export`.

    Raises:
        NothingToExport: the layout has no result, or not what the file is made of.
        InvalidRequest: the request inside cannot be used.
        KeyError: part of request or result is missing.
    """
    if not isinstance(resource.get("result"), Mapping):
        raise NothingToExport("It holds no finished layout.")
    return export.make(resource, library)


def _joint_table(resource: Resource, library: Library | None) -> bytes:
    from duocell.service.exports.joint_table import joint_table

    return joint_table(resource)


def _floor_plan(suffix: str) -> Callable[[Resource, Library | None], bytes]:
    def make(resource: Resource, library: Library | None) -> bytes:
        from duocell.service.figure.figure import drawn_figure

        return drawn_figure(resource, suffix, library)

    return make


EXPORTS = (
    Export("joints.csv", "the joint values of every arm at every pose", "text/csv; charset=utf-8", _joint_table),
    Export("floor_plan.svg", "the cell seen from above", "image/svg+xml", _floor_plan("svg")),
    Export("floor_plan.pdf", "the same", "application/pdf", _floor_plan("pdf")),
    Export("floor_plan.png", "the same", "image/png", _floor_plan("png")),
)
