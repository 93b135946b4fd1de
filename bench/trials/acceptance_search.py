"""The requests that were once answered wrongly: ``python -m bench.trials.acceptance_search [PATTERN ...]``.

Every request goes the way of the service into the optimizer; what is right stands in the README beside the requests.
Time limits are raised, so that a busy machine does not decide. Cases of one arm are asked twice, the first time without
a proof, because there the search alone must find the place; what a request asks of the proof is not asked here.
"""

from __future__ import annotations

import argparse
import json
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatch
from functools import cache
from pathlib import Path
from typing import Any

from bench.judges.dense_check import judge
from bench.kept.kept_requests import FOLDER, kept
from bench.trials.trial import WORSE, Answer, append, ask, table
from duocell.models.cell.cell import Cell
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings
from duocell.service.library.library import Library
from duocell.service.requests.accept import accept
from duocell.service.requests.convert import cell_of, settings_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Settings as ServiceSettings
from duocell.service.uploads.urdf_on_disk import robot_on_disk

PATIENT = 900.0
"""s of wall time that a case may take."""
IMPOSSIBLE = 2.0
"""s of CPU time within which it is said that no base can help."""
STATIONS, CUT = 394.6, 59.76
"""Objectives of ``stations_house`` and, with time, of ``time_cut_called_infeasible``, which name none."""
LINTEL = 29.0, 29.45
"""mm; remedies of ``door_cell_30mm`` that work and ask for no more than must be."""
REFUTED = {
    "cell_0_worse": "a base stands inside an obstacle",
    "cell_24_worse": "a base stands inside an obstacle",
    "cell_2_worse": "a base stands inside an obstacle",
    "cell_57_worse": "a base stands inside an obstacle",
    "coupling_23_rail": "an arm leaves its reach between two poses",
    "coupling_42_same_z": "a joint leaves its limits between two poses",
    "miss_thin_166": "the wrist passes its singularity between two poses",
}
"""Files whose known layout breaks a rule that holds now, found by `bench.searches.own_stands` and the dense check: an
objective above it is no fault, and what is the best is open."""
ALONE = "alone"
"""Mark of the cases that are asked without a proof."""


@dataclass(frozen=True, slots=True)
class Case:
    """A request to be answered.

    Attributes:
        name: of the file, with what is special about the way it is asked here. cell: of the request.
        settings: the request's, with more time. known: objective that is possible; None where none is known.
    """

    name: str
    cell: Cell
    settings: Settings
    known: float | None

    @property
    def file(self) -> str:
        """Name of the file without its ending."""
        return self.name.split()[0]


Rule = Callable[[Case, Answer], str]
"""What is wrong with an answer; empty if nothing is."""


def names() -> list[str]:
    """All cases, in the order of their names."""
    return [name for file in sorted(FOLDER.glob("*.json")) for name in _ways(file.stem)]


@cache
def case(name: str) -> Case:
    """A case, read as the service reads it."""
    stem, _, way = name.partition(" ")
    read = kept(stem)
    library = _library()
    accepted = accept(json.dumps(read["request"]).encode(), ServiceSettings(), library)
    request = LayoutRequest.model_validate_json(accepted.text)
    settings = replace(settings_of(request, PATIENT), time_limit=PATIENT, certificate=None if way == ALONE else "auto")
    if stem == "door_cell_30mm":
        settings = replace(settings, explain=True)
    if way.endswith("s"):
        settings = replace(settings, time_limit=float(way.removesuffix("s")))
    return Case(name, cell_of(request, library), settings, _known(stem, read))


def wrong(one: Case, answer: Answer) -> str:
    """What is wrong with the answer to a case; empty if it is right."""
    if answer.layout is None:
        return answer.detail
    return next(rule for pattern, rule in RULES if fnmatch(one.name, pattern))(one, answer)


