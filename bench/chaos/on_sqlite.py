"""Faults of a SQLite file and of its folder."""

from __future__ import annotations

import sqlite3
import threading
import time
from pathlib import Path

from bench.chaos.on_postgres import wait_for
from bench.chaos.server import Reply, Server, request, running, until
from bench.chaos.trial import Finding, Setup

FILE = "duocell.sqlite3"
HELD = 12.0
"""s that another program keeps the file locked for writing."""


def deleted(setup: Setup) -> Finding:
    """All files of the database are deleted under the server, the lock file included."""
    with running(setup.folder) as server:
        server.finished(server.post(request(3)).headers["location"])
        for path in setup.folder.glob(f"{FILE}*"):
            path.unlink()
        statuses = [server.post(request(3)).status for _ in range(5)]
        noticed = wait_for(lambda: server.get("/readyz").status == 503, 10.0)
    return Finding(set(statuses) == {503} and noticed < 5.0, f"POST {statuses}, /readyz says so after {noticed:.1f} s")


def lock_deleted(setup: Setup) -> Finding:
    """The lock file is deleted, and a second server starts on the same folder."""
    first, second = Server(setup.folder), Server(setup.folder)
    try:
        first.start()
        (setup.folder / f"{FILE}.lock").unlink()
        time.sleep(3.0)
        second.start(wait=False)
        until(lambda: second.get("/healthz").status == 200, 120.0, "the second")
        time.sleep(3.0)
        ready = [server.get("/readyz").status for server in (first, second)]
        taken = [server.post(request(3)) for server in (first, second) for _ in range(3)]
        locations = [answer.headers["location"] for answer in taken if answer.status in (200, 202)]
        owner = first if ready[0] == 200 else second
        states = [owner.finished(location, 30.0).get("status") for location in locations]
    finally:
        first.stop()
        second.stop()
    kept = sorted(ready) == [200, 503] and set(states) == {"succeeded"}
    return Finding(kept, f"/readyz of the two {ready}; {len(states)} taken in, {states.count('succeeded')} done")


def damaged(setup: Setup) -> Finding:
    """Pages of the file are overwritten."""
    with running(setup.folder) as server:
        for _ in range(3):
            server.finished(server.post(request(60)).headers["location"])
        with sqlite3.connect(setup.folder / FILE) as connection:
            connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
            size = connection.execute("PRAGMA page_size").fetchone()[0]
            tables = {"jobs", "jobs_key", "sqlite_autoindex_jobs_1"}
            roots = [
                row[1] for row in connection.execute("SELECT name, rootpage FROM sqlite_master") if row[0] in tables
            ]
        connection.close()
        with (setup.folder / FILE).open("r+b") as file:
            for root in roots:
                file.seek((root - 1) * size)
                file.write(b"\xa5" * size)
        answers = [server.post(request(3)) for _ in range(5)]
        ready = []
        for _ in range(20):
            time.sleep(0.25)
            ready.append(server.get("/readyz").status)
        said = server.get("/readyz").body
    statuses = [answer.status for answer in answers]
    kept = set(statuses) == {503} and set(ready) == {503} and "damaged" in str(said)
    return Finding(kept, f"POST {statuses}, /readyz 200 in {ready.count(200)} of {len(ready)} looks")


def external_writer(setup: Setup) -> Finding:
    """Another program holds the write lock of the file for some seconds."""
    with running(setup.folder) as server:
        location = server.post(request(3)).headers["location"]
        server.finished(location)
        other = sqlite3.connect(setup.folder / FILE, isolation_level=None, check_same_thread=False)
        other.execute("BEGIN IMMEDIATE")
        began = time.monotonic()
        posts: list[Reply] = []
        threads = [threading.Thread(target=lambda: posts.append(server.post(request(3), 120.0))) for _ in range(8)]
        for thread in threads:
            thread.start()
        reads = []
        while time.monotonic() - began < HELD:
            reads.append(server.get(location, 90.0))
            time.sleep(0.2)
        ready = server.get("/readyz").status
        other.execute("ROLLBACK")
        other.close()
        for thread in threads:
            thread.join()
        recovered = wait_for(lambda: server.get("/readyz").status == 200, 30.0)
        last = server.finished(server.post(request(3)).headers.get("location", "/none"))
    slowest, slow_read = max(answer.seconds for answer in posts), max(answer.seconds for answer in reads)
    kept = slowest < 6.0 and slow_read < 2.0 and all(answer.status == 200 for answer in reads) and ready == 503
    kept = kept and recovered < 5.0 and last.get("status") == "succeeded"
    return Finding(
        kept,
        f"POST {sorted({a.status for a in posts})} within {slowest:.1f} s, GET within {slow_read:.2f} s, /readyz "
        f"{ready}, ready {recovered:.1f} s after",
    )


