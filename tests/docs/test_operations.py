"""docs/operations.md and compose.yaml say what there is: settings, metrics, commands."""

import io
import json
import logging
import re
import shlex
from pathlib import Path
from typing import Any

import pytest
import yaml
from fastapi.testclient import TestClient

from duocell.service.app import create_app
from duocell.service.cli.main import parser
from duocell.service.cli.serve import MAX_HEAD
from duocell.service.http.keys import hash_line, new_key
from duocell.service.http.middleware.observe import CLIENT_LEFT
from duocell.service.observability import logs, metrics
from duocell.service.settings import Settings
from tests.support.markdown import blocks_of

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "operations.md"
BLOCKS = blocks_of(PAGE)
ROWS = dict(re.findall(r"^\| `DUOCELL_(\w+)` \| ([^|]*) \|", PAGE.read_text(), re.M))
COMMANDS = [line for block in BLOCKS if block.kind == "sh" for line in block.commands]
COMPOSE: dict[str, Any] = yaml.safe_load((ROOT / "compose.yaml").read_text())


def shown(value: Any) -> str:
    """A default as the table writes it."""
    if value in (None, "", ()):
        return "none"
    return str(value).lower() if isinstance(value, bool) else f"{value:g}" if isinstance(value, float) else str(value)


def test_every_setting_is_documented_with_its_default() -> None:
    defaults = {name.upper(): shown(field.default) for name, field in Settings.model_fields.items()}
    defaults["WORKERS"] = "one per core"
    assert defaults == ROWS


def test_every_metric_is_documented_with_its_labels() -> None:
    TestClient(create_app()).get("/openapi.json")  # so that there are samples
    metrics.job_finished("optimal", 0.1)
    metrics.worker_died(-9)
    documented = dict(re.findall(r"^\| `(duocell_\w+)` \|([^|]*)\|", PAGE.read_text(), re.M))
    registered = {}
    for family in metrics.REGISTRY.collect():
        if family.name.startswith("duocell_"):
            total = {"counter": "_total", "info": "_info"}.get(family.type, "")
            registered[family.name + total] = family
    assert set(documented) == set(registered)
    for name, family in registered.items():
        labels = {label for sample in family.samples for label in sample.labels if label != "le"}
        assert ", ".join(sorted(labels)) == ", ".join(sorted(re.findall(r"\w+", documented[name]))), name


def test_the_line_of_the_log_has_the_names_of_a_real_one() -> None:
    (block,) = [block for block in BLOCKS if block.kind == "json log"]
    key, stream = new_key(), io.StringIO()
    handler = logging.StreamHandler(stream)
    handler.setFormatter(logs.formatter(json=True))
    access = logging.getLogger("service.access")
    before = access.level
    access.addHandler(handler)
    access.setLevel(logging.INFO)
    TestClient(create_app(Settings(api_keys=hash_line("press-shop", key)))).get("/docs", headers={"X-API-Key": key})
    access.removeHandler(handler)
    access.setLevel(before)
    shown, real = json.loads(block.text), json.loads(stream.getvalue())
    assert list(shown) == [*real, "job_id"]  # the page asked for is no job
    assert {name: type(value) for name, value in shown.items() if name in real} == {
        name: type(value) for name, value in real.items()
    }


def test_numbers_are_those_of_the_program() -> None:
    text = PAGE.read_text()
    assert f"may have {MAX_HEAD // 1000} kB" in text
    assert f"`status` {CLIENT_LEFT}:" in text


@pytest.mark.parametrize("command", COMMANDS)
def test_commands_are_understood(command: str) -> None:
    words = shlex.split(command.split(" >> ")[0])
    while "=" in words[0]:
        name = words.pop(0).split("=")[0]
        assert name.startswith("OTEL_") or name.removeprefix("DUOCELL_").lower() in Settings.model_fields
    if words[0] == "duocell":
        parser().parse_args(words[1:])
    elif words[:3] == ["docker", "compose", "run"]:
        service = next(word for word in words[3:] if not word.startswith("-"))
        assert service in COMPOSE["services"]
        parser().parse_args(words[words.index(service) + 1 :])
    else:
        assert words[0] == "echo" or words[:3] in (["docker", "compose", "up"], ["docker", "compose", "logs"])


def test_the_job_for_prometheus_asks_where_the_metrics_are() -> None:
    (block,) = [block for block in BLOCKS if block.kind == "yaml prometheus"]
    (job,) = yaml.safe_load(block.text)["scrape_configs"]
    assert job.get("metrics_path", "/metrics") == "/metrics"
    assert job["static_configs"][0]["targets"] == [f"localhost:{Settings.model_fields['port'].default}"]


def test_every_block_is_checked_by_a_test() -> None:
    assert {block.kind for block in BLOCKS} == {"sh", "json log", "yaml prometheus"}


# --- compose.yaml -----------------------------------------------------------------------------------------------------


def test_compose_sets_what_there_is_and_runs_what_there_is() -> None:
    for name in ("duocell", "migrate"):
        service = COMPOSE["services"][name]
        for variable in service["environment"]:
            assert variable.removeprefix("DUOCELL_").lower() in Settings.model_fields, variable
        parser().parse_args(service.get("command", ["serve", "--host", "0.0.0.0"]))


def test_compose_is_sound() -> None:
    services = COMPOSE["services"]
    assert set(services) == {"duocell", "migrate", "database"}
    for service in services.values():
        for other, condition in service.get("depends_on", {}).items():
            assert other in services
            if condition["condition"] == "service_healthy":
                assert "healthcheck" in services[other]
            else:
                assert "restart" not in services[other]  # it has to end
        for volume in service.get("volumes", []):
            assert volume.split(":")[0] in COMPOSE["volumes"]
    dockerfile = (ROOT / "Dockerfile").read_text()
    (port,) = services["duocell"]["ports"]
    assert f"DUOCELL_PORT={port.split(':')[2]}" in dockerfile
    assert port.startswith("127.0.0.1:")
    assert f"DUOCELL_DATA_DIR={services['duocell']['volumes'][0].split(':')[1]}" in dockerfile


def test_compose_knows_one_password_and_has_none() -> None:
    text = (ROOT / "compose.yaml").read_text()
    used = re.findall(r"POSTGRES_PASSWORD:\?|:([^:@\s$]+)@", text)
    assert used == ["", ""]
