"""Convex quadratic programs, and who solves them: any solver that keeps `QpSolver` can be put in place of PIQP.

PIQP is the proximal interior point method of R. Schwan, Y. Jiang, D. Kuhn, C. N. Jones, PIQP: A Proximal Interior-Point
Quadratic Programming Solver, CDC 2023. A program takes it 0.3 ms, where a general interior point solver for nonlinear
programs took 35 ms.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import piqp

from duocell.models.base.arrays import Floats

TOLERANCE, DUAL_TOLERANCE = 1e-9, 1e-8
"""Of a program whose numbers are about 1: by how much its rows may be violated, and how far its cost from the best."""
ITERATIONS = 100


@dataclass(frozen=True, eq=False, slots=True)
class QuadraticProgram:
    """Minimise ``½ x · curvature · x + gradient · x`` with ``rows x >= least`` and ``lower <= x <= upper``.

    Attributes:
        curvature: (C, C) symmetric, positive semidefinite. gradient: (C,).
        rows: (R, C). least: (R,). lower: (C,), -inf for none. upper: (C,), inf for none.
    """

    curvature: Floats
    gradient: Floats
    rows: Floats
    least: Floats
    lower: Floats
    upper: Floats


class QpSolver(Protocol):
    """Solves a program by itself: from no start, to its own tolerances, in the same way every time."""

    def __call__(self, program: QuadraticProgram) -> Floats | None:
        """(C,) the minimum; None where none was found."""
        ...


def solve_piqp(program: QuadraticProgram) -> Floats | None:
    """PIQP with dense matrices."""
    solver = piqp.DenseSolver()
    solver.settings.verbose = False
    solver.settings.eps_abs = solver.settings.eps_rel = TOLERANCE
    solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = DUAL_TOLERANCE
    solver.settings.max_iter = ITERATIONS
    solver.setup(
        np.asfortranarray(program.curvature),
        program.gradient,
        G=np.asfortranarray(program.rows),
        h_l=program.least,
        x_l=program.lower,
        x_u=program.upper,
    )
    found: Floats | None = solver.result.x.copy() if solver.solve() == piqp.PIQP_SOLVED else None
    return found


def minimum(program: QuadraticProgram, solver: QpSolver = solve_piqp) -> Floats | None:
    """(C,) the minimum of a program within its bounds, or None: whatever a solver ends with, only numbers come back.

    Args:
        program: to be solved. solver: that solves it.
    """
    found = solver(program)
    if found is None or not np.all(np.isfinite(found)):
        return None
    kept: Floats = np.clip(found, program.lower, program.upper)  # solvers keep bounds to a tolerance
    return kept
