"""/v1/layouts: ask for a layout, see what became of it, call it off, forget it."""

from __future__ import annotations

from typing import Annotated, Literal
from urllib.parse import urlencode

from fastapi import APIRouter, Query, Request
from fastapi.responses import JSONResponse, Response

from duocell.service.api.ownership import client_of, not_found, only_client, own_layout, view_of
from duocell.service.api.state import StateOf
from duocell.service.common.timestamps import parse_timestamp
from duocell.service.http.body import json_body
from duocell.service.http.cursor import decode, encode
from duocell.service.http.idempotency import idempotency_key
from duocell.service.http.prefer import preferred_wait
from duocell.service.jobs.job import Job, JobStatus
from duocell.service.jobs.job_store import JobFilter
from duocell.service.jobs.resources import etag, href, layout_text, summary
from duocell.service.schemas.resources import Layout, LayoutPage, ProblemDocument

router = APIRouter(prefix="/v1/layouts", tags=["layouts"])

RETRY_AFTER = "1"
PROBLEM = {"model": ProblemDocument}
PRINTABLE = r"^[^\x00-\x1f\x7f]*$"


@router.post(
    "",
    operation_id="create_layout",
    summary="Ask for a layout",
    status_code=202,
    response_model=None,
    responses={
        200: {"model": Layout, "description": "Finished within the time of `Prefer: wait`."},
        202: {"model": Layout, "description": "Stored; it will be solved, also across a restart. See Location."},
        **dict.fromkeys((400, 409, 413, 415, 422, 429, 500, 503), PROBLEM),
    },
)
async def create_layout(request: Request, state: StateOf) -> Response:
    """Find the base placements that keep all joints nearest to their references along the task.

    With `Prefer: wait=N` the answer comes as soon as the layout is finished, at most N seconds later.
    With an `Idempotency-Key` the request can be repeated until an answer arrives: it is carried out once.
    A task that cannot be done is an answer (`outcome: infeasible` with reasons), not an error.
    """
    key = idempotency_key(request.headers.getlist("idempotency-key"))
    body = await json_body(request, state.settings.max_body)
    accepted = await state.acceptance.layout(body, view_of(request, state))
    job = await state.jobs.submit(accepted, client_of(request), key)
    wait = preferred_wait(request.headers.getlist("prefer"), state.settings.max_wait)
    headers = {}
    if wait is not None:
        headers["Preference-Applied"] = f"wait={wait:g}"
        if not job.status.finished:
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
        **dict.fromkeys((404, 500, 503), PROBLEM),
    },
)
async def get_layout(layout_id: str, request: Request, state: StateOf) -> Response:
    """The layout, whatever its state; poll until `status` is succeeded, failed or cancelled."""
    job = await own_layout(layout_id, request, state)
    known = [tag.strip() for tag in request.headers.get("if-none-match", "").split(",")]
    if etag(job) in known or "*" in known:
        return Response(status_code=304, headers={"ETag": etag(job)})
    return _answer(job, 200, {})


@router.get(
    "",
    operation_id="list_layouts",
    summary="List layouts",
    response_model=None,
    responses={
        200: {"model": LayoutPage, "description": "A page."},
        **dict.fromkeys((422, 500, 503), PROBLEM),
    },
)
async def list_layouts(
    request: Request,
    state: StateOf,
    limit: Annotated[int, Query(ge=1, le=100, description="Items of a page.", examples=[20])] = 20,
    cursor: Annotated[
        str | None, Query(max_length=200, description="`next_cursor` of the page before; left out: the first page.")
    ] = None,
    status: Annotated[
        list[Literal["queued", "running", "succeeded", "failed", "cancelled"]] | None,
        Query(max_length=5, description="Only layouts in this state; may be repeated."),
    ] = None,
    name: Annotated[
        str | None, Query(max_length=200, pattern=PRINTABLE, description="Only layouts with exactly this label.")
    ] = None,
    created_after: Annotated[
        str | None, Query(max_length=40, description="Only layouts created later than this (RFC 3339).")
    ] = None,
    created_before: Annotated[
        str | None, Query(max_length=40, description="Only layouts created earlier than this (RFC 3339).")
    ] = None,
) -> Response:
    """Layouts in short, the newest first."""
    chosen = JobFilter(
        statuses=None if status is None else [JobStatus(one) for one in status],
        name=name,
        client=only_client(request, state),
        created_after=parse_timestamp("created_after", created_after),
        created_before=parse_timestamp("created_before", created_before),
    )
    jobs = await state.jobs.page(limit + 1, None if cursor is None else decode(cursor), chosen)
    following = encode(jobs[limit - 1].sequence) if len(jobs) > limit else None
    headers = {}
    if following is not None:
        query = [(key, value) for key, value in request.query_params.multi_items() if key != "cursor"]
        headers["Link"] = f'<{request.url.path}?{urlencode([*query, ("cursor", following)])}>; rel="next"'
    return JSONResponse({"items": [summary(job) for job in jobs[:limit]], "next_cursor": following}, headers=headers)


@router.post(
    "/{layout_id}/cancel",
    operation_id="cancel_layout",
    summary="Call a layout off",
    status_code=202,
    response_model=None,
    responses={
        202: {"model": Layout, "description": "It is cancelled; its solve, if one was running, ends within a second."},
        **dict.fromkeys((404, 409, 500, 503), PROBLEM),
    },
)
async def cancel_layout(layout_id: str, request: Request, state: StateOf) -> Response:
    """End a queued or running layout for good. May be repeated."""
    await own_layout(layout_id, request, state)
    job = await state.jobs.cancel(layout_id)
    if job is None:
        raise not_found(layout_id)
    return _answer(job, 202, {})


@router.delete(
    "/{layout_id}",
    operation_id="delete_layout",
    summary="Forget a layout",
    status_code=204,
    response_model=None,
    responses={
        204: {"description": "It is forgotten, with its events and its idempotency key."},
        **dict.fromkeys((404, 409, 500, 503), PROBLEM),
    },
)
async def delete_layout(layout_id: str, request: Request, state: StateOf) -> Response:
    """Forget a finished layout."""
    await own_layout(layout_id, request, state)
    if not await state.jobs.delete(layout_id):
        raise not_found(layout_id)
    return Response(status_code=204)


def _answer(job: Job, status: int, headers: dict[str, str]) -> Response:
    """The resource with the headers that tell when to look again."""
    headers = headers | {"ETag": etag(job)}
    if not job.status.finished:
        headers["Retry-After"] = RETRY_AFTER
    return Response(layout_text(job), status, headers, media_type="application/json")
