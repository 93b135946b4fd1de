"""`duocell solve`, and `duocell figure` and `duocell export`, which make files of what it found."""

from __future__ import annotations

import json
import sys
from pathlib import Path
from typing import Any

from duocell.models.base.errors import DuocellError
from duocell.service.cli.exit_codes import Exit
from duocell.service.cli.input import RobotUrdfs, complain, library_from, read
from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.exports.export import NothingToExport
from duocell.service.exports.exports import EXPORTS, export_of, exported
from duocell.service.requests.accept import accept
from duocell.service.settings import Settings
from duocell.service.validation.strict_json import NotJson, parse

BAD_REQUESTS = (400, 413, 415, 422)
"""Answers that blame the request."""
EXITS = {
    "optimal": Exit.SOLVED,
    "feasible": Exit.SOLVED,
    "infeasible": Exit.INFEASIBLE,
    "unknown": Exit.UNKNOWN,
}


def solve(
    source: str, output: str | None, urdfs: RobotUrdfs, time_limit: float | None, server: str | None = None
) -> int:
    """Solve the request in a file, here or at a server; print the layout, write the answer if asked to."""
    try:
        check_writable(output)
        resource = _here(source, urdfs, time_limit) if server is None else _there(server, source, urdfs, time_limit)
    except InvalidRequest as error:
        return complain(error.issues)
    except NotJson as error:
        return complain([Issue("", error.detail)])
    except ValueError as error:  # pydantic's ValidationError is one
        return complain([Issue("", f"settings: {error}")])
    except (DuocellError, Failed) as error:
        sys.stderr.write(f"failed: {error.detail}\n")
        return Exit.FAILED
    show(resource, output)
    code = exit_code(resource["result"])
    if server is None:
        from duocell.service.cli.local import leave

        leave(code)
    return code


def show(resource: dict[str, Any], output: str | None) -> None:
    """Print a layout, and write it if asked to."""
    from duocell.service.cli.printing.tables import print_layout

    text = json.dumps(resource, indent=1, allow_nan=False, ensure_ascii=False) + "\n"
    if output not in (None, "-"):  # before anything is printed: who reads that may have left
        Path(str(output)).write_text(text, encoding="utf-8")
    print_layout(resource, sys.stderr if output == "-" else sys.stdout)
    if output == "-":
        sys.stdout.write(text)


class Failed(Exception):
    """There is no layout, and the request is not to blame; ``detail`` says why."""

    def __init__(self, detail: str) -> None:
        super().__init__(detail)
        self.detail = detail


def _here(source: str, urdfs: RobotUrdfs, time_limit: float | None) -> dict[str, Any]:
    """Solve in this process."""
    from duocell.service.cli.local import solve_here
    from duocell.service.workers.executor import SolveFailed

    settings = Settings()
    if time_limit is not None:  # nobody else waits for this process
        settings = Settings(max_time_limit=max(settings.max_time_limit, time_limit))
    library = library_from(settings.data_dir, urdfs)
    accepted = accept(_limited(read(source), time_limit), settings, library)
    try:
        return solve_here(accepted, library)
    except SolveFailed as error:
        raise Failed(error.detail) from error


def _there(server: str, source: str, urdfs: RobotUrdfs, time_limit: float | None) -> dict[str, Any]:
    """Solve at a server."""
    import httpx2

    from duocell.service.cli.remote import Refused, solve_there

    if urdfs.options:
        raise InvalidRequest([Issue("", "--robot-urdf has no meaning for a server: it has its own. Leave it out.")])
    try:
        resource = solve_there(server, _limited(read(source), time_limit))
    except Refused as error:
        if error.status in BAD_REQUESTS:
            found = [Issue(entry["pointer"], entry["detail"]) for entry in error.problem.get("errors", [])]
            raise InvalidRequest(found or [Issue("", str(error))]) from error
        raise Failed(str(error)) from error
    except (httpx2.HTTPError, httpx2.InvalidURL) as error:
        raise Failed(f"{server} cannot be asked: {str(error) or type(error).__name__}.") from error
    if resource["status"] != "succeeded":
        raise Failed((resource["error"] or {"detail": f"The layout was {resource['status']}."})["detail"])
    return resource


def _limited(body: bytes, time_limit: float | None) -> bytes:
    """A request with another time limit [s], if one is given.

    Raises:
        NotJson: it is no JSON document.
    """
    if time_limit is None:
        return body
    document = parse(body)
    return json.dumps({**document, "time_limit": time_limit}).encode() if isinstance(document, dict) else body


def exit_code(result: dict[str, Any]) -> int:
    """What a result means; a layout that is all that the time allowed for has a code of its own."""
    cut = result["outcome"] == "feasible" and result["search"].get("ended") is False
    return Exit.CUT if cut else EXITS[result["outcome"]]


def figure(source: str, output: Path, urdfs: RobotUrdfs) -> int:
    """Draw the result in a file; the suffix of the drawing chooses its format."""
    name = f"floor_plan{output.suffix.lower()}"
    if export_of(name) is None:
        drawings = (each.name for each in EXPORTS if each.name.startswith("floor_plan."))
        suffixes = ", ".join(Path(drawing).suffix for drawing in drawings)
        return complain([Issue("", f"{output}: a drawing is one of {suffixes}.")])
    return export(source, name, str(output), urdfs)


def export(source: str, name: str, output: str | None, urdfs: RobotUrdfs) -> int:
    """Make one of the files of `duocell.service.exports` of the result in a file."""
    chosen = export_of(name)
    if chosen is None:
        names = ", ".join(each.name for each in EXPORTS)
        return complain([Issue("", f"There is no export {name!r}; there are {names}.")])
    try:
        check_writable(output)
        resource = parse(read(source))
        if not isinstance(resource, dict):
            raise NothingToExport("It holds no finished layout.")
        content = exported(chosen, resource, library_from(Settings().data_dir, urdfs))
    except InvalidRequest as error:
        return complain(error.issues)
    except NotJson as error:
        return complain([Issue("", error.detail)])
    except NothingToExport as error:
        return complain([Issue("/result", f"{source}: {error.detail} Write one with `duocell solve -o`.")])
    except KeyError as error:
        return complain([Issue("", f"{source} is no complete layout: {error} is missing.")])
    if output in (None, "-"):
        sys.stdout.buffer.write(content)
    else:
        Path(str(output)).write_bytes(content)
    return Exit.SOLVED


def check_writable(output: str | None) -> None:
    """Complain before the work rather than after it."""
    if output not in (None, "-") and not Path(str(output)).absolute().parent.is_dir():
        raise InvalidRequest([Issue("", f"{output} cannot be written: there is no such folder. Create it first.")])
