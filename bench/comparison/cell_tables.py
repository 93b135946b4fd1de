"""Tables of the real cells, as Markdown."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from bench.comparison.real_cells import CUT, BeamResult, CellResult

KINDS = {"open": "open: a layout is known", "cluttered": "cluttered: nobody knew", "blocked": "blocked on purpose"}


def summary(results: Sequence[CellResult]) -> str:
    """One row per kind of cell, and all."""
    head = "| cells | number | layouts | clean | refused | wrongly so | median time | 90 % within | CPU: median, 90 % |"
    rows = [head, "|---|---|---|---|---|---|---|---|---|"]
    groups = [(title, [r for r in results if r.kind == kind]) for kind, title in KINDS.items()]
    for title, some in [*groups, ("all", list(results))]:
        if some:
            answered = [r for r in some if r.answered]
            times, busy = [r.seconds for r in some], [r.cpu for r in some]
            rows.append(
                f"| {title} | {len(some)} | {len(answered)} | {sum(not r.faults for r in answered)} "
                f"| {len(some) - len(answered)} | {sum(r.contradicted for r in some)} "
                f"| {np.median(times):.2f} s | {np.percentile(times, 90):.2f} s "
                f"| {np.median(busy):.2f} s, {np.percentile(busy, 90):.2f} s |"
            )
    return "\n".join(rows)


def remarks(results: Sequence[CellResult]) -> str:
    """What went wrong or stayed undecided, and how hard the cells are; one line each."""
    lines = []
    free = [r for r in results if r.free is not None and r.kind == "open"]
    lines.append(
        f"- In {sum(bool(r.free) for r in free)} of {len(free)} open cells the layout that is best with nothing in the "
        "way touches something, has a base where none may be, or breaks a coupling."
    )
    pairs = [(r.objective, r.lattice) for r in results if r.objective is not None and r.lattice is not None]
    if pairs:
        worse = sum(own > 1.01 * lattice for own, lattice in pairs)
        ratio = np.median([own / lattice for own, lattice in pairs])
        lines.append(
            f"- {len(pairs)} answers could be compared with the first clean layout of the search, which goes from good "
            f"to bad: {worse} are more than 1 % worse than it, the median is {ratio:.2f} times its E."
        )
    for r in results:
        if r.faults:
            lines.append(f"- {r.name} ({' + '.join(r.robots)}): NOT CLEAN: {'; '.join(r.faults)}")
        if r.outcome == "ERROR":
            lines.append(f"- {r.name} ({' + '.join(r.robots)}): ended with {r.reasons[0]}")
        elif r.contradicted:
            lines.append(f"- {r.name} ({' + '.join(r.robots)}): refused, but there is a layout ({r.search})")
        if r.search == CUT:
            lines.append(f"- {r.name}: refused; the exhaustive search was not through after {r.search_seconds:.0f} s")
    return "\n".join(lines)


def beam(results: Sequence[BeamResult]) -> str:
    """The example with and without clearances."""
    rows = ["| the beam cell | time | E | dense check in the cell as it is |", "|---|---|---|---|"]
    for r in results:
        asked = "30 mm asked for" if r.clearance else "without clearances"
        objective = "–" if r.objective is None else f"{r.objective:.4g}"
        rows.append(f"| {asked} | {r.seconds:.2f} s | {objective} | {'; '.join(r.faults) or 'clean'} |")
    return "\n".join(rows)
