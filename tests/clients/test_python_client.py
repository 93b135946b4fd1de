"""A Python client, generated as the README says, for the whole life of a job."""

import importlib
import json
import os
import re
import shlex
import subprocess
import sys
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest

from tests.clients.fuzz import DOCUMENT, ROOT
from tests.support.guarded import Server
from tests.support.markdown import Block, blocks_of

PACKAGE = "duocell_client"
README = blocks_of(ROOT / "README.md")
(GENERATE,) = [line for block in README for line in block.commands if "openapi-python-client generate" in line]
(EXAMPLE,) = [block for block in README if block.kind == "python client"]
(LOOP,) = [block for block in README if block.kind == "python client loop"]


@pytest.fixture(scope="module")
def generated(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the generated project."""
    folder = tmp_path_factory.mktemp("python")
    path, program, *options = shlex.split(GENERATE)
    assert path == "PATH=$PWD/.venv/bin:$PATH"  # the generator calls ruff
    assert options[-2:] == ["--path", "docs/openapi.json"]
    programs = Path(sys.executable).parent
    environment = os.environ | {"PATH": f"{programs}:{os.environ['PATH']}"}
    command = [str(programs / program), *options[:-1], str(DOCUMENT)]
    made = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert made.returncode == 0, made.stdout + made.stderr
    assert "warning" not in (made.stdout + made.stderr).lower()  # what it could not make anything of, or not tidy
    return folder / "duocell-client"


@pytest.fixture(scope="module")
def client(generated: Path, server: Server) -> Iterator[Any]:
    """A client of the server; its package can be imported as long as it is in use."""
    sys.path.insert(0, str(generated))
    package = importlib.import_module(PACKAGE)
    with package.AuthenticatedClient(base_url=server.url, token=server.key, raise_on_unexpected_status=True) as client:
        yield client
    sys.path.remove(str(generated))
    for name in [name for name in sys.modules if name.startswith(PACKAGE)]:
        del sys.modules[name]


def part(path: str) -> ModuleType:
    return importlib.import_module(f"{PACKAGE}.{path}")


@pytest.fixture
def request_(client: Any) -> Any:
    return part("models").LayoutRequest.from_dict(json.loads((ROOT / "examples" / "line.json").read_text()))


def test_the_life_of_a_job(client: Any, request_: Any) -> None:
    models = part("models")
    create, get, listing = (part(f"api.layouts.{name}") for name in ("create_layout", "get_layout", "list_layouts"))
    created = create.sync_detailed(client=client, body=request_)
    assert created.status_code == 202
    layout = created.parsed
    assert isinstance(layout, models.Layout)
    assert created.headers["location"].endswith(layout.id)
    assert isinstance(layout.request.arms[0].grasp.orientation, models.Matrix)  # unions come back as what they are
    deadline = time.monotonic() + 30.0
    while layout.status in ("queued", "running") and time.monotonic() < deadline:
        time.sleep(0.05)
        layout = get.sync(layout.id, client=client)
    assert layout.status == "succeeded"
    assert layout.error is None
    assert layout.result.outcome == "optimal"
    assert [arm.name for arm in layout.result.arms] == ["main", "follower"]
    assert len(layout.result.arms[0].joints) == 10
    assert layout.result.verification.max_position_error < 1e-6
    page = listing.sync(client=client, limit=1)
    assert [item.id for item in page.items] == [layout.id]
    unchanged = get.sync_detailed(layout.id, client=client, if_none_match=created.headers["etag"])
    assert unchanged.status_code == 200  # it has changed since it was queued
    unchanged = get.sync_detailed(layout.id, client=client, if_none_match=unchanged.headers["etag"])
    assert unchanged.status_code == 304


def test_waiting_for_the_answer(client: Any, request_: Any) -> None:
    answer = part("api.layouts.create_layout").sync_detailed(client=client, body=request_, prefer="wait=1")
    assert answer.status_code in (200, 202)  # the server grants 0.3 s
    assert answer.headers["preference-applied"] == "wait=0.3"


def test_errors_are_typed(client: Any, server: Server, request_: Any) -> None:
    problem_type = part("models").Problem
    create, get = part("api.layouts.create_layout"), part("api.layouts.get_layout")
    request_.arms[0].robot = "pumma560"
    refused = create.sync_detailed(client=client, body=request_)
    assert refused.status_code == 422
    assert isinstance(refused.parsed, problem_type)
    assert (refused.parsed.code, refused.parsed.status) == ("unknown-robot", 422)
    assert refused.parsed.errors[0].pointer == "/arms/0/robot"
    assert "puma560" in refused.parsed.errors[0].detail
    missing = get.sync("none", client=client)
    assert isinstance(missing, problem_type)
    assert missing.code == "layout-not-found"
    with part("client").Client(base_url=server.url) as nobody:
        unauthorized = get.sync("none", client=nobody)
    assert isinstance(unauthorized, problem_type)
    assert unauthorized.code == "unauthorized"


def test_robots_and_health(client: Any) -> None:
    robots = part("api.robots.list_robots").sync(client=client)
    assert "ur10e" in [robot.name for robot in robots.items]
    assert part("api.robots.get_robot").sync("ur10e", client=client).joints[0].lower < -6.0
    assert part("api.service.get_health").sync(client=client).status == "ok"
    assert part("api.service.get_readiness").sync(client=client).status == "ready"
    assert part("api.service.get_problem").sync("queue-full", client=client).status == 429


def test_the_client_compiles_without_warnings(generated: Path) -> None:
    command = [sys.executable, "-W", "error", "-m", "compileall", "-q", "-f", str(generated)]
    made = subprocess.run(command, capture_output=True, text=True, check=False)
    assert (made.returncode, made.stdout) == (0, "")


def run_block(block: Block, generated: Path, server: Server, tmp_path: Path) -> str:
    """What a block of the README writes when it talks to a server of the tests."""
    script = tmp_path / "script.py"
    local = 'Client(base_url="http://localhost:8000")'
    assert local in block.text
    text = block.text.replace("import Client", "import AuthenticatedClient")
    script.write_text(text.replace(local, f'AuthenticatedClient(base_url="{server.url}", token="{server.key}")'))
    command = [
        sys.executable,
        "-I",
        "-c",
        f"import runpy, sys; sys.path.insert(0, {str(generated)!r}); runpy.run_path({str(script)!r})",
    ]
    run = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False, timeout=60)
    assert run.returncode == 0, run.stderr
    return run.stdout


def test_the_example_of_the_readme_runs(generated: Path, server: Server, tmp_path: Path) -> None:
    assert run_block(EXAMPLE, generated, server, tmp_path) == "main 156 955 mm\nfollower 1606 -21 mm\n"


def test_many_layouts_are_sent_at_once_and_waited_for(generated: Path, server: Server, tmp_path: Path) -> None:
    fewer = replace(LOOP, text=LOOP.text.replace("range(50)", "range(4)"))
    written = run_block(fewer, generated, server, tmp_path)
    assert re.fullmatch(r"\d+ mm high \d+\.\d\n", written), written


def test_a_task_file_is_sent_and_read(client: Any) -> None:
    models, types = part("models"), part("types")
    with (ROOT / "examples" / "tasks" / "seam.csv").open("rb") as file:
        sent = types.File(payload=file, file_name="seam.csv")
        body = models.TaskUpload(file=sent, tolerance=0.005, angle_tolerance=0.2)  # this server takes few poses
        found = part("api.tasks.import_task").sync(client=client, body=body)
    assert isinstance(found, models.ImportedTask), found
    assert (found.understood.units, found.understood.rotation, found.understood.read) == ("mm", "rpy_deg", 41)
    assert len(found.task.poses) == found.understood.kept < 41
    assert found.task.poses[0].position == pytest.approx([0.7, 0.3, 0.12])
