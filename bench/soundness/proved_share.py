"""What is proved of the real cells: ``python -m bench.soundness.proved_share``.

Numbers 0 to 99 are the hundred of `bench.draws.cells`, 100 is the beam, 101 the door cell.
Every cell is asked with a certificate: gap 1 %, some seconds. CPU time is shared out between search and proof as wall
time was. A "no" is held against the layout that a cell was drawn around, or against `bench.judges.exhaustive`; so is
silence.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from bench.comparison.real_cells import energy
from bench.comparison.tasks import thesis_line
from bench.draws.cells import RealCell
from bench.draws.known_cells import DOOR, numbered_cell
from bench.judges.dense_check import dense_check, judge
from bench.judges.exhaustive import exhaustive
from bench.searches.own_arm import own_arm
from bench.searches.own_stands import wrist_angles
from bench.trials import trial
from bench.trials.trial import Answer, Record, add_options, ask, options_from, run, table
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import SINGULAR_WRIST
from duocell.optimizer.settings import CertificateSettings, Settings

GAP, LIMIT, SEARCH_LIMIT = 0.01, 10.0, 60.0
"""Relative gap, s of a proof, and s of the exhaustive search of a cell whose answer is a "no" or none."""
STEPS = 2e-3, 0.01
"""m and rad; steps of the dense check."""


def main(arguments: list[str] | None = None) -> int:
    """Run the trial."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    add_options(parser, DOOR + 1)
    parser.add_argument("--limit", type=float, default=LIMIT, metavar="S", help="wall time of a proof; 10 s")
    parser.add_argument("--cpu", action="store_true", help="limits are CPU time: for a machine that is busy otherwise")
    given = parser.parse_args(arguments)
    if given.cpu:
        for clock in (time, trial):
            vars(clock)["perf_counter"] = time.process_time
    ask(thesis_line(10))  # what is made once is not the first cell's
    print(summary(run(options_from(given), lambda number: attempt(numbered_cell(number), given.limit), say)))
    return 0


def attempt(real: RealCell, limit: float = LIMIT, search_limit: float = SEARCH_LIMIT) -> Record:
    """One cell: answer, proof, and what speaks against it.

    Args:
        real: the cell.
        limit: s of the proof. search_limit: s of the exhaustive search, where there is no layout.
    """
    settings = Settings(time_limit=120.0, certificate=CertificateSettings(GAP, limit))
    answer = ask(real.cell, settings)
    record = answer.record | {"name": real.name, "kind": real.kind} | _proof(answer)
    record["ties"] = [tie.kind for tie in real.cell.couplings]
    record["robots"] = [arm.robot.name for arm in real.cell.arms]
    record["known"] = known_objective(real)
    record["faults"] = []
    if answer.layout is not None and answer.objective is not None:
        record["faults"] = judge(real.cell, answer.layout, *STEPS).faults
    elif record["known"] is None and real.kind != "blocked":
        found = exhaustive(real.cell, search_limit).layout
        record["known"] = (
            None if found is None or not keeps_wrists(real.cell, found.joints) else energy(real.cell, found)
        )
    return record


def _proof(answer: Answer) -> Record:
    """Bound, gap, boxes and CPU time of the proof, and the bounds of the arms by themselves."""
    found = None if answer.layout is None else answer.layout.certificate
    if found is None:
        none = dict.fromkeys(("bound", "gap", "boxes"))
        return none | {"search_cpu": answer.cpu, "proof_cpu": 0.0, "ended": True, "alone": [], "notes": []}
    proof = answer.cpu * min(found.wall_time / max(answer.seconds, 1e-9), 1.0)
    return {
        "bound": found.lower_bound,
        "gap": found.gap,
        "boxes": found.boxes,
        "search_cpu": answer.cpu - proof,
        "proof_cpu": proof,
        "ended": found.ended,
        "alone": [arm.lower_bound for arm in found.arms],
        "notes": [arm.note for arm in found.arms],
    }


def known_objective(real: RealCell) -> float | None:
    """E of the layout that a cell was drawn around, if it keeps today's rules."""
    if real.known is None or not keeps_wrists(real.cell, real.known.joints):
        return None
    clean = dense_check(real.cell, real.known.stands, real.known.joints, *STEPS).clean
    return energy(real.cell, real.known) if clean else None


