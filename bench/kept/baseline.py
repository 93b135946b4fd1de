"""Answers that must stay: ``python -m bench.kept.baseline --write DIR`` or ``--check DIR``.

A case is a file with a body, as it would be sent, and what became of it. Every body goes the way of the service:
accepted and solved, or evaluated, up to the document of the result; what is refused becomes a problem document.
Kept is what a user acts upon: words, objectives, bases, margins, reasons. Times, versions, counts of the search and
joint values are not, and a field that is new is no difference. ``--write`` answers the cases of a folder anew.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatch
from math import isclose
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

from duocell.models.base.errors import DuocellError
from duocell.service.common.issues import InvalidRequest
from duocell.service.common.problems import document
from duocell.service.http.error_handlers import as_problem
from duocell.service.library.library import Library
from duocell.service.requests.accept import accept, accept_evaluation
from duocell.service.settings import Settings
from duocell.service.uploads.urdf_on_disk import robot_on_disk
from duocell.service.validation.strict_json import NotJson
from duocell.service.workers.solving import evaluate_request, solve_request

ADDRESSES = {"layout": "/v1/layouts", "evaluation": "/v1/layouts/evaluate"}
OBJECTIVE = 1e-9
"""Relative; objectives are equal to this."""
OTHERS = 1e-4
"""Relative or absolute, whatever is larger: a base may move by the root of what its objective may."""
NOT_KEPT = frozenset(
    {
        *("version", "request_hash", "wall_time", "first_feasible_time", "candidates", "starts", "basins", "boxes"),
        *("iterations", "evaluations", "trace", "joints", "max_position_error", "max_orientation_error"),
    }
)
"""Fields that are left out wherever they stand."""
WHERE = frozenset({"pose", "fraction"})
"""Fields of a clearance that are left out: tools on one part are as far apart at all poses; rounding says at which."""
Report = Callable[[str], None]


@dataclass(frozen=True, slots=True)
class Case:
    """A body and its answer.

    Attributes:
        name: of the file, without its ending.
        kind: a key of `ADDRESSES`.
        robots: name -> URDF file beside the cases, of robots that no catalogue has; links ``base_link``, ``tool0``.
        body: what is sent; a string for what is no JSON document.
        answer: what is kept of the answer; None before the first one.
    """

    name: str
    kind: str
    robots: Mapping[str, str]
    body: Any
    answer: Any

    @property
    def sent(self) -> bytes:
        """The body as bytes."""
        return self.body.encode() if isinstance(self.body, str) else json.dumps(self.body).encode()


def cases(folder: Path, patterns: Sequence[str] = ("*",)) -> list[Case]:
    """The cases of a folder whose names fit, in the order of their names."""
    fitting = [path for path in sorted(folder.glob("*.json")) if any(fnmatch(path.stem, one) for one in patterns)]
    read = [(path.stem, json.loads(path.read_text(encoding="utf-8"))) for path in fitting]
    return [Case(name, one["kind"], one.get("robots", {}), one["body"], one.get("answer")) for name, one in read]


def answered(case: Case, folder: Path) -> Any:
    """What is to be kept of the answer that is given now.

    Args:
        case: what is asked.
        folder: where the robots of the case lie.
    """
    given = {
        name: robot_on_disk(name, folder / file, "base_link", "tool0", lambda _: None)
        for name, file in case.robots.items()
    }
    with TemporaryDirectory() as empty:
        library = Library(Path(empty), given=given, deleted=True)
        try:
            result = _carried_out(case, library)
        except (InvalidRequest, NotJson, DuocellError) as error:
            problem, status = as_problem(error)
            result = document(problem, ADDRESSES[case.kind], status)
    return json.loads(json.dumps(compared(result), allow_nan=False))


def differences(kept: Any, now: Any, place: str = "") -> Iterator[str]:
    """Where an answer of now is not the one that was kept; each with its JSON pointer."""
    if isinstance(kept, dict) and isinstance(now, dict):
        for name, value in kept.items():
            if name in now:
                yield from differences(value, now[name], f"{place}/{name}")
            else:
                yield f"{place}/{name} is missing"
    elif isinstance(kept, list) and isinstance(now, list) and len(kept) == len(now):
        for index, (old, new) in enumerate(zip(kept, now, strict=True)):
            yield from differences(old, new, f"{place}/{index}")
    elif not _same(kept, now, place.rpartition("/")[2]):
        yield f"{place}: {kept!r} became {now!r}"


def write(folder: Path, patterns: Sequence[str], say: Report) -> None:
    """Answer the cases of a folder and keep what comes."""
    for case in cases(folder, patterns):
        began = process_time()
        answer = answered(case, folder)
        fields = {"kind": case.kind, **({"robots": case.robots} if case.robots else {})}
        fields |= {"body": case.body, "answer": answer}
        lines = [f"{json.dumps(name)}: {json.dumps(value, ensure_ascii=False)}" for name, value in fields.items()]
        (folder / f"{case.name}.json").write_text("{\n" + ",\n".join(lines) + "\n}\n", encoding="utf-8")
        say(f"{process_time() - began:7.2f} s  {case.name}: {_word(answer)}")


def check(folder: Path, patterns: Sequence[str], say: Report) -> int:
    """How many cases are answered otherwise than they were."""
    failed = 0
    for case in cases(folder, patterns):
        began = process_time()
        found = list(differences(compared(case.answer), answered(case, folder)))
        failed += bool(found)
        say(f"{process_time() - began:7.2f} s  {case.name}: {'DIFFERS' if found else 'same'}")
        for one in found:
            say(f"           {one}")
    return failed


def main(arguments: Sequence[str] | None = None) -> int:
    """Write or check; 1 if any answer differs."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    what = parser.add_mutually_exclusive_group(required=True)
    what.add_argument("--write", type=Path, metavar="DIR", help="keep the answers that are given now")
    what.add_argument("--check", type=Path, metavar="DIR", help="compare them with those that were kept")
    parser.add_argument("patterns", nargs="*", default=["*"], help="names of cases, with * and ?")
    options = parser.parse_args(arguments)

    def say(line: str) -> None:
        print(line, flush=True)

    began = process_time()
    if options.write is not None:
        write(options.write, options.patterns, say)
        return 0
    asked = len(cases(options.check, options.patterns))
    failed = check(options.check, options.patterns, say)
    say(f"{asked - failed} of {asked} as they were, {process_time() - began:.0f} CPU s")
    return 1 if failed or not asked else 0