def main(arguments: Sequence[str] | None = None) -> int:
    """Ask, print a line for each case and the table of all of them."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("patterns", nargs="*", default=["*"], help="names of cases, with * and ?")
    parser.add_argument("--file", type=Path, metavar="PATH", help="where to keep the records")
    options = parser.parse_args(arguments)
    rows = []
    for name in names():
        if any(fnmatch(name, pattern) for pattern in options.patterns):
            rows.append(_asked(name, options.file))
            print(
                "  ".join(f"{value:.6g}" if isinstance(value, float) else str(value) for value in rows[-1]), flush=True
            )
    print(table(["case", "", "word", "objective", "known", "ratio", "CPU s", "what is wrong"], rows))
    counts = {word: sum(row[1] == word for row in rows) for word in ("right", "open", "wrong")}
    print(", ".join(f"{number} {word}" for word, number in counts.items()))
    return 1 if counts["wrong"] else 0


def _asked(name: str, file: Path | None) -> list[Any]:
    """The row of a case."""
    one = case(name)
    answer = ask(one.cell, one.settings)
    fault = wrong(one, answer)
    append(file, {"case": name, "fault": fault, "known": one.known, **answer.record})
    said = ("open" if one.file in REFUTED else "wrong") if fault else "right"
    ratio = None if answer.objective is None or one.known is None else f"{answer.objective / one.known:.5f}"
    return [name, said, answer.word, answer.objective, one.known, ratio, answer.cpu, fault[:160]]


def _ways(stem: str) -> Iterator[str]:
    """The cases of a file."""
    if stem.startswith("miss_"):
        yield f"{stem} {ALONE}"
    if stem == "time_cut_called_infeasible":
        yield f"{stem} 3s"
    yield stem


@cache
def _library() -> Library:
    """With the one robot that is no robot of the catalogue."""
    robot = robot_on_disk("probe6", FOLDER / "probe6.urdf", "base_link", "tool0", lambda _: None)
    return Library(ServiceSettings().data_dir, given={"probe6": robot}, deleted=True)


def _known(stem: str, read: dict[str, Any]) -> float | None:
    known = read.get("known")
    given = {"stations_house": STATIONS, "time_cut_called_infeasible": CUT}.get(stem)
    return known.get("objective", given) if isinstance(known, dict) else given


def _not_worse(one: Case, answer: Answer) -> str:
    """A layout, and where an objective is known, not more than 0.1 % above it."""
    if answer.objective is None:
        return f"no layout: {answer.detail}"
    if one.known is not None and answer.objective > one.known * (1.0 + WORSE):
        return f"{100.0 * (answer.objective / one.known - 1.0):.3g} % above what is known"
    return ""


def _followed(one: Case, answer: Answer) -> str:
    """No layout, or one whose way the dense check can go."""
    if answer.layout is None or not answer.layout.usable:
        return ""
    lost = judge(one.cell, answer.layout).lost
    return f"cannot be followed: {lost}" if lost else ""


def _no_layout(_: Case, answer: Answer) -> str:
    return f"a layout where none is possible, called {answer.word}" if answer.objective is not None else ""


def _impossible(_: Case, answer: Answer) -> str:
    """Proved, soon, with a number."""
    if answer.word != "infeasible":
        return f"called {answer.word}"
    if answer.cpu > IMPOSSIBLE:
        return "late"
    reasons = [] if answer.layout is None else answer.layout.reasons
    return "" if any(reason.amount is not None for reason in reasons) else "no largest distance"


def _lintel(_: Case, answer: Answer) -> str:
    """No layout, and the clearance that is possible among the remedies."""
    if answer.word not in ("infeasible", "unknown"):
        return f"called {answer.word}"
    told = " ".join(_remedies(answer.layout))
    numbers = [float(value) * (1e3 if unit == "m" else 1.0) for value, unit in re.findall(r"([\d.]*\d) (mm|m)\b", told)]
    return "" if any(LINTEL[0] <= value <= LINTEL[1] for value in numbers) else f"remedies: {told}"


def _blocked_by(body: str, words: Sequence[str]) -> Rule:
    """An explanation that names ``body`` and a remedy."""

    def rule(_: Case, answer: Answer) -> str:
        if answer.word not in words:
            return f"called {answer.word}"
        explanation = None if answer.layout is None else answer.layout.explanation
        if explanation is None:
            return "no explanation"
        if not any(body in member for member in explanation.blocking):
            return f"{body} is not among {', '.join(explanation.blocking)}"
        return "" if explanation.relaxations else "no remedy"

    return rule


def _not_infeasible(_: Case, answer: Answer) -> str:
    return "called infeasible" if answer.word == "infeasible" else ""


def _remedies(layout: Layout | None) -> list[str]:
    explanation = None if layout is None else layout.explanation
    return [] if explanation is None else [remedy.what for remedy in explanation.relaxations]


RULES: tuple[tuple[str, Rule], ...] = (
    ("between_*", _followed),
    ("bolted_*", _no_layout),
    ("self_*", _impossible),
    ("door_cell_30mm", _lintel),
    ("explain_wrong_3", _blocked_by("floor", ("infeasible",))),
    ("explain_wrong_15", _blocked_by("wall", ("infeasible", "unknown"))),
    ("time_cut_*s", _not_infeasible),
    ("*", _not_worse),
)
"""The first one that fits the name of a case holds. ``time_cut_called_infeasible`` without its 3 s is a plain case."""


if __name__ == "__main__":
    raise SystemExit(main())
