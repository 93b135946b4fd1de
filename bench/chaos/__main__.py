"""Faults, one after the other, on servers of our own on loopback; a table of what came out.

    python -m bench.chaos [--only NAME ...] [--list]

Servers run the sources of this folder, or those of the folder in DUOCELL_CHAOS_SOURCES. PostgreSQL and Debian's
faketime must be installed. Everything takes some minutes and ends by itself; the exit code is 0 if all was kept.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import traceback
from contextlib import ExitStack
from pathlib import Path

from bench.chaos import on_bodies, on_postgres, on_processes, on_sqlite, postgres
from bench.chaos.server import SOURCES
from bench.chaos.trial import Finding, Setup, Trial

LITE, BIG = "sqlite", "postgresql"
TRIALS = (
    Trial("kills", "SIGKILL of the server", "nothing acknowledged is lost", (LITE, BIG), on_processes.kills),
    Trial("lost-commit", "the answer to COMMIT is lost", "each job ends, once", (BIG,), on_postgres.lost_commit),
    Trial("lock", "the lock's backend is terminated, a standby waits", "no job is left", (BIG,), on_postgres.lock_lost),
    Trial("silent", "the database does not answer", "503 within seconds, also /readyz", (BIG,), on_postgres.silent),
    Trial("standby", "a standby is asked", "503 for changes, streams end with done", (BIG,), on_postgres.standby),
    Trial("deleted", "all files are deleted", "nothing more is acknowledged", (LITE,), on_sqlite.deleted),
    Trial("lock-file", "the lock file is deleted, a second server", "one owner", (LITE,), on_sqlite.lock_deleted),
    Trial("damaged", "pages are overwritten", "/readyz says so", (LITE,), on_sqlite.damaged),
    Trial("writer", "another program writes for 12 s", "short waits, reads go on", (LITE,), on_sqlite.external_writer),
    Trial("clock", "the clock jumps", "a key runs once, meshes stay", (LITE,), on_sqlite.clock),
    Trial("uploads", "the upload process is killed", "the next upload is read", (LITE,), on_processes.uploads),
    Trial("forker", "the fork server is killed, then stopped", "all goes on", (LITE,), on_processes.fork_server),
    Trial("log-pipe", "nobody reads the log", "it answers, and ends when told", (LITE,), on_processes.log_pipe),
    Trial("hostile", "31 hostile bodies at once", "99 % of /healthz within 50 ms", (LITE,), on_bodies.hostile),
    Trial("bodies", "hostile bodies, one by one", "0.2 s + twice, 50 MB + 20 times", ("none",), on_bodies.bodies),
    Trial("limits", "large requests, time_limit 5 s", "an answer within 7 s", (LITE,), on_processes.soft_limits),
)


def carried_out(trial: Trial, store: str) -> Finding:
    """One trial on one kind of store."""
    with ExitStack() as stack:
        folder = Path(stack.enter_context(tempfile.TemporaryDirectory(prefix="duocell-chaos-")))
        url = None
        if store == BIG:
            url = stack.enter_context(postgres.serving())
            migrate(url)
        try:
            return trial.run(Setup(folder / "data", url))
        except Exception as error:  # one trial less; the others count
            traceback.print_exc()
            return Finding(False, f"broke off: {error!r}"[:200])


def migrate(url: str) -> None:
    """Make the tables, with the sources that the servers run."""
    environment = os.environ | {"PYTHONPATH": str(SOURCES), "DUOCELL_DATABASE_URL": url}
    command = [sys.executable, "-m", "duocell.service.cli.main", "migrate"]
    subprocess.run(command, check=True, cwd=SOURCES, env=environment, stdout=subprocess.DEVNULL)


def main() -> int:
    """Carry out and print."""
    options = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    options.add_argument("--only", nargs="+", default=[], help="names of trials")
    options.add_argument("--list", action="store_true", help="name them, and nothing else")
    given = options.parse_args()
    chosen = [trial for trial in TRIALS if not given.only or trial.name in given.only]
    if given.list:
        print("\n".join(f"{trial.name}: {trial.fault}" for trial in chosen))
        return 0
    print("| fault | store | promised | seen | |\n|---|---|---|---|---|", flush=True)
    kept = True
    for trial in chosen:
        for store in trial.stores:
            found = carried_out(trial, store)
            kept = kept and found.kept
            mark = "kept" if found.kept else "**broken**"
            print(f"| {trial.fault} | {store} | {trial.promise} | {found.seen} | {mark} |", flush=True)
    return 0 if kept else 1


if __name__ == "__main__":
    raise SystemExit(main())
