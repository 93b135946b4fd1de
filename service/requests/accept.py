"""The way of a request into the house: bytes, JSON, sizes, fields, meaning. After it a request can be carried out."""

from __future__ import annotations

import hashlib
import json
from dataclasses import dataclass
from typing import Any, TypeVar

from duocell.models.cell.cell import Cell
from duocell.service.library.library import Library
from duocell.service.requests.convert import cell_of, joints_of
from duocell.service.requests.prepared import prepared
from duocell.service.schemas.evaluate import EvaluateRequest
from duocell.service.schemas.request import Certificate, LayoutRequest
from duocell.service.settings import Limits
from duocell.service.validation import validate
from duocell.service.validation.count_limits import check_amounts
from duocell.service.validation.pieces import check_pieces
from duocell.service.validation.range_limits import check_sizes
from duocell.service.validation.strict_json import parse
from duocell.service.validation.structure import check_structure

Asked = TypeVar("Asked", bound=LayoutRequest)


@dataclass(frozen=True, slots=True)
class Accepted:
    """A request that can be carried out.

    Attributes:
        text: its JSON with every default filled in, names sorted: what `request_hash` is the hash of.
        prepared: what a worker is given, see `duocell.service.requests.prepared`.
        body_hash: SHA-256 (hex) of the bytes it came as.
        request_hash: see `hash_of`.
        name: its label.
        time_limit: s for the search. certificate_time: s for a proof that come on top.
        runs: searches that it asks for, baselines and an explanation included.
    """

    text: str
    prepared: bytes
    body_hash: str
    request_hash: str
    name: str
    time_limit: float
    certificate_time: float
    runs: int


def accept(body: bytes, limits: Limits, library: Library | None = None) -> Accepted:
    """The request in ``body``.

    Args:
        body: a JSON document.
        limits: how large it may be.
        library: what users brought.

    Raises:
        NotJson: it is no JSON document.
        InvalidRequest: it cannot be carried out.
    """
    request = _read(LayoutRequest, body, limits, library)
    cell = cell_of(request, library)
    time_limit = limits.time_limit if request.time_limit is None else request.time_limit
    request = request.model_copy(update={"time_limit": time_limit})
    proof = request.certificate.time_limit if isinstance(request.certificate, Certificate) else 0.0
    return _accepted(request, cell, body, (time_limit, proof), 1 + len(request.baselines) + request.explain)


def accept_evaluation(body: bytes, limits: Limits, library: Library | None = None) -> Accepted:
    """The request to evaluate a layout in ``body``; arguments and errors as for `accept`."""
    request = _read(EvaluateRequest, body, limits, library)
    cell = cell_of(request, library)
    joints_of(request, cell)
    return _accepted(request, cell, body, (0.0, 0.0), 1)


def _read(kind: type[Asked], body: bytes, limits: Limits, library: Library | None) -> Asked:
    """The request as it will be carried out; what it means is still to be seen."""
    check_structure(body, limits)
    document = parse(body)
    check_amounts(document, limits)
    request = validate(kind, document)
    check_sizes(request, limits)
    if library is None:
        return request
    check_pieces(request, library, limits)
    return _pinned(request, library)


def _accepted(request: LayoutRequest, cell: Cell, body: bytes, times: tuple[float, float], runs: int) -> Accepted:
    time_limit, certificate_time = times
    text = _canonical(request.model_dump(mode="json"))
    return Accepted(
        text=text,
        prepared=prepared(request, cell),
        body_hash=hashlib.sha256(body).hexdigest(),
        request_hash=hashlib.sha256(text.encode()).hexdigest(),
        name=request.name,
        time_limit=time_limit,
        certificate_time=certificate_time,
        runs=runs,
    )


def _pinned(request: Asked, library: Library) -> Asked:
    """The request with the versions of users' robots filled in: it will mean the same when it is carried out."""
    arms = [
        arm.model_copy(update={"robot_version": arm.robot_version or library.version(arm.robot)})
        if isinstance(arm.robot, str)
        else arm
        for arm in request.arms
    ]
    return request.model_copy(update={"arms": arms})


def hash_of(document: Any) -> str:
    """SHA-256 (hex) of a document's canonical JSON: names sorted, no spaces, UTF-8, shortest decimal numbers.

    The ``request`` of an answer has the ``request_hash`` of that answer.
    """
    return hashlib.sha256(_canonical(document).encode()).hexdigest()


def _canonical(document: Any) -> str:
    return json.dumps(document, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)
