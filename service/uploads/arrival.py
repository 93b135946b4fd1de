"""An upload from its first byte to the place where it is read."""

from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import ExitStack, asynccontextmanager
from dataclasses import dataclass

from fastapi import Request

from duocell.service.settings import Limits
from duocell.service.uploads.form import Form, read_form
from duocell.service.uploads.places import UploadPlaces


@dataclass(frozen=True, slots=True)
class Parts:
    """Names of parts that a form may have, texts and files, and of those that it must have."""

    texts: tuple[str, ...]
    files: tuple[str, ...]
    required: tuple[str, ...]


@asynccontextmanager
async def arrived(
    request: Request,
    places: UploadPlaces,
    parts: Parts,
    limits: Limits,
) -> AsyncIterator[Form]:
    """The form of an upload, with a place where it may be read as long as the block.

    Args:
        request: whose body has not been read yet.
        places: for uploads. parts: that it may have. limits: of its size and time.

    Raises:
        Problem, InvalidRequest: see `read_form`; or there is no place for it.
    """
    client = str(request.scope["duocell.client"])
    places.reading.check(client)  # so that nobody sends everything in vain while all are taken
    with ExitStack() as held:
        with places.arriving.taken(client):
            form = await read_form(
                request,
                texts=parts.texts,
                files=parts.files,
                required=parts.required,
                most=limits.max_upload,
                within=limits.upload_time_limit,
            )
            held.enter_context(places.reading.taken(client))
        yield form
