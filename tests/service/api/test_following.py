"""Following a layout, trying it again, and what a restart leaves: over HTTP, on a fake executor."""

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fastapi.testclient import TestClient

from duocell.service.workers.executor import WorkerDied
from tests.support.server import has, until

Document = dict[str, Any]
Make = Callable[..., TestClient]
WAIT = {"Prefer": "wait=10"}


def events_of(text: str) -> list[tuple[int, str, Document]]:
    """(id, event, data) of a stream."""
    found = []
    for block in text.split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.splitlines() if not line.startswith(":"))
        if "event" in fields:
            found.append((int(fields["id"]), fields["event"], json.loads(fields["data"])))
    return found


# ------------------------------------------------------------------------------------------------------------- follow


def test_a_layout_can_be_followed_to_its_end(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 0.3
    location = client.post("/v1/layouts", json=example).headers["location"]
    answer = client.get(f"{location}/events")
    assert answer.status_code == 200
    assert answer.headers["content-type"].startswith("text/event-stream")
    assert answer.headers["cache-control"] == "no-store"
    events = events_of(answer.text)
    assert [kind for _, kind, _ in events] == ["status", "status", "stage", "done"]
    assert [data.get("status") for _, _, data in events] == ["queued", "running", None, "succeeded"]
    assert events[-1][2]["objective"] == 3.0
    numbers = [number for number, _, _ in events]
    assert numbers == sorted(set(numbers))
    assert answer.text.startswith("retry: ")
    later = client.get(f"{location}/events")  # from the store
    assert events_of(later.text) == events


def test_following_resumes_behind_the_last_event(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 0.3
    location = client.post("/v1/layouts", json=example).headers["location"]
    events = events_of(client.get(f"{location}/events").text)
    for index, (number, _, _) in enumerate(events[:-1]):
        resumed = client.get(f"{location}/events", headers={"Last-Event-ID": str(number)})
        assert events_of(resumed.text) == events[index + 1 :]
    end = client.get(f"{location}/events", headers={"Last-Event-ID": str(events[-1][0])})
    assert end.status_code == 204
    strange = client.get(f"{location}/events", headers={"Last-Event-ID": "nonsense"})
    assert events_of(strange.text) == events


def test_silence_is_broken_and_streams_end(client_with: Make, fake: Any, example: Document, monkeypatch: Any) -> None:
    monkeypatch.setattr("duocell.service.api.events.KEEP_ALIVE", 0.05)
    fake.seconds = 60.0
    client = client_with(workers=1, max_follow=0.5)
    location = client.post("/v1/layouts", json=example).headers["location"]
    began = time.monotonic()
    text = client.get(f"{location}/events").text
    assert 0.4 < time.monotonic() - began < 3.0
    assert text.count(": ping") >= 5
    assert [kind for _, kind, _ in events_of(text)] == ["status", "status", "stage"]


def test_events_of_a_running_layout_are_stored(client_with: Make, fake: Any, example: Document, tmp_path: Path) -> None:
    """A process that ends without a word leaves them to the next one."""
    import sqlite3

    fake.seconds = 60.0
    client = client_with(workers=1, data_dir=tmp_path)
    client.post("/v1/layouts", json=example)

    def kinds() -> list[str]:
        connection = sqlite3.connect(tmp_path / "duocell.sqlite3")
        found = [row[0] for row in connection.execute("SELECT kind FROM events ORDER BY number")]
        connection.close()
        return found

    until(lambda: kinds() == ["status", "status", "stage"])


# ------------------------------------------------------------------------------------------- attempts and interruptions


def test_a_job_whose_worker_died_is_tried_again(client: TestClient, fake: Any, example: Document) -> None:
    fake.deaths = [WorkerDied("The worker was ended by signal SIGKILL.")] * 2
    layout = client.post("/v1/layouts", json=example, headers=WAIT).json()
    assert layout["status"] == "succeeded"
    assert layout["attempts"] == 3
    events = events_of(client.get(f"/v1/layouts/{layout['id']}/events").text)
    states = [(data["status"], data.get("attempt")) for _, kind, data in events if kind == "status"]
    assert states == [
        ("queued", None),
        ("running", 1),
        ("queued", None),
        ("running", 2),
        ("queued", None),
        ("running", 3),
    ]


def test_a_job_that_kills_every_worker_fails(client_with: Make, fake: Any, example: Document) -> None:
    fake.deaths = [WorkerDied("The worker was ended by signal SIGSEGV.")] * 9
    client = client_with(workers=1, max_attempts=2)
    layout = client.post("/v1/layouts", json=example, headers=WAIT).json()
    assert layout["status"] == "failed"
    assert layout["attempts"] == 2
    assert layout["error"]["code"] == "worker-died"
    assert "SIGSEGV" in layout["error"]["detail"]
    assert "attempt 2 of 2" in layout["error"]["detail"]
    assert len(fake.deaths) == 7


def crashed(folder: Path, copy: Path) -> Path:
    """What a process that ends without a word leaves: the files as they are at this moment."""
    copy.mkdir()
    for file in folder.glob("duocell.sqlite3*"):
        if not file.name.endswith(".lock"):
            (copy / file.name).write_bytes(file.read_bytes())
    return copy


def test_jobs_are_taken_up_again_after_a_crash(client_with: Make, fake: Any, example: Document, tmp_path: Path) -> None:
    fake.seconds = 60.0
    client = client_with(workers=1, data_dir=tmp_path / "first")
    locations = [client.post("/v1/layouts", json=example | {"name": f"{n}"}).headers["location"] for n in range(3)]
    folder = crashed(tmp_path / "first", tmp_path / "second")
    fake.seconds = 0.0
    again = client_with(workers=1, data_dir=folder)
    for location in locations:
        until(has(again, location, "status", "succeeded"))
    layouts = [again.get(location).json() for location in locations]
    assert [layout["attempts"] for layout in layouts] == [2, 1, 1]
    assert [layout["name"] for layout in layouts] == ["0", "1", "2"]
    ended = sorted(layouts, key=lambda layout: str(layout["finished_at"]))
    assert [layout["name"] for layout in ended] == ["0", "1", "2"]
    events = events_of(again.get(f"{locations[0]}/events").text)
    numbers = [number for number, _, _ in events]
    assert numbers == sorted(set(numbers))
    assert [data["status"] for _, kind, data in events if kind == "status"] == ["queued", "running"] * 2


def test_a_job_that_ends_every_service_fails(client_with: Make, fake: Any, example: Document, tmp_path: Path) -> None:
    fake.seconds = 60.0
    client = client_with(workers=1, data_dir=tmp_path / "0")
    location = client.post("/v1/layouts", json=example).headers["location"]
    for number in (1, 2):
        until(has(client, location, "attempts", number))
        folder = crashed(tmp_path / f"{number - 1}", tmp_path / f"{number}")
        client = client_with(workers=1, max_attempts=2, data_dir=folder)
    layout = client.get(location).json()
    assert layout["status"] == "failed"
    assert layout["error"]["code"] == "interrupted"
    assert "attempt 2 of 2" in layout["error"]["detail"]
    assert events_of(client.get(f"{location}/events").text)[-1][1] == "done"


def test_two_services_do_not_share_a_folder(client_with: Make, example: Document, tmp_path: Path) -> None:
    first = client_with(data_dir=tmp_path)
    second = client_with(data_dir=tmp_path)
    answer = second.post("/v1/layouts", json=example)
    assert answer.status_code == 503
    assert answer.json()["code"] == "store-unavailable"
    assert "Another server" in answer.json()["detail"]
    assert int(answer.headers["retry-after"]) >= 1
    assert "Another server" in second.get("/readyz").json()["detail"]
    first.__exit__(None, None, None)
    until(lambda: second.post("/v1/layouts", json=example).status_code == 202)
    first.__enter__()
