"""`duocell solve` while it waits: what it shows, how it is stopped, and the same at a server."""

import json
import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import Future
from pathlib import Path
from typing import Any

import httpx2
import pytest
import uvicorn

from duocell.optimizer.monitoring.watch import Cancelled
from duocell.service.app import create_app
from duocell.service.cli import local as cli_local
from duocell.service.cli.main import main
from duocell.service.cli.progress import shown
from duocell.service.cli.remote import solve_there
from duocell.service.settings import Settings
from duocell.service.workers.executor import SolveFailed

Document = dict[str, Any]
COMMAND = [sys.executable, "-m", "duocell.service.cli.main"]
REPOSITORY = Path(__file__).parents[3]


class Running(uvicorn.Server):
    """A server in a thread of this process, on the fake executor."""

    def __init__(self, folder: Path, fake: Any) -> None:
        app = create_app(Settings(workers=1, data_dir=folder, drain=0.0), fake)
        super().__init__(uvicorn.Config(app, port=0, log_level="warning", timeout_graceful_shutdown=1))
        self._thread = threading.Thread(target=self.run)
        self._thread.start()
        while not self.started:
            assert self._thread.is_alive()
            time.sleep(0.01)
        self.url = f"http://127.0.0.1:{self.servers[0].sockets[0].getsockname()[1]}"

    def stop(self) -> None:
        self.should_exit = True
        self._thread.join()


@pytest.fixture
def server(tmp_path: Path, fake: Any) -> Iterator[Running]:
    running = Running(tmp_path / "server", fake)
    yield running
    running.stop()


def write(folder: Path, document: Document) -> str:
    path = folder / "request.json"
    path.write_text(json.dumps(document))
    return str(path)


@pytest.mark.parametrize(
    ("kind", "data", "text"),
    [
        ("stage", {"what": "proving main", "done": 0.5}, "proving main"),
        ("status", {"status": "queued", "detail": "The worker died."}, "The worker died."),
        ("status", {"status": "running", "attempt": 2}, "attempt 2"),
        ("screening", {"arm": "a", "candidates": 10, "usable": 2, "best": 1.5}, "2 usable of 10 looked at, best 1.5"),
        ("screening", {"arm": "a", "candidates": 10, "usable": 0, "best": None}, "0 usable of 10 looked at"),
        ("iteration", {"iteration": 3, "objective": 68.4789, "violation": 0.0}, "iteration 3: 68.4789"),
        ("start", {"arm": "a", "start": 1, "status": "limit", "objective": None, "iterations": 9}, "limit, not usable"),
        ("bound", {"arm": "a", "lower_bound": 1, "objective": 2, "gap": 0.5, "boxes": 7}, "gap 50.00 % after 7 boxes"),
        ("bound", {"arm": "a", "lower_bound": None, "objective": None, "gap": None, "boxes": 7}, "no gap yet"),
    ],
)
def test_events_are_shown_in_words(kind: str, data: Document, text: str) -> None:
    changes = shown(kind, data)
    assert text in f"{changes.get('description', '')} {changes.get('detail', '')}"


def test_what_is_not_known_is_not_shown() -> None:
    assert shown("something new", {"a": 1}) == {}


