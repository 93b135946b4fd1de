"""/v1/imports: uploads that are read in the background."""

from __future__ import annotations

from fastapi import APIRouter, Request
from fastapi.responses import JSONResponse, Response

from duocell.service.api.ownership import only_client
from duocell.service.api.state import StateOf
from duocell.service.common.problems import Problem
from duocell.service.schemas.resources import ProblemDocument
from duocell.service.schemas.robots import RobotImport

router = APIRouter(prefix="/v1/imports", tags=["robots"])

PROBLEM = {"model": ProblemDocument}
RETRY_AFTER = "1"


@router.get(
    "/{import_id}",
    operation_id="get_import",
    summary="Follow an upload",
    response_model=None,
    responses={200: {"model": RobotImport, "description": "Where it stands."}, 404: PROBLEM, 500: PROBLEM},
)
async def get_import(import_id: str, request: Request, state: StateOf) -> Response:
    """What has become of an upload that was sent with `Prefer: respond-async`; poll while it is `reading`."""
    one = state.imports.get(import_id)
    if one is None or only_client(request, state) not in (None, one.owner):
        detail = f"There is no upload {import_id[:80]!r}; after a restart none is known. See the list of robots."
        raise Problem("import-not-found", detail)
    headers = {"Retry-After": RETRY_AFTER} if one.status == "reading" else {}
    return JSONResponse(one.document(), headers=headers)
