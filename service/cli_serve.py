"""`duocell serve`."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError

from service.cli_input import complain
from service.executor import ProcessExecutor
from service.issues import Issue
from service.keys import KeysUnusable, keyring
from service.settings import Settings

GRACEFUL_SHUTDOWN = 5
"""s that open requests are given when the server is told to stop."""

MAX_HEAD = 32_768
"""Bytes of a request's head (method, address, headers) and of a chunk's; beyond them the connection is closed."""


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
    executor = ProcessExecutor(settings.workers, settings.data_dir)
    executor.start()  # the workers load their engines while this process loads the web framework
    import uvicorn

    from service import logs
    from service.app import create_app

    logs.configure(settings)
    try:
        uvicorn.run(
            create_app(settings, executor),
            host=settings.host,
            port=settings.port,
            timeout_graceful_shutdown=GRACEFUL_SHUTDOWN,
            server_header=False,
            http="h11",  # the one that limits headers: others collect them without end
            h11_max_incomplete_event_size=MAX_HEAD,
            log_config=None,  # `service.logs` has configured them
            access_log=False,  # `service.middleware.observe` writes it
        )
    finally:
        executor.stop()  # nothing happens if the application has done so
    return 0
