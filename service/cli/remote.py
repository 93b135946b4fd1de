"""Solving at a server, for `duocell solve --server URL`."""

from __future__ import annotations

import os
import time
import uuid
from typing import Any

import httpx2

from duocell.service.cli.progress import display
from duocell.service.workers.executor import Report

RETRIES, PAUSE = 5, 1.0
"""Times that a request is sent whose answer got lost, and s in between."""
RECONNECTS = 60
"""Times that a stream of events is taken up again without anything new: a server may be restarted meanwhile."""
TIMEOUT = httpx2.Timeout(10.0, read=60.0)
"""s; a server that follows a layout says something every 15 s."""


class Refused(Exception):
    """The server answered with a problem.

    Attributes:
        status: of HTTP.
        problem: its document; empty if the answer holds none.
    """

    def __init__(self, answer: httpx2.Response) -> None:
        self.status = answer.status_code
        try:
            document = answer.json()
        except ValueError:
            document = {}
        self.problem: dict[str, Any] = document if isinstance(document, dict) else {}
        super().__init__(str(self.problem.get("detail") or f"{answer.url} answered {self.status}"))


def solve_there(url: str, body: bytes) -> dict[str, Any]:
    """The finished resource of a request.

    Args:
        url: of the server.
        body: the request.

    Raises:
        Refused: the server does not take it in.
        httpx2.HTTPError: the server cannot be reached, now or any more.
        KeyboardInterrupt: the layout was cancelled.
    """
    key = os.environ.get("DUOCELL_API_KEY", "")
    headers = {"Authorization": f"Bearer {key}"} if key else {}
    with httpx2.Client(base_url=url, headers=headers, timeout=TIMEOUT) as client, display() as report:
        once = str(uuid.uuid4())
        try:
            location = _submit(client, body, once)
            _follow(client, location, report)
            return _checked(client.get(location))
        except KeyboardInterrupt:  # perhaps before the address was told: the same request has the same one
            client.post(f"{_submit(client, body, once)}/cancel")
            raise


def _submit(client: httpx2.Client, body: bytes, once: str) -> str:
    """Send the request; its address. The key makes sure that it is carried out ``once``, however often it is sent."""
    headers = {"Content-Type": "application/json", "Idempotency-Key": once}
    for attempt in range(RETRIES):
        try:
            return _checked_answer(client.post("/v1/layouts", content=body, headers=headers)).headers["location"]
        except (httpx2.ConnectError, httpx2.UnsupportedProtocol):
            raise  # nobody is there at all
        except httpx2.TransportError:
            if attempt == RETRIES - 1:
                raise
            time.sleep(PAUSE)
    raise AssertionError("every attempt returns or raises")


def _follow(client: httpx2.Client, location: str, report: Report) -> None:
    """Show what happens until the layout is finished; a stream that ends before is taken up where it ended."""
    last, silent = "", 0
    while True:
        try:
            with client.sse(f"{location}/events", headers={"Last-Event-ID": last} if last else {}) as events:
                if events.response.status_code == httpx2.codes.NO_CONTENT:
                    return
                if events.response.is_error:
                    events.response.read()
                _checked_answer(events.response)
                for event in events:
                    if event.event == "done":
                        return
                    if event.id != last:
                        last, silent = event.id, 0
                        report(event.event, event.data)
        except httpx2.TransportError:
            if silent >= RECONNECTS:
                raise
        silent += 1
        time.sleep(PAUSE)


def _checked_answer(answer: httpx2.Response) -> httpx2.Response:
    if answer.is_error:
        raise Refused(answer)
    return answer


def _checked(answer: httpx2.Response) -> dict[str, Any]:
    resource: dict[str, Any] = _checked_answer(answer).json()
    return resource
