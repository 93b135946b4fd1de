"""OpenTelemetry: nothing unless asked for; spans and durations if asked, in memory and over the wire."""

import os
import subprocess
import sys
import threading
from http.server import BaseHTTPRequestHandler, HTTPServer
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi.telemetry import TelemetryConfig
from fastapi.testclient import TestClient
from opentelemetry.proto.collector.trace.v1.trace_service_pb2 import ExportTraceServiceRequest
from opentelemetry.sdk.metrics import MeterProvider
from opentelemetry.sdk.metrics.export import InMemoryMetricReader
from opentelemetry.sdk.trace import TracerProvider
from opentelemetry.sdk.trace.export import SimpleSpanProcessor
from opentelemetry.sdk.trace.export.in_memory_span_exporter import InMemorySpanExporter

from duocell.service.app import create_app
from duocell.service.cli.demo import serving
from duocell.service.observability import telemetry
from duocell.service.settings import Settings

ROOT = Path(__file__).parents[3]
PARENT = "00-0af7651916cd43dd8448eb211c80319c-b7ad6b7169203331-01"


UNCONFIGURED = """
import sys
from fastapi.testclient import TestClient
from duocell.service.app import create_app
from duocell.service.settings import Settings

class Idle:
    start = lambda self: None
    alive = lambda self: 1
    async def stop(self): pass
    async def self_test(self): pass

with TestClient(create_app(Settings(data_dir=sys.argv[1]), Idle())) as client:
    assert client.get('/v1/layouts').status_code == 200
print([name for name in sys.modules if name.startswith(('opentelemetry.sdk', 'opentelemetry.exporter'))])
"""


def test_without_configuration_nothing_of_the_sdk_is_loaded(tmp_path: Path) -> None:
    environment = {name: value for name, value in os.environ.items() if not name.startswith("OTEL_")}
    command = [sys.executable, "-c", UNCONFIGURED, str(tmp_path)]
    run = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, check=False)
    assert run.stdout.strip() == "[]", run.stderr


def test_requests_are_spans_and_durations(fake: Any, example: dict[str, Any], tmp_path: Path) -> None:
    spans, reader = InMemorySpanExporter(), InMemoryMetricReader()
    tracer = TracerProvider(shutdown_on_exit=False)
    tracer.add_span_processor(SimpleSpanProcessor(spans))
    meter = MeterProvider(metric_readers=[reader], shutdown_on_exit=False)
    providers: TelemetryConfig = {"tracer_provider": tracer, "meter_provider": meter}
    with TestClient(create_app(Settings(data_dir=tmp_path), fake, traces=providers)) as client:
        client.post("/v1/layouts", json=example, headers={"traceparent": PARENT})
        client.get("/v1/layouts/none")
        client.get("/healthz")
        client.get("/metrics")
    servers = [span for span in spans.get_finished_spans() if span.kind.name == "SERVER"]
    assert [span.name for span in servers] == ["POST /v1/layouts", "GET /v1/layouts/{layout_id}"]
    assert f"{servers[0].context.trace_id:032x}" == PARENT.split("-")[1]
    assert servers[0].attributes is not None
    assert servers[0].attributes["http.response.status_code"] == 202
    measured = {
        metric.name: metric
        for resource in reader.get_metrics_data().resource_metrics  # type: ignore[union-attr]
        for scope in resource.scope_metrics
        for metric in scope.metrics
    }
    points = measured["http.server.request.duration"].data.data_points
    routes = {(point.attributes or {}).get("http.route") for point in points}
    assert len(points) == 2
    assert routes == {"/v1/layouts", "/v1/layouts/{layout_id}"}
    tracer.shutdown()
    meter.shutdown()


def test_a_solve_is_a_span_below_the_one_around_it() -> None:
    spans = InMemorySpanExporter()
    provider = TracerProvider(shutdown_on_exit=False)
    provider.add_span_processor(SimpleSpanProcessor(spans))
    with provider.get_tracer("test").start_as_current_span("request"), telemetry.solving("5f0c", provider):
        pass
    with telemetry.solving("6a1d"):  # without a provider: nothing
        pass
    inner, outer = spans.get_finished_spans()
    assert inner.name == "solve"
    assert inner.attributes == {"duocell.job_id": "5f0c"}
    assert inner.parent is not None
    assert inner.parent.span_id == outer.context.span_id


class Collector(HTTPServer):
    """Takes in what is exported, as a collector would."""

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), Handler)
        self.bodies: list[tuple[str, bytes]] = []


class Handler(BaseHTTPRequestHandler):
    server: Collector

    def do_POST(self) -> None:
        body = self.rfile.read(int(self.headers["content-length"]))
        assert self.headers.get("content-encoding") is None
        self.server.bodies.append((self.path, body))
        self.send_response(200)
        self.send_header("content-type", "application/x-protobuf")
        self.end_headers()

    def log_message(self, *_: Any) -> None:
        pass


def test_a_server_exports_what_the_environment_asks_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with Collector() as collector:
        threading.Thread(target=collector.serve_forever, daemon=True).start()
        monkeypatch.setenv("OTEL_EXPORTER_OTLP_ENDPOINT", f"http://127.0.0.1:{collector.server_port}")
        monkeypatch.setenv("OTEL_SERVICE_NAME", "planner")
        monkeypatch.setenv("DUOCELL_WORKERS", "1")
        log = tmp_path / "log"
        with serving(log) as url:
            assert httpx2.get(f"{url}/v1/layouts", headers={"traceparent": PARENT}).status_code == 200
        collector.shutdown()
    paths = {path for path, _ in collector.bodies}
    assert paths == {"/v1/traces", "/v1/metrics"}
    exported = [ExportTraceServiceRequest.FromString(body) for path, body in collector.bodies if path == "/v1/traces"]
    resources = [resource for export in exported for resource in export.resource_spans]
    named = {attribute.key: attribute.value.string_value for attribute in resources[0].resource.attributes}
    assert named["service.name"] == "planner"
    spans = [span for resource in resources for scope in resource.scope_spans for span in scope.spans]
    (server,) = [span for span in spans if span.name == "GET /v1/layouts"]
    assert server.trace_id.hex() == PARENT.split("-")[1]
    (line,) = [text for text in log.read_text().splitlines() if '"route": "/v1/layouts"' in text]
    assert f'"trace_id": "{server.trace_id.hex()}"' in line
