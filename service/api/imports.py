"""/v1/imports: uploads that are read in the background."""

from __future__ import annotations

from fastapi import APIRouter, Response

from duocell.service.api.ownership import OnlyClient
from duocell.service.api.state import StateOf
from duocell.service.common.problems import Problem
from duocell.service.http.described import answer, problems
from duocell.service.schemas.robots import RobotImport

router = APIRouter(prefix="/v1/imports", tags=["robots"])

RETRY_AFTER = "1"


@router.get(
    "/{import_id}",
    operation_id="get_import",
    summary="Follow an upload",
    responses={200: answer("Where it stands.", "Retry-After"), **problems(404, 500)},
)
async def get_import(import_id: str, asker: OnlyClient, state: StateOf, response: Response) -> RobotImport:
    """What has become of an upload that was sent with `Prefer: respond-async`; poll while it is `reading`."""
    one = state.imports.get(import_id)
    if one is None or asker not in (None, one.owner):
        detail = f"There is no upload {import_id[:80]!r}; after a restart none is known. See the list of robots."
        raise Problem("import-not-found", detail)
    if one.status == "reading":
        response.headers["Retry-After"] = RETRY_AFTER
    return RobotImport.model_validate(one)
