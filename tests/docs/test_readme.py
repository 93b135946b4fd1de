"""What README.md and docs/*.md show is true: every block is run, or checked against what the program does."""

import copy
import json
import re
import shlex
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import httpx2
import pytest

from duocell.models.catalogue import catalogue
from duocell.models.kinematics.closed_form import closed_form
from duocell.optimizer.optimize import optimize
from duocell.service.cli.main import main, parser
from duocell.service.requests.accept import accept, accept_evaluation
from duocell.service.requests.convert import cell_of, settings_of
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.settings import Settings
from duocell.service.validation import validate
from duocell.service.workers.solving import evaluate_request
from tests.support.markdown import Block, assert_shown, blocks_of, tokens

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
PAGES = [README, *(ROOT / "docs" / f"{name}.md" for name in ("request", "result", "method", "container"))]
BLOCKS = [block for page in PAGES for block in blocks_of(page)]
LINE = ROOT / "examples" / "line.json"

COMMANDS = ("make", "curl", "docker", "echo", ".venv/bin/duocell", 'PATH="$PWD/.venv/bin:$PATH"')
UNSTABLE = {
    "id", "created_at", "started_at", "finished_at", "search", "version", "request_hash", "boxes", "wall_time", "gap",
}  # fmt: skip
LOCAL = f"http://localhost:{Settings.model_fields['port'].default}"


def of_kind(*kinds: str) -> list[Block]:
    return [block for block in BLOCKS if block.kind in kinds]


def commands(program: str) -> list[str]:
    return [line for block in of_kind("sh") for line in block.commands if line.split()[0] == program]


def solved(request: dict[str, Any]) -> Any:
    checked = validate(LayoutRequest, request)
    return optimize(cell_of(checked), settings_of(checked, 60.0))


def with_conditioning(least: float | None) -> dict[str, Any]:
    request = json.loads(LINE.read_text())
    for arm in request["arms"]:
        arm["min_conditioning"] = least
    return dict(request)


