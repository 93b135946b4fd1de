"""/v1/layouts/{id}/events: what happens to a layout, as it happens (server-sent events)."""

from __future__ import annotations

import re
import time
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Header
from fastapi.responses import Response
from fastapi.sse import KEEPALIVE_COMMENT, EventSourceResponse, format_sse_event
from pydantic import WithJsonSchema

from duocell.service.api.ownership import OwnLayout
from duocell.service.api.state import State, StateOf
from duocell.service.http.described import answer, problems

router = APIRouter(prefix="/v1/layouts", tags=["layouts"])

KEEP_ALIVE = 15.0
"""s without an event after which a comment is sent, so that nobody on the way takes the connection for dead."""
RECONNECT = 1000
"""ms after which a client whose connection was lost asks again."""
HEADERS = {"Cache-Control": "no-store", "X-Accel-Buffering": "no"}
"""Nothing on the way keeps events back."""
_NUMBER = re.compile(r"\d{1,15}")
LastEventId = Annotated[
    str | None,
    Header(alias="Last-Event-ID", description="id of the last event received: the stream goes on behind it."),
    WithJsonSchema({"type": "string"}),
]


@router.get(
    "/{layout_id}/events",
    operation_id="follow_layout",
    summary="Follow a layout",
    responses={
        200: answer("Events, up to `done`.", content={"text/event-stream": {}}),
        204: answer("Nothing comes after the event of Last-Event-ID: `done` was the last."),
        **problems(404, 500, 503),
    },
)
async def follow_layout(job: OwnLayout, state: StateOf, last_event_id: LastEventId = None) -> Response:
    """Events since the beginning, or since that of `Last-Event-ID`, and then as they happen.

    `status`: queued or running, with the number of the attempt. `stage`, `screening`, `start`, `iteration`, `bound`,
    `verification`: what the solve does; `stage` also how far it is and about how long it still takes. `incumbent`: a
    usable layout of the whole cell that is better than all before. `done`: the last one, with status and outcome. The
    data of each is a JSON object with the time `at`; the id of each rises. A stream that ends without `done` can be
    resumed.
    """
    last = (last_event_id or "").strip()
    after = int(last) if _NUMBER.fullmatch(last) else 0
    if job.status.finished and after and not await state.jobs.has_events(job.id, after):
        return Response(status_code=204)  # tells an EventSource not to ask again
    return EventSourceResponse(_stream(state, job.id, after), headers=HEADERS)


async def _stream(state: State, layout_id: str, after: int) -> AsyncIterator[bytes]:
    """The stream as bytes; it ends after `done`, and in any case after a time."""
    yield format_sse_event(retry=RECONNECT)
    most = state.settings.max_follow
    ends_at = time.monotonic() + most
    async for event in state.jobs.follow(layout_id, after, min(KEEP_ALIVE, most)):
        if event is None:
            yield KEEPALIVE_COMMENT
        else:
            yield format_sse_event(event=event.kind, data_str=event.data, id=str(event.number))
        if time.monotonic() > ends_at:
            return