def _carried_out(case: Case, library: Library) -> dict[str, Any]:
    if case.kind == "evaluation":
        accepted = accept_evaluation(case.sent, Settings(), library)
        return evaluate_request(accepted.prepared, accepted.request_hash, library)
    accepted = accept(case.sent, Settings(), library)
    return solve_request(accepted.prepared, accepted.request_hash, accepted.time_limit, library)


def compared(value: Any) -> Any:
    """A document without what is not kept."""
    if isinstance(value, dict):
        left_out = NOT_KEPT | WHERE if value.keys() >= WHERE else NOT_KEPT
        return {name: compared(inner) for name, inner in value.items() if name not in left_out}
    return [compared(inner) for inner in value] if isinstance(value, (list, tuple)) else value


def _same(kept: Any, now: Any, field: str) -> bool:
    """Whether two values that hold no others are equal, numbers as far as they must be."""
    if isinstance(kept, bool) or isinstance(now, bool):
        return kept is now
    if isinstance(kept, (int, float)) and isinstance(now, (int, float)):
        if field == "objective":
            return isclose(kept, now, rel_tol=OBJECTIVE, abs_tol=OBJECTIVE)
        return isclose(kept, now, rel_tol=OTHERS, abs_tol=OTHERS)
    return bool(kept == now)


def _word(answer: Any) -> str:
    """A few words about an answer."""
    if "outcome" not in answer:
        return f"{answer['status']} {answer['code']}"
    value = "" if answer["objective"] is None else f"{answer['objective']:.6g}"
    return f"{answer['outcome']} {value}{'' if answer['search']['ended'] else ' CUT'}"


if __name__ == "__main__":
    raise SystemExit(main())
