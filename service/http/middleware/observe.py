"""Gives every request an identifier, a line in the log and its place in the metrics."""

from __future__ import annotations

import logging
import re
import time
import uuid

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from duocell.service.common.routes import PROBES, route_of
from duocell.service.observability import logs, metrics

log = logging.getLogger("service.access")

HEADER = "X-Request-ID"
CLIENT_LEFT = 499
"""In logs and metrics only: no answer began, for the client was gone. nginx calls it so."""

_USABLE = re.compile(r"[A-Za-z0-9._-]{1,64}")
_LOCATION = re.compile(r"/v1/layouts/([^/]+)")


class Observe:
    """Outermost, so that refused requests are seen as well.

    Headers, query strings and bodies are never logged: keys and layouts are in them.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the class."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        given = Headers(scope=scope).get(HEADER, "")
        request_id = given if _USABLE.fullmatch(given) else uuid.uuid4().hex
        answer = _Answer(send, request_id)
        began = time.perf_counter()
        with logs.about(request_id=request_id):
            try:
                await self._app(scope, receive, answer.send)
            finally:
                _note(scope, answer, time.perf_counter() - began)


class _Answer:
    """Passes an answer on and remembers how it began."""

    def __init__(self, send: Send, request_id: str) -> None:
        self._send = send
        self._request_id = request_id
        self.status = CLIENT_LEFT
        self.location = ""

    async def send(self, message: Message) -> None:
        """An ASGI channel."""
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            headers[HEADER] = self._request_id
            self.status = message["status"]
            self.location = headers.get("location", "")
        await self._send(message)


def _note(scope: Scope, answer: _Answer, seconds: float) -> None:
    """Count and log a request."""
    route = route_of(scope)
    metrics.request(route, scope["method"], answer.status, seconds)
    level = logging.DEBUG if scope["path"] in PROBES else logging.WARNING if answer.status >= 500 else logging.INFO
    facts = {
        "method": scope["method"],
        "route": route,
        "path": scope["path"][:200],
        "status": answer.status,
        "duration_ms": round(1000.0 * seconds, 2),
        "client": (scope.get("client") or ("",))[0],
        "key": scope.get("duocell.key"),
        "job_id": scope.get("path_params", {}).get("layout_id") or _job_of(answer.location),
    }
    log.log(level, "request", extra={name: fact for name, fact in facts.items() if fact is not None})


def _job_of(location: str) -> str | None:
    match = _LOCATION.fullmatch(location)
    return match[1] if match else None
