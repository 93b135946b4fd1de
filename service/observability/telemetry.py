"""OpenTelemetry, where the environment asks for it.

FastAPI instruments itself: a span and a duration per request. It sends them over OTLP (HTTP with protobuf) once
OTEL_EXPORTER_OTLP_ENDPOINT, or that of one signal, is set; before that nothing of the SDK is even loaded.
"""

from __future__ import annotations

from collections.abc import Iterator, MutableMapping
from contextlib import contextmanager
from typing import Any

from fastapi.telemetry import TelemetryConfig
from opentelemetry import trace
from opentelemetry.trace import TracerProvider

from duocell.service.common.routes import PROBES


def config() -> TelemetryConfig:
    """What FastAPI is told. Log records stay out: they go to stderr, with the trace in every line."""
    return {"auto_configure": True, "logs": False, "exclude": _is_probe}


@contextmanager
def solving(job_id: str, provider: TracerProvider | None = None) -> Iterator[None]:
    """A span over one solve; below the request's if that is still under way in this context.

    Args:
        job_id: of the job.
        provider: default: the process's, which does nothing unless it is configured.
    """
    tracer = trace.get_tracer("duocell", tracer_provider=provider)
    with tracer.start_as_current_span("solve", attributes={"duocell.job_id": job_id}):
        yield


def _is_probe(scope: MutableMapping[str, Any]) -> bool:
    """Probes come every few seconds and tell nothing."""
    return scope.get("path") in PROBES