def keeps_wrists(cell: Cell, joints: tuple[np.ndarray, ...]) -> bool:
    """True if no wrist is nearer to its singularity than an arm that avoids it may come."""
    for arm, path in zip(cell.arms, joints, strict=True):
        own = own_arm(arm.robot)
        if arm.avoid_singularities and own is not None and float(wrist_angles(own, path).min()) < SINGULAR_WRIST:
            return False
    return True


# --- what is said -----------------------------------------------------------------------------------------------------


def verdict(record: Record) -> str:
    """What is wrong with an answer; "" if nothing."""
    if record["word"] == "error":
        return f"ERROR {record['detail']}"
    if record["objective"] is None and record["known"] is not None:
        return "WRONG NO" if record["word"] == "infeasible" else "UNKNOWN"
    if record["kind"] == "blocked" and record["objective"] is not None:
        return "BLOCKED, YET A LAYOUT"
    if record["bound"] is not None and record["known"] is not None and record["bound"] > record["known"] * (1 + 1e-6):
        return f"BOUND ABOVE A LAYOUT OF {record['known']:.6g}"
    return "; ".join(record["faults"])


def limits(record: Record) -> str:
    """What keeps a proof from its end."""
    if record["word"] == "unknown":
        return "no layout is found, and the boxes that are left may hold one" + _cut(record)
    if record["bound"] is None:
        return next((note for note in record["notes"] if note), "no bound")
    bounds = record["alone"]
    if not bounds or None in bounds:
        return "bounds of single arms are missing" + _cut(record)
    alone, objective = float(sum(bounds)), record["objective"]
    shares = f"arms alone {alone:.5g}, together {record['bound']:.5g} of {objective:.5g}"
    ties = f", tied by {' and '.join(record['ties'])}" if record["ties"] else ""
    return shares + ties + _cut(record)


def _cut(record: Record) -> str:
    return "; cut by time" if not record["ended"] else "; nothing left to split"


def say(record: Record) -> str:
    """One line about a record."""
    values = f"E {_number(record['objective'])} bound {_number(record['bound'])} gap {_share(record['gap'])}"
    times = f"{record['boxes'] or 0:6d} boxes, CPU {record['search_cpu']:5.2f} + {record['proof_cpu']:5.2f} s"
    return f"{record['name']:9} {record['kind']:9} {record['word']:10} {values:48} {times}  {verdict(record)}"


def has_layout(record: Record) -> bool:
    """True if a layout of the cell is known."""
    return record["objective"] is not None or record["known"] is not None or record["name"].endswith("cell")


def summary(records: list[Record]) -> str:
    """Shares, times, cells that are open and what went wrong."""
    some, none = [r for r in records if has_layout(r)], [r for r in records if not has_layout(r)]
    proved, no = [r for r in some if r["word"] == "optimal"], [r for r in none if r["word"] == "infeasible"]
    quick = [r for r in proved if r["proof_cpu"] <= LIMIT]
    share = len(proved) / max(len(some), 1)
    closed = (
        f"CPU s, median: search {_median(some, 'search_cpu')}, proof {_median(proved, 'proof_cpu')} where it closed"
    )
    most = max((r["cpu"] for r in no), default=0.0)
    times = f"CPU s, median and most: whole answer {_median(no, 'cpu')}, {most:.2f}"
    lines = [
        f"with a layout: {len(some)}, optimal {len(proved)} ({share:.1%}), {len(quick)} of them within {LIMIT:g} CPU s",
        closed,
        f"without: {len(none)}, infeasible {len(no)}; {times}, of it proof by boxes {_median(no, 'proof_cpu')}",
    ]
    still = [r for r in records if r["word"] not in ("optimal", "infeasible")]
    rows = [[r["name"], r["word"], _share(r["gap"]), r["boxes"], r["proof_cpu"], limits(r)] for r in still]
    lines += ["", table(["open", "word", "gap", "boxes", "CPU s", "what limits it"], rows)] if rows else []
    wrong = [f"- {r['name']} {r['word']}: {verdict(r)}" for r in records if verdict(r)]
    return "\n".join([*lines, "", "wrong: " + ("nothing" if not wrong else ""), *wrong])


def _median(records: list[Record], key: str) -> str:
    return f"{np.median([r[key] for r in records]):.3g}" if records else "-"


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.6g}"


def _share(value: float | None) -> str:
    return "-" if value is None else f"{100.0 * value:.2f} %"


if __name__ == "__main__":
    raise SystemExit(main())
