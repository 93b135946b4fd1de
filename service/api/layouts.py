"""/v1/layouts: ask for a layout, see what became of it."""

from __future__ import annotations

from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.concurrency import run_in_threadpool
from fastapi.responses import JSONResponse, Response

from service.accept import accept
from service.api.state import StateOf
from service.body import json_body
from service.cursor import decode, encode
from service.jobs import Job
from service.prefer import preferred_wait
from service.problems import Problem
from service.resources import etag, href, layout_text, summary
from service.schemas.resources import Layout, LayoutPage, ProblemDocument

router = APIRouter(prefix="/v1/layouts", tags=["layouts"])

RETRY_AFTER = "1"
PROBLEM = {"model": ProblemDocument}


@router.post(
    "",
    operation_id="create_layout",
    summary="Ask for a layout",
    status_code=202,
    response_model=None,
    responses={
        200: {"model": Layout, "description": "Finished within the time of `Prefer: wait`."},
        202: {"model": Layout, "description": "Taken in; ask for it at Location."},
        **dict.fromkeys((400, 413, 415, 422, 429, 500), PROBLEM),
    },
)
async def create_layout(request: Request, state: StateOf) -> Response:
    """Find the base placements that keep all joints nearest to their references along the task.

    With `Prefer: wait=N` the answer comes as soon as the layout is finished, at most N seconds later.
    A task that cannot be done is an answer (`outcome: infeasible` with reasons), not an error.
    """
    body = await json_body(request, state.settings.max_body)
    accepted = await run_in_threadpool(accept, body, state.settings, state.library)
    job = await state.jobs.submit(accepted)
    wait = preferred_wait(request.headers.getlist("prefer"), state.settings.max_wait)
    headers = {}
    if wait is not None:
        headers["Preference-Applied"] = f"wait={wait:g}"
        job = await state.jobs.wait(job.id, wait) or job
    return _answer(job, 200 if job.status.finished else 202, headers | {"Location": href(job)})


@router.get(
    "/{layout_id}",
    operation_id="get_layout",
    summary="See what became of a layout",
    response_model=None,
    responses={
        200: {"model": Layout, "description": "The layout in its present state."},
        304: {"description": "Unchanged since the ETag of If-None-Match."},
        404: PROBLEM,
        500: PROBLEM,
    },
)
async def get_layout(layout_id: str, request: Request, state: StateOf) -> Response:
    """The layout, whatever its state; poll until `status` is succeeded, failed or cancelled."""
    job = await state.jobs.get(layout_id)
    if job is None:
        raise Problem("layout-not-found", f"There is no layout {layout_id[:80]!r}; old ones are forgotten. Ask again.")
    if etag(job) in [tag.strip() for tag in request.headers.get("if-none-match", "").split(",")]:
        return Response(status_code=304, headers={"ETag": etag(job)})
    return _answer(job, 200, {})


@router.get(
    "",
    operation_id="list_layouts",
    summary="List layouts",
    response_model=None,
    responses={200: {"model": LayoutPage, "description": "A page."}, 422: PROBLEM, 500: PROBLEM},
)
async def list_layouts(
    state: StateOf,
    limit: Annotated[int, Query(ge=1, le=100, description="Items of a page.", examples=[20])] = 20,
    cursor: Annotated[
        str | None, Query(max_length=200, description="`next_cursor` of the page before; left out: the first page.")
    ] = None,
) -> Response:
    """Layouts in short, the newest first."""
    jobs = await state.jobs.newest(limit + 1, None if cursor is None else decode(cursor))
    more = len(jobs) > limit
    page = {
        "items": [summary(job) for job in jobs[:limit]],
        "next_cursor": encode(jobs[limit - 1].key) if more else None,
    }
    return JSONResponse(page)


def _answer(job: Job, status: int, headers: dict[str, str]) -> Response:
    """The resource with the headers that tell when to look again."""
    headers = headers | {"ETag": etag(job)}
    if not job.status.finished:
        headers["Retry-After"] = RETRY_AFTER
    return Response(layout_text(job), status, headers, media_type="application/json")
