"""What docs/robots.md shows is true: its commands are carried out in order, its answers compared."""

from __future__ import annotations

import copy
import json
import re
import shlex
from argparse import ArgumentParser
from pathlib import Path
from typing import Any

import httpx2
import pytest

from duocell.service.schemas.request import EXAMPLE
from duocell.service.settings import Settings
from tests.support.given import own_robot
from tests.support.markdown import assert_shown, blocks_of

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "docs" / "robots.md"
BLOCKS = blocks_of(PAGE)
LOCAL = f"http://localhost:{Settings.model_fields['port'].default}"


@pytest.fixture
def files(tmp_path: Path) -> Path:
    """What the commands of the page send."""
    (tmp_path / "my_arm.urdf").write_text(own_robot.urdf())
    (tmp_path / "meshes.zip").write_bytes(own_robot.zipped(own_robot.meshes()))
    (tmp_path / "fixture.stl").write_bytes(own_robot.as_stl(own_robot.fork()))
    return tmp_path


def curl(command: str, url: str, folder: Path) -> httpx2.Response:
    """What ``curl`` would do, for the options that the page uses; a server elsewhere is asked."""
    options = ArgumentParser("curl")
    options.add_argument("-s", action="store_true")
    options.add_argument("-F", dest="parts", action="append", default=[])
    options.add_argument("-X", dest="method", default="POST")
    options.add_argument("url")
    asked = options.parse_args(shlex.split(command)[1:])
    assert asked.url.startswith(LOCAL), "the default port of the server"
    parts: dict[str, Any] = {}
    for part in asked.parts:
        name, _, value = part.partition("=")
        path = folder / value.removeprefix("@")
        parts[name] = (path.name, path.read_bytes()) if value.startswith("@") else (None, value)
    return httpx2.request(asked.method, asked.url.replace(LOCAL, url), files=parts or None, timeout=120.0)


def one(kind: str) -> Any:
    (block,) = [block for block in BLOCKS if block.kind == kind]
    return json.loads(block.text)


def commands(word: str) -> list[str]:
    lines = [line for block in BLOCKS if block.kind == "sh" for line in block.commands if line.startswith("curl ")]
    return [line for line in lines if word in line]


def test_every_block_is_checked() -> None:
    assert {block.kind for block in BLOCKS} == {"sh", "json robot", "json arm", "json mesh", "json obstacle"}
    others = [line for block in BLOCKS for line in block.commands if block.kind == "sh" and line.split()[0] != "curl"]
    assert others == ["(cd my_arm_description && zip -qr ../meshes.zip meshes)"]


def test_the_commands_do_what_is_shown(server: str, files: Path) -> None:
    (create, delete), (mesh,) = commands("/v1/robots"), commands("/v1/meshes")
    brought = curl(create, server, files)
    assert brought.status_code == 201, brought.text
    robot = brought.json()
    assert httpx2.get(server + brought.headers["location"]).json() == robot
    assert_shown(one("json robot"), robot, set())

    solid = curl(mesh, server, files)
    assert solid.status_code == 201, solid.text
    assert_shown(one("json mesh"), solid.json(), set())

    request = copy.deepcopy(EXAMPLE) | {"certificate": None, "obstacles": [one("json obstacle")]}
    request["arms"] = [request["arms"][0] | {"reference": None} | one("json arm")]
    answer = httpx2.post(f"{server}/v1/layouts", json=request, headers={"Prefer": "wait=60"}, timeout=90.0).json()
    assert answer["status"] == "succeeded", answer
    assert answer["result"]["arms"][0]["geometry"] == "mesh"
    assert answer["request"]["arms"][0]["robot_version"] == robot["version"]

    assert curl(delete, server, files).status_code == 204
    assert httpx2.get(server + brought.headers["location"]).status_code == 404


def test_the_limits_are_the_settings() -> None:
    rows = re.findall(r"^\| .* \| ([\d,]+).* \| `DUOCELL_(\w+)` \|$", PAGE.read_text(), re.M)
    assert len(rows) == 8
    for value, name in rows:
        assert float(value.replace(",", "")) == Settings.model_fields[name.lower()].default, name


def test_links_lead_somewhere() -> None:
    for target in re.findall(r"\]\(([^)\s]+)\)", PAGE.read_text()):
        assert (PAGE.parent / target.partition("#")[0]).exists(), target
