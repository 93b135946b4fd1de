"""Logs: one object a line, the request's and the job's name in it, nothing secret."""

import io
import json
import logging
import re
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.http.keys import hash_line, new_key
from duocell.service.observability import logs
from duocell.service.settings import Logging

Make = Callable[..., TestClient]
KEY = new_key()


class Log:
    """Where lines go, read back."""

    def __init__(self, stream: io.StringIO) -> None:
        self._stream = stream

    @property
    def text(self) -> str:
        return self._stream.getvalue()

    def lines(self, event: str = "") -> list[dict[str, Any]]:
        found = [json.loads(line) for line in self.text.splitlines()]
        return [line for line in found if not event or line["event"] == event]


@pytest.fixture
def written(monkeypatch: pytest.MonkeyPatch) -> Iterator[Callable[..., Log]]:
    """Configures logging as a server does, into memory; everything is put back afterwards."""
    names = ("", *logs.OURS, logs.NEVER)
    before = {name: (logging.getLogger(name).level, logging.getLogger(name).disabled) for name in names}
    handlers = logging.getLogger().handlers

    def configure(**settings: Any) -> Log:
        stream = io.StringIO()
        monkeypatch.setattr("sys.stderr", stream)
        logs.configure(Logging(**settings))
        return Log(stream)

    yield configure
    logging.getLogger().handlers = handlers
    for name, (level, disabled) in before.items():
        logging.getLogger(name).setLevel(level)
        logging.getLogger(name).disabled = disabled


def test_a_request_is_a_line_with_what_one_looks_for(
    written: Callable[..., Log], client_with: Make, example: dict[str, Any]
) -> None:
    log = written()
    client = client_with(api_keys=hash_line("press", KEY))
    sent = {"X-API-Key": KEY, "X-Request-ID": "order-4711.a_B"}
    created = client.post("/v1/layouts", json=example, headers=sent)
    client.get(created.headers["location"], headers={"X-API-Key": KEY})
    first, second = log.lines("request")
    assert first["request_id"] == created.headers["x-request-id"] == "order-4711.a_B"
    facts = {"method": "POST", "route": "/v1/layouts", "status": 202, "key": "press", "level": "info"}
    assert {name: first[name] for name in facts} == facts
    assert first["job_id"] == second["job_id"] == created.json()["id"]
    assert second["route"] == "/v1/layouts/{layout_id}"
    assert 0.0 < first["duration_ms"] < 10_000.0
    assert re.fullmatch(r"\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d+Z", first["timestamp"])


def test_the_lines_of_a_job_name_it_and_no_request(
    written: Callable[..., Log], client: TestClient, fake: Any, example: dict[str, Any]
) -> None:
    """Whatever made room for a job, another job or a request, is not to be found in its lines."""
    log = written()
    fake.error = ZeroDivisionError("nobody thought of this")
    ids = [client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).json()["id"] for _ in range(3)]
    ended = log.lines("job ended")
    assert [line["job_id"] for line in ended] == ids
    assert {line["status"] for line in ended} == {"failed"}
    broken = [line for line in log.lines() if "ZeroDivisionError" in line.get("exception", "")]
    assert [line["job_id"] for line in broken] == ids
    assert not [line for line in ended + broken if "request_id" in line]


@pytest.mark.parametrize("given", ["", "a b", "x" * 65, "\u00e4", "a;b", '{"a": 1}'])
def test_a_request_without_a_usable_name_gets_one(client: TestClient, given: str) -> None:
    names = {client.get("/healthz", headers={b"X-Request-ID": given.encode()}).headers["x-request-id"] for _ in "ab"}
    assert len(names) == 2
    assert all(re.fullmatch(r"[0-9a-f]{32}", name) for name in names)


def test_no_secret_and_no_layout_is_logged(
    written: Callable[..., Log], client_with: Make, example: dict[str, Any]
) -> None:
    log = written(log_level="debug")
    client = client_with(api_keys=hash_line("press", KEY))
    example["name"] = "a confidential cell"
    for headers in ({"X-API-Key": KEY}, {"Authorization": f"Bearer {KEY}"}, {"Authorization": f"Basic {KEY}"}):
        client.post(f"/v1/layouts?api_key={KEY}", json=example, headers=headers)
        client.post("/v1/layouts", content=f'{{"name": "{KEY}"}}', headers=headers)
        client.get("/v1/layouts", headers=headers | {"Cookie": KEY})
    assert len(log.lines("request")) == 9
    assert KEY not in log.text
    assert "confidential" not in log.text


