"""Large requests with random options and a time limit of 5 s: does each end in time, with the best that is known?

    python -m bench.trials.large_requests [--count 200] [--first 0] [--seconds S] [--file PATH] [--cpu]

Each takes the way of a job over HTTP: accepted as JSON, solved in a worker process, told to stop one second after its
soft limits and ended if it does not listen. What counts is the time from the hand-over to the answer beyond all soft
limits of the request: its `time_limit`, the time of a certificate of its own, and as much again for each explanation
and baseline. Where something else kept the machine busy, the CPU time of the worker counts.

With `--cpu` all limits are those of the worker's CPU time, as on a machine that does nothing else, and no worker is
ended: what counts is when the solve ends by itself.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import os
import sys
import tempfile
import threading
import time
from collections.abc import Iterable, Sequence
from pathlib import Path
from time import perf_counter
from typing import Any

from bench.draws.large_draw import large_request, meshes
from bench.trials.trial import Options, Record, add_options, options_from, run, table
from duocell.optimizer.monitoring.watch import ending
from duocell.service.common.issues import InvalidRequest
from duocell.service.library.library import Library
from duocell.service.requests.accept import Accepted, accept
from duocell.service.settings import Limits, Settings
from duocell.service.workers import worker
from duocell.service.workers.answer import Answer
from duocell.service.workers.executor import SolveFailed, Task
from duocell.service.workers.pool import ProcessExecutor

COUNT = 200
LATE = 2.0
"""s beyond the soft limits after which a request counts as a miss."""
PATIENCE = 600.0
"""s of the clock for a request whose limits are those of CPU time."""
LOOKED_AT = (0.1, 0.6, 1.1, 1.9, 3.0, 5.0)
"""s beyond the soft limits at which it is noted what a solve is doing."""
TICK = 1.0 / os.sysconf("SC_CLK_TCK")
OURS = ("/models/", "/optimizer/", "/service/")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the trial; 1 if a request ended too late or without an answer."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, COUNT)
    parser.add_argument("--cpu", action="store_true", help="limits are those of CPU time; nobody ends a solve")
    given = parser.parse_args(arguments)
    records = measured(options_from(given), given.cpu)
    print(summary(records))
    return 1 if any(is_miss(record) for record in records) else 0


def measured(options: Options, cpu: bool) -> list[Record]:
    """The records of the requests asked for; ``cpu``: limits are those of CPU time."""
    with tempfile.TemporaryDirectory() as name, asyncio.Runner() as runner:
        trial = Trial(Path(name), cpu)
        runner.run(trial.executor.ready())
        try:
            return run(options, lambda seed: runner.run(trial.attempt(seed)), line_of)
        finally:
            runner.run(trial.executor.stop())


class Trial:
    """Workers over a folder that holds the meshes and takes notes of what is late."""

    def __init__(self, folder: Path, cpu: bool) -> None:
        self.folder, self.cpu = folder, cpu
        self.library = Library(folder)
        for name, document in meshes().items():
            self.library.mesh_store.put(name, document)
        self.executor = ProcessExecutor(1, folder, solve=alone_solve if cpu else noted_solve)

    async def attempt(self, seed: int) -> Record:
        """One request."""
        body = json.dumps(large_request(seed, Limits())).encode()
        began = perf_counter()
        try:
            accepted = accept(body, Limits(), self.library)
        except InvalidRequest as error:
            return {"word": "refused", "detail": str(error.issues[0])[:200], "over": None, "cpu_over": None}
        acceptance = perf_counter() - began
        soft = (accepted.time_limit + accepted.certificate_time) * accepted.runs
        (self.folder / LATE_NOTES).write_text(json.dumps([]))
        (self.folder / SOFT).write_text(f"{soft} {seed}")
        began = perf_counter()
        answer, cpu = await self._solved(accepted, soft)
        seconds = perf_counter() - began
        return {
            **what_was_asked(accepted, len(body)),
            **what_came(answer),
            "acceptance": acceptance,
            "seconds": seconds,
            "cpu": cpu,
            "soft": soft,
            "over": seconds - soft,
            "cpu_over": cpu - soft,
            "late_in": json.loads((self.folder / LATE_NOTES).read_text()),
        }

    async def _solved(self, accepted: Accepted, soft: float) -> tuple[Answer, float]:
        """The answer, and the CPU time [s] of the process that made it."""
        before = {one.pid: cpu_of(one.pid) for one in self.executor.workers}
        most = PATIENCE if self.cpu else soft + Settings().grace
        task = Task(accepted.prepared, accepted.request_hash, accepted.time_limit, most)
        solving = asyncio.create_task(self.executor.solve(task, lambda kind, data: None))
        spent = 0.0
        while not solving.done():
            await asyncio.wait({solving}, timeout=0.05)
            now = [cpu_of(pid) - was for pid, was in before.items()]
            spent = max(spent, *now)
        try:
            return solving.result(), spent
        except SolveFailed as error:
            return Answer(None, code=error.code, detail=error.detail), spent


LATE_NOTES, SOFT = "late.json", "soft"


def alone_solve(text: str, request_hash: str, time_limit: float, data_dir: Path) -> Answer:
    """`noted_solve` by the clock of this process, which stands still while others work; told to stop by it, too."""
    time.perf_counter = time.process_time
    soft = float((data_dir / SOFT).read_text().split()[0])
    with ending(time.perf_counter() + soft + Settings().grace):
        return noted_solve(text, request_hash, time_limit, data_dir)


def noted_solve(text: str, request_hash: str, time_limit: float, data_dir: Path) -> Answer:
    """`worker.solve`, with a thread beside it that notes what is being done when it is late."""
    threading.Thread(target=_note, args=(data_dir, threading.get_ident()), daemon=True).start()
    return worker.solve(text, request_hash, time_limit, data_dir)


def _note(folder: Path, solver: int) -> None:
    began, notes = time.perf_counter(), []
    told = (folder / SOFT).read_text()
    soft = float(told.split()[0])
    for late in LOOKED_AT:
        while (left := soft + late - (time.perf_counter() - began)) > 0.0:
            time.sleep(min(left, 0.2))
        frame, places = sys._current_frames().get(solver), []
        while frame is not None:
            if any(room in frame.f_code.co_filename for room in OURS):
                path = Path(frame.f_code.co_filename)
                places.append(f"{path.parent.name}/{path.stem}.{frame.f_code.co_name}:{frame.f_lineno}")
            frame = frame.f_back
        if not any("worker.solve" in place for place in places) or (folder / SOFT).read_text() != told:
            return  # it has ended, or this is the next one
        notes.append(places[:8])
        (folder / LATE_NOTES).write_text(json.dumps(notes))


def cpu_of(pid: int | None) -> float:
    """CPU time [s] of a process so far; 0 where it is gone."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    except OSError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) * TICK


