"""`duocell serve`."""

from __future__ import annotations

import asyncio
import gc
import os
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from math import ceil
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from duocell.service.cli.input import complain
from duocell.service.common.issues import Issue
from duocell.service.http.keys import KeysUnusable, keyring
from duocell.service.settings import Settings
from duocell.service.workers.pool import ProcessExecutor

AFTER_DRAIN = 3.0
"""s that open connections are given when the last solve has ended or was put back."""

MAX_HEAD = 32_768
"""Bytes of a request's head (method, address, headers) and of a chunk's; beyond them the connection is closed."""


def keep_private(folder: Path) -> None:
    """What this process and its workers write, requests and results of all clients, is for its own user alone."""
    os.umask(0o077)
    for path in folder.glob("duocell.sqlite3*"):
        with suppress(OSError):  # not ours: its owner knows
            path.chmod(0o600)


def serve(**flags: Any) -> int:
    """Answer requests until told to stop; flags that are None leave the setting to the environment."""
    try:
        settings = Settings(**{name: value for name, value in flags.items() if value is not None})
    except ValidationError as error:
        return complain(Issue("", f"setting {'.'.join(map(str, e['loc']))}: {e['msg']}") for e in error.errors())
    try:
        keyring(settings)
    except KeysUnusable as error:
        return complain([Issue("", str(error))])
    keep_private(settings.data_dir)
    executor = ProcessExecutor(settings.workers, settings.data_dir)
    executor.start()  # the engines are loaded while this process loads the web framework
    import uvicorn

    from duocell.service.app import create_app
    from duocell.service.http.connections import Connection
    from duocell.service.observability import logs, metrics

    handler = logs.configure(settings)
    metrics.watch_log(lambda: getattr(handler, "dropped", 0))
    app = create_app(settings, executor)

    class Server(uvicorn.Server):
        """Lets solves come to an end, or puts them back, while connections are closed; streams end with their jobs."""

        async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
            """See uvicorn."""
            draining = asyncio.create_task(app.state.duocell.jobs.drain(settings.drain))
            await super().shutdown(sockets)
            await draining

        @contextmanager
        def capture_signals(self) -> Iterator[None]:
            """See uvicorn, which in the end raises the signal again that stopped it: nothing is written after that."""
            with super().capture_signals():
                yield
                handler.flush()

    config = uvicorn.Config(
        app,
        host=settings.host,
        port=settings.port,
        timeout_graceful_shutdown=ceil(settings.drain + AFTER_DRAIN),
        server_header=False,
        http=Connection,  # h11, the one that limits headers: others collect them without end
        proxy_headers=bool(settings.trusted_proxies),
        forwarded_allow_ips=settings.trusted_proxies,
        h11_max_incomplete_event_size=MAX_HEAD,
        log_config=None,  # `duocell.service.observability.logs` has configured them
        access_log=False,  # `duocell.service.http.middleware.observe` writes it
    )
    server = Server(config)
    gc.collect()
    gc.freeze()  # the application stays: looking through it again and again would hold up everybody
    server.run()
    return 0 if server.started else 1
