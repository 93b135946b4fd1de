"""From an accepted request to the document of its result: what a worker and the command line both do."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings
from duocell.service.common.issues import Issue
from duocell.service.library.library import Library
from duocell.service.requests.convert import joints_of, settings_of
from duocell.service.requests.prepared import read_accepted
from duocell.service.requests.warnings import warnings_of
from duocell.service.results.documents import result_document
from duocell.service.schemas.evaluate import EvaluateRequest
from duocell.service.schemas.request import LayoutRequest

Understood = Callable[[Settings, Callable[[Layout], list[Issue]]], None]
"""Takes what is asked for, and a function that makes the warnings beside a layout."""


def evaluate_request(accepted: bytes | str, request_hash: str, library: Library | None = None) -> dict[str, Any]:
    """The ``result`` of an evaluation.

    Args:
        accepted: form or text of an accepted request (`duocell.service.requests.prepared`).
        request_hash: of that request.
        library: what users brought.

    Raises:
        DuocellError: an engine broke down.
    """
    request, cell = read_accepted(EvaluateRequest, accepted, library)
    layout = evaluate_layout(cell, joints_of(request, cell))
    return result_document(layout, request_hash, warnings_of(request, cell, layout))


def solve_request(
    accepted: bytes | str,
    request_hash: str,
    time_limit: float,
    library: Library | None = None,
    understood: Understood = lambda settings, warnings: None,
) -> dict[str, Any]:
    """The ``result`` of a layout resource.

    Args:
        accepted: form or text of an accepted request (`duocell.service.requests.prepared`).
        request_hash: of that request.
        time_limit: s, soft limit of search, automatic proof and checks, where the request has none.
        library: what users brought; it has to know what was deleted since the request was accepted.
        understood: told what is asked for, and how to warn beside a layout, before the search begins.

    Raises:
        DuocellError: an engine broke down.
    """
    request, cell = read_accepted(LayoutRequest, accepted, library)
    settings = settings_of(request, time_limit)
    understood(settings, lambda some: warnings_of(request, cell, some))
    layout = optimize(cell, settings)
    return result_document(layout, request_hash, warnings_of(request, cell, layout))