def what_was_asked(accepted: Accepted, size: int) -> Record:
    """The sizes and options of a request."""
    request: dict[str, Any] = json.loads(accepted.text)
    return {
        "bytes": size,
        "arms": len(request["arms"]),
        "obstacles": len(request["obstacles"]),
        "couplings": len(request["coupling"]),
        "jobs": len(request["tasks"] or [0]),
        "poses": sum(map(_poses, [job["task"] for job in request["tasks"] or []] or [request["task"]])),
        "part": 0 if request["part"] is None else len(request["part"]["shapes"]),
        "tool": max(len(arm["tool_shapes"]) for arm in request["arms"]),
        "options": [
            name for name in ("explain", "tolerance", "alternatives", "baselines", "certificate") if request[name]
        ],
    }


def _poses(task: dict[str, Any]) -> int:
    return int(len(task["poses"]) if "poses" in task else task["line"]["count"])


def what_came(answer: Answer) -> Record:
    """The answer, briefly."""
    if answer.text is None:
        return {"word": f"failed: {answer.code}", "detail": answer.detail[:200], "ended_by": answer.code}
    result = json.loads(answer.text)
    reasons = [reason["detail"] for reason in result["reasons"]]
    return {
        "word": result["outcome"],
        "objective": result["objective"],
        "ended_by": answer.ended_by,
        "first": result["search"]["first_feasible_time"],
        "detail": reasons[0][:200] if reasons else "",
        "cut": any("ended the solve" in reason for reason in reasons),
        "placed": len(result["arms"]),
    }


def is_miss(record: Record) -> bool:
    """Whether a request has no answer, or a late one by the clock and by the processor."""
    if record["over"] is None:
        return False
    return bool(record["word"].startswith("failed") or min(record["over"], record["cpu_over"]) > LATE)


def line_of(record: Record) -> str:
    """One record on the terminal."""
    if record["over"] is None:
        return f"{record['seed']}: refused: {record['detail']}"
    late = " < ".join(record["late_in"][-1][:4]) if record["late_in"] else ""
    return (
        f"{record['seed']}: {record['arms']} arms {record['poses']} poses {record['obstacles']} obstacles: "
        f"{record['word']} ({record['ended_by']}{', cut' if record.get('cut') else ''}), {record['seconds']:.2f} s for "
        f"{record['soft']:.1f} s, CPU {record['cpu']:.2f} s {late}"
    )


def summary(records: Iterable[Record]) -> str:
    """How many ended how, and how late the latest was."""
    asked = [record for record in records if record["over"] is not None]
    words = sorted({record["word"] for record in asked})
    rows = [
        (
            word,
            len(some := [record for record in asked if record["word"] == word]),
            sum(record["ended_by"] == "time-limit" for record in some),
            sum(bool(record.get("cut")) for record in some),
            max(record["over"] for record in some),
            sum(is_miss(record) for record in some),
        )
        for word in words
    ]
    head = ("answer", "requests", "ended by the time limit", "by the service", "latest [s beyond the limits]", "misses")
    return table(head, rows)


if __name__ == "__main__":
    sys.exit(main())
