"""The server is killed at random moments while clients send: nothing is lost, nothing is done twice."""

import random
import signal
import sqlite3
import threading
import time
import uuid
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path

import httpx2
import pytest

from duocell.optimizer.optimize import optimize
from duocell.service.requests.convert import cell_of, settings_of
from duocell.service.schemas.request import LayoutRequest
from tests.support.server import Document, Server, alive, events_of, finished, line_request, serving, until

KINDS = [
    line_request(3, "three"),
    line_request(5, "five"),
    line_request(10, "both arms", arms=2),
    line_request(4, "proved", certificate={"gap": 0.05, "time_limit": 5.0}),
]


def right_answers() -> list[float]:
    """The objectives of `KINDS`, found in this process."""
    requests = [LayoutRequest.model_validate(kind) for kind in KINDS]
    found = [optimize(cell_of(request), settings_of(request, 60.0)).objective for request in requests]
    return [value for value in found if value is not None]


@dataclass
class Client(threading.Thread):
    """Sends its share of jobs, each until it is acknowledged, and remembers the addresses."""

    url: str
    jobs: int
    seed: int
    until: float
    acknowledged: list[tuple[int, str]] = field(default_factory=list)
    repeated: int = 0

    def __post_init__(self) -> None:
        super().__init__(daemon=True)

    __hash__ = threading.Thread.__hash__

    def run(self) -> None:
        with httpx2.Client(base_url=self.url, timeout=30.0, verify=False) as client:
            self.send_all(client)

    def send_all(self, client: httpx2.Client) -> None:
        draws = random.Random(self.seed)
        moments = sorted(draws.uniform(0.0, 1.0) for _ in range(self.jobs))
        began = time.monotonic()
        for moment in moments:
            time.sleep(max(0.0, began + moment * self.until - time.monotonic()))
            kind = draws.randrange(len(KINDS))
            self.acknowledged.append((kind, self.send(client, KINDS[kind], draws)))

    def send(self, client: httpx2.Client, request: Document, draws: random.Random) -> str:
        """The address of a job, once the server has acknowledged it."""
        headers = {"Idempotency-Key": str(uuid.UUID(int=draws.getrandbits(128)))}
        if draws.random() < 0.5:
            headers["Prefer"] = "wait=2"
        while True:
            try:
                answer = client.post("/v1/layouts", json=request, headers=headers)
                if answer.status_code in (200, 202):
                    return str(answer.headers["location"])
                assert answer.status_code in (409, 429, 503), answer.text
            except httpx2.TransportError:
                pass
            self.repeated += 1
            time.sleep(0.1)


@pytest.mark.timeout(3600)
def test_every_acknowledged_job_ends_once_with_the_right_result(tmp_path: Path, long: bool) -> None:
    kills, jobs, clients = (50, 200, 8) if long else (3, 20, 4)
    right = right_answers()
    with serving(tmp_path, DUOCELL_WORKERS="2", DUOCELL_MAX_QUEUED="300") as server:
        senders = [Client(server.url, jobs // clients, seed, kills * 3.0) for seed in range(clients)]
        for sender in senders:
            sender.start()
        orphans = kill_again_and_again(server, kills)
        for sender in senders:
            sender.join(300.0)
            assert not sender.is_alive()
        acknowledged = [entry for sender in senders for entry in sender.acknowledged]
        assert len(acknowledged) == len({location for _, location in acknowledged}) == jobs  # one for every request
        with server.client() as client:
            attempts = Counter(checked(client, location, KINDS[kind], right[kind]) for kind, location in acknowledged)
        until(lambda: not any(alive(pid) for pid in orphans), 10.0, "the end of orphaned workers")
        assert server.terminate()[0] in (0, -signal.SIGTERM)
    rows = stored(server.folder / "duocell.sqlite3")
    assert len(rows) == jobs  # none twice
    assert {status for status, _ in rows} == {"succeeded"}
    print(  # noqa: T201 - the figures of docs/reliability.md
        f"\n{kills} kills, {jobs} jobs, {clients} clients: attempts {dict(sorted(attempts.items()))}, "
        f"requests repeated {sum(sender.repeated for sender in senders)}, orphans seen {len(orphans)}"
    )


def kill_again_and_again(server: Server, kills: int) -> set[int]:
    """Kill at random moments, a fifth of them while it starts; the workers that were there when their server went."""
    draws, orphans = random.Random(20261122), set[int]()
    for _ in range(kills):
        time.sleep(draws.uniform(0.0, 2.5))
        orphans |= server.workers()
        server.kill()
        server.start()
        if draws.random() > 0.2:
            server.wait_until_ready("/healthz")
    server.wait_until_ready()
    return orphans


def checked(client: httpx2.Client, location: str, request: Document, right: float) -> int:
    """How many attempts a job took; it has ended once, and as it should."""
    resource = finished(client, location, 600.0)
    assert resource["status"] == "succeeded", resource["error"]
    assert resource["name"] == request["name"]
    assert resource["result"]["objective"] == pytest.approx(right, rel=1e-6)
    assert resource["result"]["verification"]["limits_respected"]
    events = events_of(client, location)
    numbers = [number for number, _, _ in events]
    assert numbers == sorted(set(numbers))
    assert [kind for _, kind, _ in events].count("done") == 1
    assert events[-1][1] == "done"
    return int(resource["attempts"])


def stored(file: Path) -> list[tuple[str, str]]:
    """(state, id) of all jobs in a database that is not damaged."""
    connection = sqlite3.connect(file)
    assert connection.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
    assert connection.execute("PRAGMA foreign_key_check").fetchall() == []
    found = connection.execute("SELECT status, id FROM jobs").fetchall()
    connection.close()
    return found
