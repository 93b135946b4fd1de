"""Logs: every line on stderr, one JSON object each, or coloured columns for a person at a terminal.

The rest of the program uses `logging` as always; this module decides how records look. What is bound with `about`
stands in every line logged inside, whoever logs it.
"""

from __future__ import annotations

import logging
import sys
from collections.abc import MutableMapping
from contextlib import AbstractContextManager
from typing import Any

import structlog
from opentelemetry import trace

from duocell.service.observability.log_writer import LogWriter
from duocell.service.settings import Logging

OURS = ("duocell", "service", "uvicorn")
"""Loggers that the level is set for (`service`: the parent of `service.access`); of the other libraries only warnings
count."""

CHILDREN = ("uvicorn.error", "uvicorn.asgi")
"""Loggers that take the level of their parent."""

NEVER = "uvicorn.access"
"""What `duocell.service.http.middleware.observe` says already, and without the query strings."""


def configure(settings: Logging | None = None) -> logging.Handler:
    """Route every logger of this process to stderr; default: as the environment says. Returns what writes the lines."""
    settings = settings or Logging()
    json = settings.log_format == "json" or (settings.log_format == "auto" and not sys.stderr.isatty())
    handler = _writer()
    handler.setFormatter(formatter(json=json))
    root = logging.getLogger()
    root.handlers = [handler]
    root.setLevel(max(logging.WARNING, _number(settings.log_level)))
    for name in OURS:
        logger = logging.getLogger(name)
        logger.setLevel(_number(settings.log_level))
        logger.handlers, logger.propagate = [], True  # uvicorn may have been given others before
    for name in CHILDREN:
        logging.getLogger(name).setLevel(logging.NOTSET)  # uvicorn may have given them levels of their own
    logging.getLogger(NEVER).disabled = True
    return handler


def _writer() -> logging.Handler:
    """What writes to stderr: without ever waiting, where that is a file, a pipe or a terminal."""
    try:
        return LogWriter(sys.stderr.fileno())
    except OSError:  # in memory
        return logging.StreamHandler(sys.stderr)


def formatter(*, json: bool) -> logging.Formatter:
    """Renders records of `logging`, with what `about` has bound and what ``extra`` brings.

    Traces never show the values of variables: a key or a request may be among them.
    """
    renderer: list[Any]
    if json:
        renderer = [structlog.processors.format_exc_info, structlog.processors.JSONRenderer(ensure_ascii=True)]
    else:
        plain = structlog.dev.plain_traceback
        renderer = [_escaped, structlog.dev.ConsoleRenderer(colors=sys.stderr.isatty(), exception_formatter=plain)]
    return structlog.stdlib.ProcessorFormatter(
        foreign_pre_chain=[
            structlog.contextvars.merge_contextvars,
            structlog.stdlib.add_log_level,
            structlog.stdlib.add_logger_name,
            structlog.processors.TimeStamper(fmt="iso", utc=True),
            structlog.stdlib.ExtraAdder(),
            _add_trace,
        ],
        processors=[structlog.stdlib.ProcessorFormatter.remove_processors_meta, *renderer],
    )


def _number(level: str) -> int:
    return logging.getLevelNamesMapping()[level.upper()]


def about(**facts: str) -> AbstractContextManager[None]:
    """A block in which every line tells these facts, for instance ``job_id``; tasks begun inside inherit them."""
    return structlog.contextvars.bound_contextvars(**facts)


def _add_trace(logger: Any, method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """The trace that is under way, where OpenTelemetry is configured, so that a line and its trace find each other."""
    event.pop("color_message", None)  # uvicorn's second wording
    context = trace.get_current_span().get_span_context()
    if context.is_valid:
        event["trace_id"] = trace.format_trace_id(context.trace_id)
        event["span_id"] = trace.format_span_id(context.span_id)
    return event


def _escaped(logger: Any, method: str, event: MutableMapping[str, Any]) -> MutableMapping[str, Any]:
    """Control characters of what clients sent must not reach a terminal. JSON escapes them anyway."""
    for name, value in event.items():
        if name != "exception" and isinstance(value, str) and not value.isprintable():
            event[name] = value.encode("unicode_escape").decode("ascii")
    return event
