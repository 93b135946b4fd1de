"""HEAD is GET without the body, at every address that can be got (RFC 9110)."""

from __future__ import annotations

from starlette.types import ASGIApp, Message, Receive, Scope, Send


class Head:
    """Innermost: what is inside sees GET, what is outside HEAD."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """See the class."""
        if scope["type"] != "http" or scope["method"] != "HEAD":
            await self._app(scope, receive, send)
            return
        scope["method"] = "GET"
        done = False

        async def sending(message: Message) -> None:
            nonlocal done
            if done:
                raise OSError("the answer to a HEAD has ended")  # streams end so when their client has left
            if message["type"] == "http.response.body":
                done = True
                message = {"type": "http.response.body", "body": b"", "more_body": False}
            await send(message)

        try:
            await self._app(scope, receive, sending)
        except OSError:
            if not done:
                raise
        finally:
            scope["method"] = "HEAD"