def test_what_nobody_expected_is_logged_with_its_trace_and_without_the_values(
    written: Callable[..., Log], client_with: Make
) -> None:
    log = written()
    client = client_with()

    def broken() -> None:
        password = "pass" + "word of the gateway"
        raise RuntimeError(f"broken after {len(password)} letters")

    client.app.get("/broken")(broken)  # type: ignore[attr-defined]
    answer = client.get("/broken")
    assert answer.status_code == 500
    (error,) = log.lines("unexpected error")
    assert error["level"] == "error"
    assert error["request_id"] == answer.headers["x-request-id"]
    assert "RuntimeError: broken after 23 letters" in error["exception"]
    assert "password of the gateway" not in log.text
    (line,) = log.lines("request")
    assert (line["status"], line["level"], line["route"]) == (500, "warning", "/broken")


def test_probes_are_logged_at_debug_only(written: Callable[..., Log], client: TestClient) -> None:
    log = written()
    for path in ("/healthz", "/readyz", "/metrics"):
        client.get(path)
    assert log.lines("request") == []
    log = written(log_level="debug")
    client.get("/healthz")
    assert len(log.lines("request")) == 1


def test_unknown_addresses_are_cut_and_have_no_route(written: Callable[..., Log], client: TestClient) -> None:
    log = written()
    client.get("/" + "x" * 3000)
    (line,) = log.lines("request")
    assert line["route"] == ""
    assert len(line["path"]) == 200


def test_what_is_bound_stands_in_every_line_inside_and_in_none_outside(written: Callable[..., Log]) -> None:
    log = written()
    logger = logging.getLogger("duocell.service.jobs.jobs")
    with logs.about(job_id="5f0c"):
        logger.warning("the pool of workers broke (%s)", "why")
        with logs.about(start="3"):
            logger.info("solving")
    logger.info("done")
    first, second, third = log.lines()
    assert first["event"] == "the pool of workers broke (why)"
    assert (first["job_id"], second["job_id"], second["start"]) == ("5f0c", "5f0c", "3")
    assert "job_id" not in third


def test_levels_and_other_libraries(written: Callable[..., Log], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(logging.getLogger("uvicorn"), "propagate", False)  # as uvicorn's own configuration leaves it
    monkeypatch.setattr(logging.getLogger("uvicorn.error"), "level", logging.ERROR)
    log = written(log_level="warning")
    for name in ("duocell.service.x", "duocell.optimizer.x", "uvicorn.error", "ssik", "alembic"):
        logging.getLogger(name).info("said at info by %s", name)
        logging.getLogger(name).warning("said at warning by %s", name)
    assert len(log.lines()) == 5
    log = written(log_level="info")
    for name in ("duocell.service.x", "duocell.optimizer.x", "uvicorn.error", "ssik", "alembic"):
        logging.getLogger(name).info("said at info by %s", name)
    assert [line["logger"] for line in log.lines()] == ["duocell.service.x", "duocell.optimizer.x", "uvicorn.error"]
    logging.getLogger("uvicorn.access").info('"GET /v1/layouts?api_key=..."')
    assert "api_key" not in log.text


def test_the_console_shows_columns_and_no_control_characters(written: Callable[..., Log]) -> None:
    log = written(log_format="console")
    try:
        secret = "value of a " + "variable"
        raise ValueError(f"not {len(secret)}")
    except ValueError:
        logging.getLogger("duocell.service.x").exception("broken", extra={"path": "/a\x1b[2J\nforged"})
    assert "\x1b" not in log.text
    assert "\nforged" not in log.text
    assert "ValueError: not 19" in log.text
    assert "value of a variable" not in log.text


def test_auto_means_json_unless_a_person_looks(written: Callable[..., Log], monkeypatch: pytest.MonkeyPatch) -> None:
    log = written()
    logging.getLogger("duocell.service.x").warning("said")
    assert log.lines("said")

    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    terminal = Terminal()
    monkeypatch.setattr("sys.stderr", terminal)
    logs.configure(Logging())
    logging.getLogger("duocell.service.x").warning("said")
    assert not terminal.getvalue().startswith("{")
    assert "said" in terminal.getvalue()
