"""/v1/tasks: tasks from the files that people have."""

from __future__ import annotations

from fastapi import APIRouter, Response

from duocell.service.api.bodies import FormBody
from duocell.service.api.state import StateOf
from duocell.service.http.described import answer, form_body_of, problems
from duocell.service.schemas.uploads import ImportedTask, TaskUpload
from duocell.service.uploads.task_uploads import take_task

router = APIRouter(prefix="/v1/tasks", tags=["tasks"])


@router.post(
    "/import",
    operation_id="import_task",
    summary="Read a task from a file",
    response_model=ImportedTask,
    responses={
        200: answer("The task, and what the file was taken for."),
        **problems(400, 408, 413, 415, 422, 429, 500, 503),
    },
    openapi_extra=form_body_of(TaskUpload),
)
async def import_task(upload: FormBody, state: StateOf) -> Response:
    """Send a table, a list, a ROS message, a robot program or a tool path; `task` of the answer goes into a request.

    Units and conventions come from the file or from the form; what neither says is guessed where there is one sensible
    choice, and told. Nothing is stored.
    """
    text = await take_task(upload, state.task_worker, state.settings)
    return Response(text, media_type="application/json")