def test_a_server_solves_and_the_answer_is_printed(
    server: Running, tmp_path: Path, example: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    output = tmp_path / "answer.json"
    assert main(["solve", write(tmp_path, example), "--server", server.url, "-o", str(output)]) == 0
    resource = json.loads(output.read_text())
    assert resource["status"] == "succeeded"
    assert resource["request"]["arms"][0]["weights"] == "range"
    assert "follower" in capsys.readouterr().out


def test_a_server_that_refuses_is_quoted(
    server: Running, tmp_path: Path, example: Document, fake: Any, capsys: pytest.CaptureFixture[str]
) -> None:
    example["arms"][0]["robot"] = "ur10x"
    assert main(["solve", write(tmp_path, example), "--server", server.url]) == 2
    assert "/arms/0/robot" in capsys.readouterr().err
    example["arms"][0]["robot"] = "ur10e"
    fake.failure = SolveFailed("time-limit", "No answer within 70 s.")
    assert main(["solve", write(tmp_path, example), "--server", server.url]) == 1
    assert "No answer within 70 s." in capsys.readouterr().err


@pytest.mark.parametrize("url", ["http://127.0.0.1:9", "ftp://example.org", "nonsense", "http://[::1"])
def test_a_server_that_is_not_there_is_told(
    url: str, tmp_path: Path, example: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["solve", write(tmp_path, example), "--server", url]) == 1
    assert url in capsys.readouterr().err


@pytest.mark.parametrize("option", [["--robot-urdf", "a=b.urdf"]])
def test_options_for_here_are_refused_for_there(
    option: list[str], tmp_path: Path, example: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["solve", write(tmp_path, example), "--server", "http://127.0.0.1:9", *option]) == 2
    assert option[0] in capsys.readouterr().err


def test_a_time_limit_is_sent_to_the_server(server: Running, tmp_path: Path, example: Document, fake: Any) -> None:
    example["time_limit"] = 50.0
    assert main(["solve", write(tmp_path, example), "--server", server.url, "--time-limit", "5"]) == 0
    assert fake.limits[-1][0] == 5.0


def test_a_server_that_is_restarted_meanwhile_makes_no_difference(
    tmp_path: Path, example: Document, fake: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("duocell.service.cli.remote.PAUSE", 0.05)
    fake.seconds = 60.0
    first = Running(tmp_path / "server", fake)
    port = first.servers[0].sockets[0].getsockname()[1]
    codes: list[int] = []
    request = write(tmp_path, example)
    client = threading.Thread(target=lambda: codes.append(main(["solve", request, "--server", first.url])))
    client.start()
    while not fake.running:
        time.sleep(0.01)
    first.stop()
    fake.seconds = 0.0
    app = create_app(Settings(workers=1, data_dir=tmp_path / "server"), fake)
    second = uvicorn.Server(uvicorn.Config(app, port=port, log_level="warning", timeout_graceful_shutdown=1))
    thread = threading.Thread(target=second.run)
    thread.start()
    client.join(30.0)
    second.should_exit = True
    thread.join()
    assert codes == [0]


def interrupted(arguments: list[str], ready: Any, **environment: str) -> tuple[int, float]:
    """Exit code, and s that it took, of a command that is sent Ctrl-C once ``ready()`` holds."""
    process = subprocess.Popen(
        [*COMMAND, *arguments], cwd=REPOSITORY, stderr=subprocess.PIPE, env=os.environ | environment
    )
    ends = time.monotonic() + 60.0
    while not ready():
        assert process.poll() is None
        assert time.monotonic() < ends
        time.sleep(0.02)
    began = time.monotonic()
    process.send_signal(signal.SIGINT)
    _, error = process.communicate(timeout=20.0)
    assert error.endswith(b"interrupted\n")
    return process.returncode, time.monotonic() - began


def test_ctrl_c_cancels_the_layout_at_the_server(server: Running, tmp_path: Path, example: Document, fake: Any) -> None:
    fake.seconds = 60.0
    code, seconds = interrupted(["solve", write(tmp_path, example), "--server", server.url], lambda: fake.running)
    assert code == 130
    assert seconds < 30.0  # of the 60 s that the solve would take
    ends = time.monotonic() + 20.0
    while fake.running:
        assert time.monotonic() < ends
        time.sleep(0.02)


def test_an_interrupt_before_the_address_is_known_cancels_too(
    server: Running, example: Document, fake: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The answer to the request is lost to Ctrl-C; the server has taken the layout in."""
    fake.seconds = 60.0
    post, sent = httpx2.Client.post, []

    def interrupted_once(client: httpx2.Client, url: str, **given: Any) -> httpx2.Response:
        answer = post(client, url, **given)
        sent.append(url)
        if len(sent) == 1:
            raise KeyboardInterrupt
        return answer

    monkeypatch.setattr(httpx2.Client, "post", interrupted_once)
    with pytest.raises(KeyboardInterrupt):
        solve_there(server.url, json.dumps(example).encode())
    assert [url.rpartition("/")[2] for url in sent] == ["layouts", "layouts", "cancel"]
    ends = time.monotonic() + 20.0
    while fake.running:
        assert time.monotonic() < ends
        time.sleep(0.02)
    assert fake.most_running <= 1


def test_migrate_makes_tables_and_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("DUOCELL_DATA_DIR", str(tmp_path / "new"))
    assert main(["migrate"]) == 0
    assert "were at nothing" in capsys.readouterr().out
    assert main(["migrate"]) == 0
    assert "up to date" in capsys.readouterr().out
    monkeypatch.setenv("DUOCELL_DATABASE_URL", "mysql://somebody:secret@example.org/db")
    assert main(["migrate"]) == 2
    told = capsys.readouterr().err
    assert "database_url" in told
    assert "secret" not in told
    monkeypatch.setenv("DUOCELL_DATABASE_URL", "postgresql://somebody:secret@127.0.0.1:9/db")
    assert main(["migrate"]) == 1
    assert "secret" not in capsys.readouterr().err


def test_what_is_known_is_the_answer_of_a_solve_that_does_not_listen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli_local, "GRACE", 0.0)
    stop, never = threading.Event(), Future[Document]()
    told = [json.dumps({"outcome": "unknown"}), json.dumps({"outcome": "feasible"})]
    assert cli_local._in_time(never, stop, 0.0, told) == {"outcome": "feasible"}
    assert stop.is_set()
    with pytest.raises(SolveFailed):
        cli_local._in_time(never, stop, 0.0, [])
    cancelled = Future[Document]()
    cancelled.set_exception(Cancelled())
    assert cli_local._in_time(cancelled, stop, 0.0, told) == {"outcome": "feasible"}
    done = Future[Document]()
    done.set_result({"outcome": "optimal"})
    assert cli_local._in_time(done, threading.Event(), 0.0, told) == {"outcome": "optimal"}
