"""`duocell serve`."""

from __future__ import annotations

import logging
from typing import Any

from pydantic import ValidationError

from service.cli_input import complain
from service.executor import ProcessExecutor
from service.issues import Issue
from service.settings import Settings

GRACEFUL_SHUTDOWN = 5
"""s that open requests are given when the server is told to stop."""


def serve(**flags: Any) -> int:
    """Answer requests until told to stop; flags that are None leave the setting to the environment."""
    try:
        settings = Settings(**{name: value for name, value in flags.items() if value is not None})
    except ValidationError as error:
        return complain(Issue("", f"setting {'.'.join(map(str, e['loc']))}: {e['msg']}") for e in error.errors())
    executor = ProcessExecutor(settings.workers)
    executor.start()  # the workers load their engines while this process loads the web framework
    import uvicorn

    from service.app import create_app

    logging.basicConfig(level=logging.WARNING, format="%(levelname)s:     %(message)s")
    try:
        uvicorn.run(
            create_app(settings, executor),
            host=settings.host,
            port=settings.port,
            timeout_graceful_shutdown=GRACEFUL_SHUTDOWN,
            server_header=False,
        )
    finally:
        executor.stop()  # nothing happens if the application has done so
    return 0
