"""Requests as the service takes them, and results as it gives them, without a service."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from os import PathLike
from pathlib import Path
from typing import Any

from duocell.models.cell.cell import Cell
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings
from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.jobs.resources import solved_here
from duocell.service.requests.accept import Accepted, accept
from duocell.service.requests.convert import settings_of
from duocell.service.requests.prepared import read_accepted
from duocell.service.requests.warnings import warnings_of
from duocell.service.results import documents
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Limits
from duocell.service.validation.strict_json import NotJson


@dataclass(frozen=True, eq=False, slots=True)
class Request:
    """A request for a layout, as it was read.

    Attributes:
        cell: that it describes.
        settings: how it wants to be solved.
    """

    cell: Cell
    settings: Settings
    _request: LayoutRequest = field(repr=False)
    _accepted: Accepted = field(repr=False)
    _read_at: datetime = field(repr=False)

    def document(self, layout: Layout) -> dict[str, Any]:
        """Request and result as one JSON document.

        It is what ``duocell solve -o`` writes, and what ``duocell figure`` draws and ``duocell check`` checks: the
        request with every default filled in, and the result with warnings about what may be a slip in the request.

        Args:
            layout: of this request's cell.

        Returns:
            Names and values of JSON; numbers that are infinite are None.
        """
        warnings = warnings_of(self._request, self.cell, layout)
        result = documents.result_document(layout, self._accepted.request_hash, warnings)
        return solved_here(self._accepted, result, self._read_at)


def read_request(source: str | PathLike[str] | bytes | Mapping[str, Any]) -> Request:
    """A request for a layout.

    Args:
        source: path of a JSON file (``str`` or ``Path``), its content (``bytes``, or a ``str`` that begins with a
            brace), or the document as a dictionary: a body of ``POST /v1/layouts`` (docs/request.md). Robots are those
            of the catalogue and D-H tables.

    Raises:
        InvalidRequest: no JSON document, or a request that cannot be carried out; ``issues`` holds everything that is
            wrong with it, each with a JSON pointer and a sentence. The limits on its size are those of the command
            line (``DUOCELL_MAX_POSES``, ...).
        OSError: the file cannot be read.
    """
    read_at = datetime.now(UTC)
    try:
        accepted = accept(_body(source), Limits())
    except NotJson as error:
        raise InvalidRequest([Issue("", error.detail)]) from error
    request, cell = read_accepted(LayoutRequest, accepted.prepared)
    return Request(cell, settings_of(request, accepted.time_limit), request, accepted, read_at)


def _body(source: str | PathLike[str] | bytes | Mapping[str, Any]) -> bytes:
    if isinstance(source, bytes):
        return source
    if isinstance(source, Mapping):
        try:
            return json.dumps(source, allow_nan=False).encode()
        except (TypeError, ValueError) as error:  # an array, NaN, a circle
            raise InvalidRequest([Issue("", f"The dictionary is no JSON document: {error}.")]) from error
    if isinstance(source, str) and source.lstrip().startswith("{"):
        return source.encode()
    return Path(source).read_bytes()


def result_document(layout: Layout) -> dict[str, Any]:
    """A layout as the ``result`` of the service's documents (docs/result.md), for cells that came from no request.

    For those that did, `Request.document` has the request and warnings as well.

    Args:
        layout: of any cell.

    Returns:
        Names and values of JSON, ``request_hash`` empty; numbers that are infinite are None.
    """
    return documents.result_document(layout, "")
