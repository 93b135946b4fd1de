"""duocell on the real cells: every answer judged by the dense check, every refusal by an exhaustive search."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import radians
from time import perf_counter, process_time

import numpy as np

from bench.draws.beam import beam_cell
from bench.draws.cell_draw import Known
from bench.draws.cells import RealCell
from bench.judges.dense_check import dense_check, judge
from bench.judges.exhaustive import exhaustive
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.settings import Settings

COARSE = 0.02, radians(5.0)
"""m and rad; steps of the look at free optima, where no verdict hangs on a millimetre."""
KNOWN, FOUND, NONE, CUT = "known layout", "layout found", "none on the lattice", "time ran out"


@dataclass(slots=True)
class CellResult:
    """All about one cell.

    Attributes:
        name, kind, why: of the cell (`bench.draws.cells.RealCell`). robots: of the arms. poses, obstacles: their
        numbers.
        couplings: contract words. outcome: of duocell, or the error it ended with. proved: as claimed.
        seconds: wall time of one `optimize`, the first one of this cell: compiling included. cpu: CPU seconds of it.
        objective: E, or None. faults: by the dense check. reasons: given for a refusal.
        free: faults of the layout that duocell finds if nothing is in the way; None if there is none.
        search: what is known or the exhaustive search says of a layout ("" if nobody was asked).
        lattice: E of the layout that the search found, or None. search_seconds: it took.
    """

    name: str
    kind: str
    why: str
    robots: list[str]
    poses: int
    obstacles: int
    couplings: list[str]
    outcome: str = ""
    proved: bool = False
    seconds: float = 0.0
    cpu: float = 0.0
    objective: float | None = None
    faults: list[str] = field(default_factory=list)
    reasons: list[str] = field(default_factory=list)
    free: list[str] | None = None
    search: str = ""
    lattice: float | None = None
    search_seconds: float = 0.0

    @property
    def answered(self) -> bool:
        """True if duocell gave a layout."""
        return self.objective is not None

    @property
    def contradicted(self) -> bool:
        """True if duocell gave none though there is one."""
        return not self.answered and self.search in (KNOWN, FOUND)

    def row(self) -> str:
        """One line for the terminal."""
        what = f"E {self.objective:.5g}" if self.objective is not None else f"refused; search: {self.search}"
        wrong = "; ".join([*self.faults, *(["CONTRADICTED"] if self.contradicted else [])])
        arms = " + ".join(self.robots)
        return f"{self.name} {self.kind:9} {arms:27} {self.outcome:10} {self.seconds:6.2f} s  {what}  {wrong}"


def run_cell(real: RealCell, search_limit: float, compare: bool, settings: Settings | None = None) -> CellResult:
    """One cell: solve, judge, and if there is no answer, look for one.

    Args:
        real: the cell.
        search_limit: s, for an exhaustive search.
        settings: of duocell.
        compare: search even if there is an answer, to see how good it is.
    """
    cell = real.cell
    result = CellResult(
        real.name,
        real.kind,
        real.why,
        [arm.robot.name for arm in cell.arms],
        len(cell.task),
        len(cell.surroundings.obstacles),
        [tie.kind for tie in cell.couplings],
    )
    began, busy = perf_counter(), process_time()
    layout = _solve(cell, settings or Settings(), result)
    result.seconds, result.cpu = perf_counter() - began, process_time() - busy
    if layout is not None and layout.objective is not None:
        result.objective = layout.objective
        result.faults = judge(cell, layout).faults
    if compare or not result.answered:
        _search(real, search_limit, result)
    result.free = free_faults(cell)
    return result


def _solve(cell: Cell, settings: Settings, result: CellResult) -> Layout | None:
    """The answer; an error is noted and counts as none."""
    try:
        layout = optimize(cell, settings)
    except Exception as error:
        result.outcome, result.reasons = "ERROR", [f"{type(error).__name__}: {error}"]
        return None
    result.outcome, result.proved = layout.outcome.value, layout.proved
    result.reasons = [reason.detail for reason in layout.reasons]
    return layout


def _search(real: RealCell, time_limit: float, result: CellResult) -> None:
    """Is there a layout, and how good is it? What the lattices hold, else the known one if it is still clean."""
    began = perf_counter()
    found = exhaustive(real.cell, time_limit)
    result.search = NONE if found.complete else CUT
    if found.layout is not None:
        result.search = FOUND
        result.lattice = energy(real.cell, found.layout)
    elif real.known is not None and dense_check(real.cell, real.known.stands, real.known.joints).clean:
        result.search = KNOWN
    result.search_seconds = perf_counter() - began


def energy(cell: Cell, layout: Known) -> float:
    """E (8.21) of a layout."""
    pairs = zip(cell.arms, layout.joints, strict=True)
    return sum(float(np.sum(arm.weights * (joints - arm.reference) ** 2)) for arm, joints in pairs)


def free_faults(cell: Cell) -> list[str] | None:
    """What is wrong in the cell with the layout that is best where nothing stands and no base is bound."""
    free = optimize(replace(cell, surroundings=Surroundings(), couplings=()))
    return None if free.objective is None else judge(cell, free, *COARSE).faults


@dataclass(frozen=True, slots=True)
class BeamResult:
    """The beam cell with and without its clearances: seconds (median), E, faults in the cell as it is."""

    clearance: bool
    seconds: float
    objective: float | None
    faults: list[str]


def run_beam(runs: int) -> list[BeamResult]:
    """The example both ways; times are medians of ``runs`` warm calls."""
    cell = beam_cell()
    bare = replace(cell, surroundings=replace(cell.surroundings, clearances=Clearances()))
    results = []
    for asked, problem in ((True, cell), (False, bare)):
        layout, times = optimize(problem), []
        for _ in range(runs):
            began = perf_counter()
            optimize(problem)
            times.append(perf_counter() - began)
        faults = ["no layout"] if layout.objective is None else judge(cell, layout).faults
        results.append(BeamResult(asked, sorted(times)[len(times) // 2], layout.objective, faults))
    return results
