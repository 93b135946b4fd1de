"""Reading a form (multipart/form-data), but never more of it than is allowed."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncGenerator, Sequence
from dataclasses import dataclass
from pathlib import PurePosixPath

from fastapi import Request
from starlette.datastructures import FormData, UploadFile
from starlette.formparsers import MultiPartException, MultiPartParser

from duocell.service.common.issues import InvalidRequest, Issue, IssueCollector, pointer_of, shortened
from duocell.service.common.problems import Problem
from duocell.service.http.arriving import arriving

MOST_TEXT = 4_000_000
"""bytes of a part that is no file; a URDF may come as one."""

_MOST_PARTS = 20
_SLACK = 100_000
"""bytes for boundaries and headers, on top of what the parts may have."""


@dataclass(frozen=True, slots=True)
class File:
    """A file of a form: its name without folders ("" if it has none), and its contents."""

    name: str
    data: bytes


@dataclass(frozen=True, slots=True)
class Form:
    """The parts of a form that have anything in them."""

    texts: dict[str, str]
    files: dict[str, File]


async def read_form(
    request: Request, *, texts: Sequence[str], files: Sequence[str], required: Sequence[str], most: int, within: float
) -> Form:
    """The form in the body of a request.

    Args:
        request: whose body has not been read yet.
        texts: names of parts that may be text.
        files: names of parts that are files; text sent in their place is taken for the contents of a file.
        required: names of parts that must be there.
        most: bytes that it may have.
        within: s in which it must arrive.

    Raises:
        Problem: it calls itself something else, is too long, too slow, or no form.
        InvalidRequest: parts are missing, unknown, or sent twice.
    """
    media_type = request.headers.get("content-type", "").split(";")[0].strip().lower()
    if media_type != "multipart/form-data":
        raise Problem(
            "not-a-form",
            f"The body calls itself {media_type[:80] or 'nothing'!r}. Send a form, as `curl -F` does.",
        )
    if _announced(request) > most + _SLACK:
        raise _too_large(most)
    parser = MultiPartParser(
        request.headers,
        _at_most(request, most + _SLACK),
        max_files=_MOST_PARTS,
        max_fields=_MOST_PARTS,
        max_part_size=MOST_TEXT,
    )
    try:
        async with asyncio.timeout(within):
            data = await parser.parse()
    except TimeoutError as error:
        raise Problem("too-slow", f"The form did not arrive within {within:g} s. Send it again.") from error
    except OSError as error:  # large parts go through a temporary file
        raise Problem(
            "not-writable", f"There is no room for the upload ({error.strerror}). Try again later."
        ) from error
    except (MultiPartException, ValueError) as error:  # broken, or in an encoding nobody knows
        message = getattr(error, "message", str(error)).rstrip(".")
        raise Problem(
            "invalid-form", f"The body is no form: {message[:200]}. Let a library or curl write it."
        ) from error
    try:
        form = await _sorted(data, texts, files)
    finally:
        await data.close()
    missing = [name for name in required if name not in form.texts and name not in form.files]
    if missing:
        raise InvalidRequest(
            [Issue(pointer_of([name]), f"{name!r} is missing; it is required. Add it.") for name in missing]
        )
    return form


async def _sorted(data: FormData, texts: Sequence[str], files: Sequence[str]) -> Form:
    """The parts by what they may be; empty ones, as browsers send them for empty fields, are left out."""
    issues = IssueCollector()
    form = Form({}, {})
    for name, value in data.multi_items():
        if name not in texts and name not in files:
            allowed = ", ".join([*texts, *files])
            issues.add(
                pointer_of([name[:80]]), f"{shortened(name)} is not known here; allowed are {allowed}. Remove it."
            )
        elif len(data.getlist(name)) > 1:
            issues.add(pointer_of([name]), f"{name!r} was sent more than once. Send it once.")
        elif name in texts:
            if isinstance(value, UploadFile):
                issues.add(pointer_of([name]), f"{name!r} is a file; a text is needed. Send it without a file name.")
            elif value:
                form.texts[name] = value
        elif isinstance(value, UploadFile):
            contents = await value.read()
            if contents or value.filename:
                form.files[name] = File(PurePosixPath((value.filename or "").replace("\\", "/")).name, contents)
        elif value:
            form.files[name] = File("", value.encode())
    issues.raise_any()
    return form


async def _at_most(request: Request, most: int) -> AsyncGenerator[bytes, None]:
    """The body as it arrives.

    Raises:
        Problem: it is longer.
    """
    length = 0
    async for chunk in arriving(request):
        length += len(chunk)
        if length > most:
            raise _too_large(most - _SLACK)
        yield chunk


def _announced(request: Request) -> int:
    """Content-Length, 0 if there is none."""
    text = request.headers.get("content-length", "")
    return int(text) if text.isascii() and text.isdigit() else 0


def _too_large(most: int) -> Problem:
    detail = f"The upload has more than {most} bytes (DUOCELL_MAX_UPLOAD). Send simplified collision meshes."
    return Problem("upload-too-large", detail, errors=[Issue("", detail)], headers={"Connection": "close"})
