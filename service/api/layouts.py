"""/v1/layouts: ask for a layout, see what became of it, call it off, forget it."""

from __future__ import annotations

from typing import Annotated, Literal

from fastapi import APIRouter, Header, Query, Response
from pydantic import WithJsonSchema

from duocell.service.api.bodies import JsonBody
from duocell.service.api.ownership import Client, OnlyClient, OwnLayout, OwnView, not_found
from duocell.service.api.state import StateOf
from duocell.service.http.cursor import LinkToNext, decode, encode
from duocell.service.http.described import answer, json_body_of, problems
from duocell.service.http.idempotency import IdempotencyKey
from duocell.service.http.prefer import WaitPreference, preferred_wait
from duocell.service.http.time_query import parse_timestamp
from duocell.service.jobs.job import Job, JobStatus
from duocell.service.jobs.job_store import JobFilter
from duocell.service.jobs.resources import etag, href, layout_text, summary
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.schemas.resources import Layout, LayoutPage

router = APIRouter(prefix="/v1/layouts", tags=["layouts"])

RETRY_AFTER = "1"
PRINTABLE = r"^[^\x00-\x1f\x7f]*$"
LINKS = {
    operation: {"operationId": operation, "parameters": {"layout_id": "$response.body#/id"}}
    for operation in ("get_layout", "follow_layout", "cancel_layout", "delete_layout")
}
"""What may be asked about a layout that was taken in."""
IfNoneMatch = Annotated[
    str | None,
    Header(
        alias="If-None-Match", description="ETag of the answer before; the answer is 304 while nothing has changed."
    ),
    WithJsonSchema({"type": "string"}),
]


@router.post(
    "",
    operation_id="create_layout",
    summary="Ask for a layout",
    status_code=202,
    response_model=Layout,
    responses={
        200: answer(
            "Finished within the time of `Prefer: wait`.",
            *("Location", "ETag", "Preference-Applied"),
            model=Layout,
            links=LINKS,
        ),
        202: answer(
            "Stored; it will be solved, also across a restart. See Location.",
            *("Location", "ETag", "Retry-After", "Preference-Applied"),
            links=LINKS,
        ),
        **problems(400, 409, 413, 415, 422, 429, 500, 503, headers={409: ("Retry-After",)}),
    },
    openapi_extra=json_body_of(LayoutRequest, "The task, the arms, and where their bases may stand.", EXAMPLE),
)
async def create_layout(
    prefer: WaitPreference, key: IdempotencyKey, body: JsonBody, view: OwnView, client: Client, state: StateOf
) -> Response:
    """Find the base placements that keep all joints nearest to their references along the task.

    With `Prefer: wait=N` the answer comes as soon as the layout is finished, at most N seconds later.
    With an `Idempotency-Key` the request can be repeated until an answer arrives: it is carried out once.
    A task that cannot be done is an answer (`outcome: infeasible` with reasons), not an error.
    """
    accepted = await state.acceptance.layout(body, view)
    job = await state.jobs.submit(accepted, client, key)
    wait = preferred_wait(prefer, state.settings.max_wait)
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
    response_model=Layout,
    responses={
        200: answer("The layout in its present state.", "ETag", "Retry-After"),
        304: answer("Unchanged since the ETag of If-None-Match.", "ETag"),
        **problems(404, 500, 503),
    },
)
async def get_layout(job: OwnLayout, if_none_match: IfNoneMatch = None) -> Response:
    """The layout, whatever its state; poll until `status` is succeeded, failed or cancelled."""
    known = [tag.strip() for tag in (if_none_match or "").split(",")]
    if etag(job) in known or "*" in known:
        return Response(status_code=304, headers={"ETag": etag(job)})
    return _answer(job, 200, {})


@router.get(
    "",
    operation_id="list_layouts",
    summary="List layouts",
    responses={200: answer("A page.", "Link"), **problems(422, 500, 503)},
)
async def list_layouts(
    asker: OnlyClient,
    link: LinkToNext,
    response: Response,
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
) -> LayoutPage:
    """Layouts in short, the newest first."""
    chosen = JobFilter(
        statuses=None if status is None else [JobStatus(one) for one in status],
        name=name,
        client=asker,
        created_after=parse_timestamp("created_after", created_after),
        created_before=parse_timestamp("created_before", created_before),
    )
    jobs = await state.jobs.page(limit + 1, None if cursor is None else decode(cursor), chosen)
    following = encode(jobs[limit - 1].sequence) if len(jobs) > limit else None
    if following is not None:
        response.headers["Link"] = link(following)
    return LayoutPage(items=[summary(job) for job in jobs[:limit]], next_cursor=following)


@router.post(
    "/{layout_id}/cancel",
    operation_id="cancel_layout",
    summary="Call a layout off",
    status_code=202,
    response_model=Layout,
    responses={
        202: answer("It is cancelled; its solve, if one was running, ends within a second.", "ETag"),
        **problems(404, 409, 500, 503),
    },
)
async def cancel_layout(own: OwnLayout, state: StateOf) -> Response:
    """End a queued or running layout for good. May be repeated."""
    job = await state.jobs.cancel(own.id)
    if job is None:
        raise not_found(own.id)
    return _answer(job, 202, {})


@router.delete(
    "/{layout_id}",
    operation_id="delete_layout",
    summary="Forget a layout",
    status_code=204,
    responses={
        204: answer("It is forgotten, with its events and its idempotency key."),
        **problems(404, 409, 500, 503),
    },
)
async def delete_layout(own: OwnLayout, state: StateOf) -> None:
    """Forget a finished layout."""
    if not await state.jobs.delete(own.id):
        raise not_found(own.id)


def _answer(job: Job, status: int, headers: dict[str, str]) -> Response:
    """The resource with the headers that tell when to look again."""
    headers = headers | {"ETag": etag(job)}
    if not job.status.finished:
        headers["Retry-After"] = RETRY_AFTER
    return Response(layout_text(job), status, headers, media_type="application/json")
