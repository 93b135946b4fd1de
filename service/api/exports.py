"""/v1/layouts/{id}/exports: a finished layout as a file."""

from __future__ import annotations

import asyncio
import json
from concurrent.futures import ThreadPoolExecutor
from typing import Annotated

from fastapi import APIRouter, Path, Response
from pydantic import WithJsonSchema

from duocell.service.api.ownership import OwnLayout
from duocell.service.api.state import StateOf
from duocell.service.common.issues import InvalidRequest
from duocell.service.common.problems import Problem
from duocell.service.exports.export import NothingToExport
from duocell.service.exports.exports import EXPORTS, export_of, exported
from duocell.service.http.described import answer, problems
from duocell.service.jobs.resources import etag, layout_text
from duocell.service.library.library import Library

router = APIRouter(prefix="/v1/layouts", tags=["layouts"])

NAMES = [export.name for export in EXPORTS]
Name = Annotated[
    str,
    Path(description="; ".join(f"`{export.name}`: {export.title}" for export in EXPORTS) + "."),
    WithJsonSchema({"type": "string", "enum": NAMES}),
]
ONE_BY_ONE = ThreadPoolExecutor(1, "exports")
"""Drawings are made one after the other: settings of matplotlib hold for all of them."""
CONTENT = {
    export.media_type.partition(";")[0]: {"schema": {"type": "string", "format": "binary"}} for export in EXPORTS
}


@router.get(
    "/{layout_id}/exports/{name}",
    operation_id="export_layout",
    summary="Get a finished layout as a file",
    response_class=Response,
    responses={
        200: answer("The file.", "ETag", "Content-Disposition", content=CONTENT),
        **problems(404, 409, 500, 503),
    },
)
async def export_layout(job: OwnLayout, name: Name, state: StateOf) -> Response:
    """A file made of the result, the same every time. `Content-Disposition` proposes a name for it."""
    export = export_of(name)
    if export is None:
        detail = f"There is no export {name[:80]!r}; there are {', '.join(NAMES)}."
        raise Problem("export-not-found", detail)
    if not job.status.finished:
        raise Problem("layout-active", f"The layout is {job.status}; it is a file when it is finished.")
    library = Library(state.settings.data_dir, deleted=True)  # the robots of a layout are those it was accepted with
    text = layout_text(job)

    def make() -> bytes:
        return exported(export, json.loads(text), library)

    try:
        content = await asyncio.get_running_loop().run_in_executor(ONE_BY_ONE, make)
    except NothingToExport as error:
        raise Problem("nothing-to-export", error.detail) from error
    except InvalidRequest as error:  # a robot that is forgotten by now
        raise Problem("nothing-to-export", error.issues[0].detail) from error
    disposition = f'attachment; filename="{job.id}_{export.name}"'
    headers = {"ETag": etag(job), "Content-Disposition": disposition}
    return Response(content, headers=headers, media_type=export.media_type)
