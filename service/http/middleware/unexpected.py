"""Turns what nobody expected into a problem, inside of the other middleware, so that its answer is like any other."""

from __future__ import annotations

import logging

from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from duocell.service.common.problems import Problem, response

log = logging.getLogger(__name__)


class Unexpected:
    """Innermost. What breaks after an answer has begun cannot be answered any more: the server cuts the connection."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the class."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        begun = False

        async def sending(message: Message) -> None:
            nonlocal begun
            begun = begun or message["type"] == "http.response.start"
            await send(message)

        try:
            await self._app(scope, receive, sending)
        except ClientDisconnect:
            log.debug("the client left while it sent its body")
        except Exception:  # the last resort of a service: the trace goes to the log, a problem to the client
            if begun:
                raise
            log.exception("unexpected error")
            detail = "Something unexpected happened; the log of the server has the details."
            await response(Problem("internal", detail), scope["path"])(scope, receive, send)
