"""Faults of PostgreSQL and of the way to it."""

from __future__ import annotations

import threading
import time
import uuid
from typing import Any

from sqlalchemy import create_engine, text

from bench.chaos.proxy import proxied
from bench.chaos.server import Server, request, running, until
from bench.chaos.trial import Finding, Setup

LONG = 400
"""Poses of a layout that takes some seconds."""
TAKEN_UP_WITHIN = 20.0
"""s, from a fault to the end of a small layout that met it, on a machine that does other things as well."""


def lost_commit(setup: Setup) -> Finding:
    """The answer to COMMIT is lost on the way: of a new job, a claim, an end, and a job that goes back."""
    assert setup.postgres is not None
    seen, kept = [], True
    statements = {"add": b"INSERT INTO jobs", "claim": b"started_at=", "finish": b"finished_at="}
    with proxied(setup.postgres) as (proxy, url), running(setup.folder, {"DUOCELL_DATABASE_URL": url}) as server:
        for what, statement in statements.items():
            if what == "claim":  # somebody must be in the way, so that it is queued first
                server.post(request(LONG, "in the way", arms=2))
            proxy.lose_commit_of(statement)
            key = uuid.uuid4().hex
            began = time.monotonic()
            first = server.post(request(3, what), Idempotency_Key=key)
            again = first
            while again.status == 503:  # as a client does
                time.sleep(0.5)
                again = server.post(request(3, what), Idempotency_Key=key)
            ended: Any = server.finished(again.headers.get("location", "/none"), 60.0)
            status = ended.get("status", "gone")
            jobs = server.get("/v1/layouts?name=" + what).body["items"]
            kept = kept and status == "succeeded" and len(jobs) == 1 and proxy.lost > 0
            seen.append(f"{what}: {first.status}, {status} {time.monotonic() - began:.1f} s later, {len(jobs)} job")
        lost = proxy.lost
    return Finding(kept and lost == len(statements), f"{lost} lost; " + "; ".join(seen))


def lock_lost(setup: Setup) -> Finding:
    """The backend with the lock is terminated while another server waits for it."""
    assert setup.postgres is not None
    first, second = (Server(setup.folder / name, settings=setup.settings) for name in "ab")
    try:
        first.start()
        second.start(wait=False)
        until(lambda: second.get("/healthz").status == 200, 120.0, "the standby")
        time.sleep(2.0)
        terminate_locks(setup.postgres)
        taken: list[str] = []
        ends = time.monotonic() + 8.0
        while time.monotonic() < ends:
            for server in (first, second):
                answer = server.post(request(60, arms=2))
                if answer.status in (200, 202):
                    taken.append(answer.headers["location"])
            time.sleep(0.1)
        until(lambda: 200 in (first.get("/readyz").status, second.get("/readyz").status), 30.0, "an owner")
        asked = first if first.get("/readyz").status == 200 else second
        states = [asked.finished(location, TAKEN_UP_WITHIN).get("status") for location in taken]
        attempts = [asked.get(location).body.get("attempts") for location in taken]
    finally:
        for server in (first, second):
            server.stop()
    stranded = sum(state != "succeeded" for state in states)
    return Finding(
        bool(taken) and not stranded,
        f"{len(taken)} taken in, {stranded} left lying, attempts {max(attempts, default=0)}",
    )


def terminate_locks(url: str) -> int:
    """End the sessions that hold advisory locks; how many."""
    engine = create_engine(url, isolation_level="AUTOCOMMIT")
    with engine.connect() as connection:
        holders = "SELECT DISTINCT pid FROM pg_locks WHERE locktype = 'advisory' AND granted"
        ended = connection.execute(text(f"SELECT pg_terminate_backend(pid) FROM ({holders}) AS holders")).all()
    engine.dispose()
    return len(ended)


def silent(setup: Setup) -> Finding:
    """The database does not answer any more, and later does again."""
    assert setup.postgres is not None
    with proxied(setup.postgres) as (proxy, url), running(setup.folder, {"DUOCELL_DATABASE_URL": url}) as server:
        location = server.post(request(3)).headers["location"]
        server.finished(location)
        proxy.fall_silent()
        began = time.monotonic()
        answers: list[tuple[int, float]] = []

        def ask(method: str) -> None:
            answer = server.post(request(3), 60.0) if method == "POST" else server.get(location, 60.0)
            answers.append((answer.status, answer.seconds))

        threads = [threading.Thread(target=ask, args=(m,)) for m in ("POST", "GET") * 6]
        for thread in threads:
            thread.start()
        noticed = wait_for(lambda: server.get("/readyz", 5.0).status == 503, 60.0)
        health = max(server.get("/healthz").seconds for _ in range(20))
        for thread in threads:
            thread.join()
        slowest = max(seconds for _, seconds in answers)
        statuses = {status for status, _ in answers}
        proxy.speak_again()
        recovered = wait_for(lambda: server.get("/readyz").status == 200, 60.0)
        after = server.finished(server.post(request(3)).headers.get("location", "/none"))
    kept = noticed < 10.0 and slowest < 12.0 and statuses <= {503} and recovered < 15.0
    kept = kept and after.get("status") == "succeeded" and time.monotonic() > began
    return Finding(
        kept,
        f"/readyz says so after {noticed:.1f} s, answers {sorted(statuses)} within {slowest:.1f} s, /healthz "
        f"{1e3 * health:.0f} ms, ready {recovered:.1f} s after it spoke",
    )


def wait_for(condition: Any, seconds: float) -> float:
    """s until a condition holds; infinite if that takes too long."""
    try:
        return until(condition, seconds, "it")
    except RuntimeError:
        return float("inf")


def standby(setup: Setup) -> Finding:
    """A server that does not own the store is asked to change things, and to tell of what happens."""
    first, second = (Server(setup.folder / name, settings=setup.settings) for name in "ab")
    try:
        first.start()
        done = first.post(request(3)).headers["location"]
        first.finished(done)
        long = first.post(request(LONG, arms=2)).headers["location"]
        second.start(wait=False)
        until(lambda: second.get("/healthz").status == 200, 120.0, "the standby")
        statuses = [
            second.ask("POST", f"{long}/cancel", b"").status,
            second.ask("DELETE", done, None).status,
            second.post(request(3)).status,
        ]
        followed = second.get(f"{long}/events")
        complete = "event: done" in str(followed.body)
        ended = first.finished(long)
        reads = second.get(done).status
    finally:
        for server in (first, second):
            server.stop()
    kept = set(statuses) == {503} and complete and reads == 200 and ended.get("status") == "succeeded"
    return Finding(
        kept,
        f"cancel, DELETE, POST: {statuses}; GET: {reads}; its stream {'ends with' if complete else 'has no'} done; the "
        f"layout {ended.get('status')}",
    )
