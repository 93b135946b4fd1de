"""`duocell solve` and `duocell figure`."""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import Future
from contextlib import nullcontext
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from models.errors import DuocellError
from models.robot import Robot
from service.accept import Accepted, accept
from service.cli import Exit
from service.cli_input import complain, read, robots_from
from service.issues import InvalidRequest, Issue
from service.pool import limit_threads
from service.resources import timestamp
from service.settings import Settings
from service.strict_json import NotJson, parse

EXITS = {"optimal": Exit.SOLVED, "feasible": Exit.CUT, "infeasible": Exit.INFEASIBLE}

Progress = Callable[[str, float], None]


def solve(source: str, output: str | None, urdfs: Sequence[str], time_limit: float | None) -> int:
    """Solve the request in a file, print the layout, write the answer if asked to."""
    try:
        settings = Settings() if time_limit is None else Settings(time_limit=time_limit)
        check_writable(output)
        robots = robots_from(urdfs)
        accepted = accept(read(source), settings, robots)
    except InvalidRequest as error:
        return complain(error.issues)
    except NotJson as error:
        return complain([Issue("", error.detail)])
    except ValueError as error:  # pydantic's ValidationError is one
        return complain([Issue("", f"settings: {error}")])
    created = datetime.now(UTC)
    try:
        result = _run(accepted, settings.time_limit + accepted.certificate_time, robots)
    except DuocellError as error:
        sys.stderr.write(f"failed: {error.detail}\n")
        return Exit.FAILED
    show(accepted, result, created, output)
    return exit_code(result)


def show(accepted: Accepted, result: dict[str, Any], created: datetime, output: str | None) -> None:
    """Print a result, and write it if asked to."""
    from service.cli_tables import print_layout

    resource = {
        "name": accepted.name,
        "status": "succeeded",
        "created_at": timestamp(created),
        "request": json.loads(accepted.text),
        "result": result,
    }
    text = json.dumps(resource, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    print_layout(resource, sys.stderr if output == "-" else sys.stdout)
    if output == "-":
        sys.stdout.write(text)
    elif output is not None:
        Path(output).write_text(text, encoding="utf-8")


def exit_code(result: dict[str, Any]) -> int:
    """What a result means; one without a layout because time ran out says nothing about feasibility."""
    cut = any(reason["kind"] == "limit_reached" for reason in result["reasons"])
    return Exit.CUT if cut else EXITS[result["outcome"]]


def figure(source: str, output: Path, urdfs: Sequence[str]) -> int:
    """Draw the result in a file."""
    from service.figure import write_figure

    try:
        check_writable(str(output))
        resource = parse(read(source))
        if not isinstance(resource, dict) or not isinstance(resource.get("result"), dict):
            raise InvalidRequest(
                [Issue("/result", f"{source} holds no finished layout. Write one with `duocell solve -o`.")]
            )
        write_figure(resource, output, robots_from(urdfs))
    except InvalidRequest as error:
        return complain(error.issues)
    except NotJson as error:
        return complain([Issue("", error.detail)])
    except KeyError as error:
        return complain([Issue("", f"{source} is no complete layout: {error} is missing.")])
    except ValueError as error:
        return complain([Issue("", f"{output}: {error}")])
    return Exit.SOLVED


def check_writable(output: str | None) -> None:
    """Complain before the work rather than after it."""
    if output not in (None, "-") and not Path(str(output)).absolute().parent.is_dir():
        raise InvalidRequest([Issue("", f"{output} cannot be written: there is no such folder. Create it first.")])


def _run(accepted: Accepted, time_limit: float, robots: Mapping[str, Robot]) -> dict[str, Any]:
    """Solve in a thread: an engine deep in its own code keeps no signal handler from running here."""
    limit_threads()
    answer: Future[dict[str, Any]] = Future()
    with _bar() as progress:

        def work() -> None:
            try:
                from service.solving import solve_request

                result = solve_request(accepted.text, accepted.request_hash, time_limit, robots, progress)
            except BaseException as error:  # it is raised again by the thread that waits
                answer.set_exception(error)
            else:
                answer.set_result(result)

        threading.Thread(target=work, daemon=True).start()
        try:
            return answer.result()
        except KeyboardInterrupt:
            sys.stderr.write("interrupted\n")
            sys.stderr.flush()
            os._exit(Exit.INTERRUPTED)  # the solve cannot be stopped from outside; nothing is left to tidy up


def _bar() -> Any:
    """A progress bar on a terminal, nothing elsewhere."""
    if not sys.stderr.isatty():
        return nullcontext()
    from service.cli_progress import bar

    return bar()