@pytest.fixture
def workplace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder in which the examples can be read and results written."""
    (tmp_path / "examples").symlink_to(ROOT / "examples")
    monkeypatch.chdir(tmp_path)
    return tmp_path


# --- what the pages consist of ----------------------------------------------------------------------------------------


def test_every_block_is_checked_by_a_test() -> None:
    checked = {"sh", "python", "text output", "json answer", "json certificate", "json evaluation", "json clearances"}
    checked |= {"python client", "python client loop", "python interface", "text interface", *SMALLER}
    assert [str(block) for block in BLOCKS if block.kind not in checked] == []
    assert len(BLOCKS) > 25


def test_every_command_is_checked_by_a_test() -> None:
    unknown = [line for block in of_kind("sh") for line in block.commands if line.split()[0] not in COMMANDS]
    assert unknown == []


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", page.read_text()):
        path, _, anchor = target.partition("#")
        assert "://" not in path, "the pages need no internet"
        linked = page.parent / path if path else page
        assert linked.exists(), target
        if anchor:
            headings = re.findall(r"^#+ (.*)$", linked.read_text(), re.M)
            assert anchor in {re.sub(r"[^\w\s-]", "", heading).lower().replace(" ", "-") for heading in headings}, (
                target
            )


# --- commands ---------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("command", sorted(set(commands("make"))))
def test_make_knows_the_target(command: str) -> None:
    run = subprocess.run([*shlex.split(command), "--dry-run"], cwd=ROOT, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stderr
    assert "duocell.service.cli.demo" in run.stdout or "pytest" in run.stdout or "duocell serve" in run.stdout


def test_commands_print_what_is_shown(workplace: Path, capsys: pytest.CaptureFixture[str]) -> None:
    compared = 0
    for block, following in pairwise([*blocks_of(README), Block("", 0, "", "")]):
        lines = [line for line in block.commands if line.startswith(".venv/bin/duocell ")] if block.kind == "sh" else []
        for line in lines:
            assert main(shlex.split(line)[1:]) == 0, line
        printed = capsys.readouterr().out
        if lines and following.kind == "text output":
            shown, real = (tokens(re.sub(r"[\d.]+ s$", "0 s", text, flags=re.M)) for text in (following.text, printed))
            words = [token for token in shown if isinstance(token, str)]
            assert words == [token for token in real if isinstance(token, str)]
            numbers = [token for token in shown if isinstance(token, float)]
            assert [token for token in real if isinstance(token, float)] == pytest.approx(numbers, rel=1e-4, abs=0.11)
            compared += 1
    assert compared == 1
    assert (workplace / "line.svg").exists()


@pytest.mark.parametrize("command", sorted({line for line in commands("docker") if line.startswith("docker run")}))
def test_the_image_understands_the_command(command: str) -> None:
    dockerfile = (ROOT / "Dockerfile").read_text()
    words = shlex.split(command.replace('"$PWD"', "here"))
    at = words.index("duocell")  # the image; its entry point is the command line
    assert 'ENTRYPOINT ["duocell"]' in dockerfile
    parser().parse_args(words[at + 1 :] or ["serve"])
    for option, value in pairwise(words[:at]):
        if option == "--publish":
            assert f"DUOCELL_PORT={value.split(':')[1]}" in dockerfile
        if option == "--env":
            assert value.split("=")[0].removeprefix("DUOCELL_").lower() in Settings.model_fields
        if option in ("--volume", "--tmpfs") and "/var" in value:
            assert "/var/lib/duocell" in dockerfile


# --- requests over HTTP -----------------------------------------------------------------------------------------------


def perform(command: str, url: str) -> httpx2.Response:
    """What ``curl`` would do, for the options that the pages use; a server elsewhere is asked."""
    curl = ArgumentParser("curl")
    curl.add_argument("-s", action="store_true")
    curl.add_argument("-H", dest="headers", action="append", default=[])
    curl.add_argument("-d", dest="data")
    curl.add_argument("url")
    asked = curl.parse_args(shlex.split(command)[1:])
    assert asked.url.startswith(LOCAL), "the default port of the server"
    headers = dict(header.split(": ", 1) for header in asked.headers)
    body = (ROOT / asked.data.removeprefix("@")).read_bytes()
    return httpx2.post(asked.url.replace(LOCAL, url), content=body, headers=headers, timeout=60.0)


def test_the_first_request_is_answered_as_shown(server: str) -> None:
    (command,) = commands("curl")
    (shown,) = of_kind("json answer")
    answer = perform(command, server)
    assert answer.status_code == 200
    assert_shown(json.loads(shown.text), answer.json(), UNSTABLE)
    again = answer.json()["request"]
    repeated = httpx2.post(f"{server}/v1/layouts", json=again, headers={"Prefer": "wait=60"}, timeout=60.0).json()
    assert repeated["result"]["request_hash"] == answer.json()["result"]["request_hash"]
    assert repeated["result"]["arms"] == answer.json()["result"]["arms"]


@pytest.mark.parametrize("block", of_kind("python"), ids=str)
def test_python_runs(block: Block, server: str, tmp_path: Path) -> None:
    assert LOCAL in block.text
    script = tmp_path / "script.py"
    script.write_text(block.text.replace(LOCAL, server))
    run = subprocess.run([sys.executable, script], capture_output=True, text=True, check=False, timeout=100)
    assert run.returncode == 0, run.stderr
    assert re.fullmatch(r"main -?\d+ -?\d+ 0 mm \{'shoulder': .*\}\n", run.stdout)


# --- requests and parts of them ---------------------------------------------------------------------------------------


def _request(whole: dict[str, Any], part: Any) -> None:
    whole.clear()
    whole.update(part)


def _arm(whole: dict[str, Any], part: Any) -> None:
    if "robot" in part:
        whole["arms"][0].pop("reference")  # it belongs to the robot of the example
    whole["arms"][0].update(part)


SMALLER: dict[str, Callable[[Any, Any], Any]] = {
    "json request": _request,
    "json task": lambda whole, part: whole.update(task=part),
    "json tasks": lambda whole, part: whole.update(task=None, tasks=part),
    "json arm": _arm,
    "json pose": lambda whole, part: whole["arms"][0].update(grasp=part),
    "json objective": lambda whole, part: whole.update(part),
}


@pytest.mark.parametrize("block", of_kind(*SMALLER), ids=str)
def test_json_is_accepted(block: Block) -> None:
    whole = copy.deepcopy(EXAMPLE)
    SMALLER[block.kind](whole, json.loads(block.text))
    accept(json.dumps(whole).encode(), Settings())


def test_the_evaluation_is_answered_with_the_clearances_that_are_shown() -> None:
    (asked,) = of_kind("json evaluation")
    (shown,) = of_kind("json clearances")
    accepted = accept_evaluation(asked.text.encode(), Settings())
    result = evaluate_request(accepted.text, accepted.request_hash)
    assert result["outcome"] == "feasible"
    assert_shown(json.loads(shown.text), result["clearances"], set())


@pytest.mark.parametrize("block", of_kind("json request"), ids=str)
def test_whole_requests_are_solved(block: Block) -> None:
    layout = solved(json.loads(block.text))
    assert layout.usable
    assert layout.search.ended


def test_defaults_are_the_defaults() -> None:
    block = next(block for block in of_kind("json request") if block.file == "request.md")  # the first shows it all
    shown = json.loads(block.text)
    bare = {"task": shown["task"], "arms": [{key: shown["arms"][0][key] for key in ("name", "robot", "grasp", "base")}]}
    filled = json.loads(accept(json.dumps(bare).encode(), Settings()).text)
    assert set(shown) == set(filled)
    assert set(shown["arms"][0]) == set(filled["arms"][0])
    assert_shown(shown, filled, set())


def test_the_beam_of_the_readme_is_the_example() -> None:
    (block,) = [block for block in of_kind("json request") if block.file == "README.md"]
    shown, example = json.loads(block.text), json.loads((ROOT / "examples" / "beam_ur10e.json").read_text())
    assert all(pose in example["task"]["poses"] for pose in shown["task"]["poses"])
    assert [shown["task"]["poses"][0], shown["task"]["poses"][-1]] == [
        example["task"]["poses"][0],
        example["task"]["poses"][-1],
    ]
    assert shown | {"task": None} == example | {"task": None}


def test_the_limits_are_the_settings() -> None:
    rows = re.findall(r"^\| .*\| ([\d,]+)?.* \| `DUOCELL_(\w+)` \|$", (ROOT / "docs" / "request.md").read_text(), re.M)
    assert len(rows) == 18
    for value, name in rows:
        field = Settings.model_fields[name.lower()]
        assert not value or float(value.replace(",", "")) == field.default, name


# --- numbers ----------------------------------------------------------------------------------------------------------


def test_the_figure_shows_the_answer() -> None:
    (shown,) = of_kind("json answer")
    drawn = (ROOT / "docs" / "images" / "line.svg").read_text()
    for arm in json.loads(shown.text)["result"]["arms"]:
        x, y, z = arm["base"]["position"]
        assert f"x {x:.3f}  y {y:.3f}  z {z:.3f} m" in drawn


def test_the_catalogue_is_as_large_as_said() -> None:
    names = catalogue.names()
    assert f"{len(names)} robots are built in" in README.read_text()
    closed = sum(closed_form(catalogue.robot(name)) is not None for name in names)
    assert f"({closed} robots of the catalogue)" in (ROOT / "docs" / "method.md").read_text()


ROWS = re.findall(
    r"^\| (null|0\.\d+)[^|]* \| ([\d.]+) \| ([\d.]+)° \|$", (ROOT / "docs" / "result.md").read_text(), re.M
)


@pytest.mark.parametrize(("least", "objective", "margin"), ROWS)
def test_conditioning_costs_what_is_said(least: str, objective: str, margin: str) -> None:
    assert len(ROWS) == 3
    layout = solved(with_conditioning(None if least == "null" else float(least)))
    assert layout.objective == pytest.approx(float(objective), rel=3e-3)
    smallest = min(placement.minimum_margin for placement in layout.placements)
    assert smallest * 57.29578 == pytest.approx(float(margin), abs=1.0)  # the optimum is flat there


def test_the_certificate_says_what_is_shown() -> None:
    (block,) = of_kind("json certificate")
    request = json.loads(LINE.read_text()) | {"certificate": {"gap": 0.01, "time_limit": 60.0}}
    layout = solved(request)
    shown, proof = json.loads(block.text), layout.certificate
    assert layout.proved
    assert proof is not None
    assert proof.proved is shown["proved"]
    # Another machine may stop at another box; the bound is within the gap all the same.
    for claim, found in ((shown, proof), *zip(shown["arms"], proof.arms, strict=True)):
        assert found.lower_bound == pytest.approx(claim["lower_bound"], rel=0.01)
        assert found.gap <= 0.01
        assert claim["gap"] <= 0.01
