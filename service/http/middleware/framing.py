"""Refuses requests whose end is told in two ways: whoever stands between may read another request out of them."""

from __future__ import annotations

from starlette.datastructures import Headers
from starlette.types import ASGIApp, Receive, Scope, Send

from duocell.service.common.problems import Problem, response


class Framing:
    """400 for Content-Length together with Transfer-Encoding (RFC 9112, 6.1), and the connection is closed."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the class."""
        if scope["type"] == "http":
            headers = Headers(scope=scope)
            if "content-length" in headers and "transfer-encoding" in headers:
                detail = "Content-Length and Transfer-Encoding are both there; which one counts? Send one of them."
                problem = Problem("bad-request", detail, headers={"Connection": "close"})
                await response(problem, scope["path"])(scope, receive, send)
                return
        await self._app(scope, receive, send)
