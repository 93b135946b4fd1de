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


@dataclass(frozen=True, slots=True)
class Upload:
    """A form that is still to arrive.

    Attributes:
        request: whose body has not been read yet.
        places: for uploads. limits: of its size and time.
    """

    request: Request
    places: UploadPlaces
    limits: Limits


@asynccontextmanager
async def arrived(upload: Upload, parts: Parts) -> AsyncIterator[Form]:
    """The form of an upload, with a place where it may be read as long as the block.

    Args:
        upload: it. parts: that it may have.

    Raises:
        Problem, InvalidRequest: see `read_form`; or there is no place for it.
    """
    places, limits = upload.places, upload.limits
    client = str(upload.request.scope["duocell.client"])
    places.reading.check(client)  # so that nobody sends everything in vain while all are taken
    with ExitStack() as held:
        with places.arriving.taken(client):
            form = await read_form(
                upload.request,
                texts=parts.texts,
                files=parts.files,
                required=parts.required,
                most=limits.max_upload,
                within=limits.upload_time_limit,
            )
            held.enter_context(places.reading.taken(client))
        yield form
