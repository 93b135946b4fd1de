"""The server is told to stop in the middle of everything: it leaves in time, and the next one carries on."""

import signal
import threading
import time
from pathlib import Path
from typing import Any

from tests.support.server import Server, alive, events_of, finished, line_request, until


def test_sigterm_with_open_streams_and_a_running_solve(tmp_path: Path) -> None:
    server = Server(tmp_path, DUOCELL_WORKERS="1", DUOCELL_DRAIN="1")
    server.start()
    server.wait_until_ready()
    got: dict[str, Any] = {}
    with server.client() as client:
        location = client.post("/v1/layouts", json=line_request(3000, "long", arms=2)).headers["location"]
        waiting = client.post("/v1/layouts", json=line_request(3, "waiting")).headers["location"]

        def follow() -> None:
            with server.client() as mine:
                got["events"] = events_of(mine, location)

        def wait() -> None:
            with server.client() as mine:
                headers = {"Prefer": "wait=60"}
                got["answer"] = mine.post("/v1/layouts", json=line_request(4, "third"), headers=headers)

        threads = [threading.Thread(target=follow), threading.Thread(target=wait)]
        for thread in threads:
            thread.start()
        until(lambda: len(client.get("/v1/layouts").json()["items"]) == 3)
        time.sleep(0.5)
        workers = server.workers()
        code, seconds = server.terminate()
    for thread in threads:
        thread.join(5.0)
    assert code in (0, -signal.SIGTERM)
    assert seconds < 1.0 + 5.0
    assert got["answer"].status_code == 202  # what Prefer: wait promises if time is up
    assert got["answer"].json()["status"] == "queued"
    assert [data.get("status") for _, kind, data in got["events"] if kind == "status"] == [
        "queued",
        "running",
        "queued",
    ]
    assert "stopped" in got["events"][-1][2]["detail"]
    until(lambda: not any(alive(pid) for pid in workers), 5.0, "the end of the workers")
    server.start()
    server.wait_until_ready()
    with server.client() as client:
        assert client.get(location).json()["attempts"] in (0, 1)
        for address in (waiting, got["answer"].headers["location"]):
            client.post(f"{location}/cancel")
            assert finished(client, address)["status"] == "succeeded"
    server.kill()
