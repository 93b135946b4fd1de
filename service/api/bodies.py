"""Bodies of requests: taken in while they arrive, in bounded pieces, and read by who knows what is in them.

The framework would take in whatever comes, and read it in the event loop.
"""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request

from duocell.service.api.state import StateOf
from duocell.service.http.body import json_body
from duocell.service.uploads.arrival import Upload


async def _json(request: Request, state: StateOf) -> bytes:
    return await json_body(request, state.settings.max_body)


JsonBody = Annotated[bytes, Depends(_json)]
"""JSON, as it was sent; the endpoint declares its schema (`json_body_of`)."""


async def _upload(request: Request, state: StateOf) -> Upload:
    return Upload(request, state.places, state.settings)


FormBody = Annotated[Upload, Depends(_upload)]
"""A form that has not been read yet: it waits for a place; the endpoint declares its schema (`form_body_of`)."""
