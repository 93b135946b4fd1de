"""`duocell check`."""

from __future__ import annotations

import json
import sys
from datetime import UTC, datetime
from typing import Any

from duocell.models.base.errors import DuocellError
from duocell.service.cli.exit_codes import Exit
from duocell.service.cli.input import RobotUrdfs, complain, library_from, read
from duocell.service.cli.solve import check_writable, exit_code, show
from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.jobs.resources import solved_here
from duocell.service.requests.accept import accept_evaluation
from duocell.service.settings import Settings
from duocell.service.validation.strict_json import NotJson, parse

SLACK = 1e-9
"""m or rad, of the region of a base."""


def check(source: str, output: str | None, urdfs: RobotUrdfs) -> int:
    """Evaluate the layout in a file, print how good it is, write the answer if asked to."""
    try:
        check_writable(output)
        settings = Settings()
        library = library_from(settings.data_dir, urdfs)
        body = read(source)
        document = parse(body)
        if isinstance(document, dict) and isinstance(document.get("result"), dict):
            body = json.dumps(request_of(document)).encode()
        accepted = accept_evaluation(body, settings, library)
    except InvalidRequest as error:
        return complain(error.issues)
    except NotJson as error:
        return complain([Issue("", error.detail)])
    from duocell.service.workers.solving import evaluate_request

    created = datetime.now(UTC)
    try:
        result = evaluate_request(accepted.prepared, accepted.request_hash, library)
    except DuocellError as error:
        sys.stderr.write(f"failed: {error.detail}\n")
        return Exit.FAILED
    show(solved_here(accepted, result, created), output)
    return exit_code(result)


def request_of(resource: dict[str, Any]) -> dict[str, Any]:
    """The request to evaluate what a finished layout says: its bases and its joints.

    Raises:
        InvalidRequest: it is no complete layout, or a base stands outside of the region that was asked for.
    """
    try:
        request = resource["request"]
        placed = {arm["name"]: arm for arm in resource["result"]["arms"]}
        missing = [arm["name"] for arm in request["arms"] if arm["name"] not in placed]
        if missing:
            names = ", ".join(map(repr, missing))
            detail = f"The layout has no place for {names}. Only complete layouts can be checked."
            raise InvalidRequest([Issue("/result/arms", detail)])
        arms = [{**arm, **_placed(placed[arm["name"]])} for arm in request["arms"]]
        _check_regions(request["arms"], arms)
    except (KeyError, TypeError, ValueError) as error:
        raise InvalidRequest([Issue("", f"This is no complete layout ({type(error).__name__}: {error}).")]) from error
    return {**request, "arms": arms}


def _placed(placement: dict[str, Any]) -> dict[str, Any]:
    """What the layout says about an arm."""
    x, y, z = placement["base"]["position"]
    return {"base": {"x": x, "y": y, "z": z, "yaw": placement["base"]["yaw"]}, "joints": placement["joints"]}


def _check_regions(asked: list[dict[str, Any]], placed: list[dict[str, Any]]) -> None:
    """Refuse bases that are not where the request allows them."""
    issues = []
    for index, (arm, place) in enumerate(zip(asked, placed, strict=True)):
        for name, value in place["base"].items():
            allowed = arm["base"][name]
            low, high = allowed if isinstance(allowed, list) else (allowed, allowed)
            if not low - SLACK <= value <= high + SLACK:
                where = f"The base of {arm['name']!r} stands at {name} = {value:g}"
                detail = f"{where}; the request allows {low:g} to {high:g}. Correct one of them."
                issues.append(Issue(f"/result/arms/{index}/base", detail))
    if issues:
        raise InvalidRequest(issues)
