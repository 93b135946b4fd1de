"""One random task answered, and how good the answer was."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from time import perf_counter, process_time
from typing import Any

import numpy as np

from bench.random_arms.draw import draw
from bench.random_arms.long_search import long_search
from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.robot.posture import signs_from
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.reduction.reduced import ReducedProblem, reduced_problem
from duocell.optimizer.results.proof import Incumbent
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.optimizer.single_arm.passable import best_passable
from duocell.optimizer.single_arm.refinement import path_from
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.arm_path import check_arm_path

TOLERANCE = 1e-3
"""Relative distance to the best known from which an answer counts as missed."""
PROOF_TIME, SEARCH_TIME = 10.0, 600.0
"""s; the first is what branch and bound may take, the second is out of the way on a busy machine."""


@dataclass(frozen=True, slots=True)
class Known:
    """What is known of a task.

    Attributes:
        best: least cost of a usable placement that anything found, or None. bound: no placement costs less, or None.
        impossible: proved to have none. judge: what was asked: "proof" or "search"; "" if nothing yet.
    """

    best: float | None = None
    bound: float | None = None
    impossible: bool = False
    judge: str = ""


@dataclass(frozen=True, slots=True)
class Trial:
    """An answer.

    Attributes:
        kind, seed: of the task. robot: its arm. objective: of the answer, None where it is that there is none.
        proved: the answer calls its "none" proved. seconds: CPU time. starts: local solves. known: of the task.
    """

    kind: str
    seed: int
    robot: str
    objective: float | None
    proved: bool
    seconds: float
    starts: int
    known: Known = field(default_factory=Known)

    @property
    def ratio(self) -> float:
        """The answer's cost to the best known; infinite where only the answer has none, 1 where nothing has any."""
        if self.known.best is None:
            return 1.0
        return np.inf if self.objective is None else self.objective / max(self.known.best, 1e-9)

    @property
    def missed(self) -> bool:
        """The answer is not the best."""
        return 1.0 + TOLERANCE < self.ratio < np.inf

    @property
    def refused(self) -> bool:
        """The answer is that there is none, though there is one."""
        return self.ratio == np.inf

    @property
    def record(self) -> dict[str, Any]:
        """As plain JSON."""
        return asdict(self)

    @staticmethod
    def of(values: dict[str, Any]) -> Trial:
        """From a record."""
        return Trial(**{**values, "known": Known(**values["known"])})


@dataclass(frozen=True, eq=False, slots=True)
class _Way:
    """Only bases count from which the arm can also go the way between the poses."""

    cell: Cell
    problem: ReducedProblem

    def free(self, place: Floats, signs: Ints) -> bool:
        """True if the way can be gone as it is."""
        point = path_from(self.problem, place, signs_from(signs))
        return check_arm_path(self.cell, self.problem.arm, point).free

    def cost(self, found: Incumbent) -> float | None:
        """Of a point that a proof found, or of one nearby whose way can be gone."""
        point = path_from(self.problem, found.position, found.signs)
        best = best_passable(
            self.cell, self.problem.arm, [(found.objective, point)], np.inf, perf_counter() + SEARCH_TIME
        )
        return None if best is None else best[0]


def judged(kind: str, seed: int, known: Known) -> Trial:
    """Answer a task without certificate; find out what is possible, unless that is known."""
    cell = draw(kind, seed)
    arm = cell.arms[0]
    began = process_time()
    found = search_arm(cell, arm, Settings(certificate=None), perf_counter() + SEARCH_TIME)
    seconds = process_time() - began
    objective = float(found.objective) if found.best is not None else None
    problem = found.problem or reduced_problem(cell, arm)
    if problem is None:
        raise AssertionError("arms of these tasks have a reduced problem")
    if not known.judge:
        proof = certify(problem, objective, CertificateSettings(gap=0.5 * TOLERANCE, time_limit=PROOF_TIME))
        way = _Way(cell, problem)
        better = None if proof.found is None else way.cost(proof.found)
        best = min((v for v in (objective, better) if v is not None), default=None)
        known = Known(best, proof.lower_bound, proof.infeasible, "proof")
        if not (proof.proved or proof.infeasible):
            value = long_search(problem, search_box(cell, arm), seed, wanted=way.free)
            best = min((v for v in (best, value) if v is not None and np.isfinite(v)), default=None)
            known = Known(best, proof.lower_bound, False, "search")
    elif objective is not None and (known.best is None or objective < known.best):
        known = Known(objective, known.bound, known.impossible, known.judge)
    return Trial(kind, seed, arm.robot.name, objective, found.proved, seconds, found.starts, known)
