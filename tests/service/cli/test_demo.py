"""The demonstration runs as a user runs it: a server process, requests over HTTP, files in build/demo/."""

import json
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from duocell.service.cli import demo

EXAMPLE = Path(__file__).parents[3] / "examples" / "line.json"

pytestmark = pytest.mark.timeout(110)


@pytest.fixture
def somewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_the_demo_prints_placements_and_leaves_nothing_running(
    somewhere: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert demo.main([str(EXAMPLE)]) == 0
    printed = capsys.readouterr().out
    resource = json.loads((somewhere / "build/demo/layout.json").read_text())
    assert [arm["name"] for arm in resource["result"]["arms"]] == ["main", "follower"]
    for arm in resource["result"]["arms"]:
        assert f"{1000.0 * arm['base']['position'][0]:.1f}" in printed
    assert (somewhere / "build/demo/layout.svg").read_text().startswith("<?xml")
    assert "Where to look next" in printed
    port = int(printed.split("http://127.0.0.1:")[1].split(";")[0])
    with socket.socket() as probe:
        assert probe.connect_ex(("127.0.0.1", port)) != 0


def test_a_refused_request_is_reported_with_the_answer(somewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (somewhere / "bad.json").write_text('{"task": {}, "arms": []}')
    assert demo.main(["bad.json"]) == 1
    printed = capsys.readouterr().out
    assert "demo failed" in printed
    assert "/task" in printed


def test_a_missing_request_is_reported(somewhere: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert demo.main(["nowhere.json"]) == 1
    assert "nowhere.json" in capsys.readouterr().out


def test_a_server_that_ends_is_reported_with_its_last_words(tmp_path: Path) -> None:
    log = tmp_path / "log"
    log.write_text("the port is taken")
    server = subprocess.Popen([sys.executable, "-c", "raise SystemExit(3)"])
    server.wait()
    with pytest.raises(demo.DemoFailed, match=r"code 3:\nthe port is taken"):
        demo.wait_until_ready(f"http://127.0.0.1:{demo.free_port()}", server, log)