def clock(setup: Setup) -> Finding:
    """The wall clock of the server process is set back by three days, and forward by two."""
    moved = setup.folder.parent / "clock"
    moved.write_text("+0d")
    shim = next(Path("/usr/lib").glob("*/faketime/libfaketime.so.1"), None)
    if shim is None:
        return Finding(False, "Debian's faketime is not installed")
    settings = {
        "LD_PRELOAD": str(shim),
        "FAKETIME_TIMESTAMP_FILE": str(moved),
        "FAKETIME_NO_CACHE": "1",
        "FAKETIME_DONT_FAKE_MONOTONIC": "1",
        "DUOCELL_KEEP_JOBS": "3",
        "DUOCELL_KEEP_DELETED": "3600",
    }
    with running(setup.folder, settings) as server:
        for number in range(3):
            server.finished(server.post(request(3, f"old {number}")).headers["location"])
        moved.write_text("-3d")
        first = server.post(request(3, "new"), Idempotency_Key="once")
        server.finished(first.headers["location"])
        time.sleep(3.0)  # old ones are forgotten meanwhile
        again = server.post(request(3, "new"), Idempotency_Key="once")
        once = again.headers["location"] == first.headers["location"]
        newest = server.get("/v1/layouts?limit=1").body["items"][0]["name"]
        mesh = upload_mesh(server, "box")
        long = server.post(request(700, "in the way", arms=2)).headers["location"]
        uses = request(3, "uses a mesh")
        uses["part"] = {"shapes": [{"shape": {"type": "mesh", "id": mesh, "scale": 0.001}}]}
        queued = server.post(uses)
        server.ask("DELETE", f"/v1/meshes/{mesh}", None)
        moved.write_text("+2d")
        upload_mesh(server, "other")  # what was deleted long ago is forgotten with this
        server.ask("POST", f"{long}/cancel", b"")
        ended = server.finished(queued.headers.get("location", "/none"))
    error = ended.get("error") if isinstance(ended, dict) else queued.body
    kept = once and newest == "new" and isinstance(ended, dict) and ended.get("status") == "succeeded"
    return Finding(
        kept,
        f"back: the key ran {'once' if once else 'twice'}, newest in the list is {newest!r}; forward: the layout with "
        f"a deleted mesh {ended.get('status') if isinstance(ended, dict) else queued.status} {error or ''}".rstrip(),
    )


def upload_mesh(server: Server, name: str) -> str:
    """Send a small box; its identifier."""
    corners = [(x, y, z) for x in (0, 20 + len(name)) for y in (0, 30) for z in (0, 40)]
    faces = ["1 3 4 2", "5 6 8 7", "1 2 6 5", "3 7 8 4", "1 5 7 3", "2 4 8 6"]
    text = "".join(f"v {x} {y} {z}\n" for x, y, z in corners) + "".join(f"f {face}\n" for face in faces)
    edge = "chaos-edge"
    head = f'--{edge}\r\nContent-Disposition: form-data; name="mesh"; filename="{name}.obj"\r\n\r\n'
    body = f"{head}{text}\r\n--{edge}--\r\n"
    answer = server.ask("POST", "/v1/meshes", body.encode(), Content_Type=f"multipart/form-data; boundary={edge}")
    return str(answer.body.get("id") if isinstance(answer.body, dict) else answer.body)
