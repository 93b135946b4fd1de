"""One step of a refinement: a convex quadratic program with one slack for all its rows."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.sqp.linear_rows import LinearRows
from duocell.optimizer.sqp.qp import QpSolver, QuadraticProgram, minimum, solve_piqp
from duocell.optimizer.sqp.quadratic import Quadratic


@dataclass(frozen=True, eq=False, slots=True)
class Step:
    """A step and what it promises.

    Attributes:
        step: (C,) change of the unknowns. slack: how much the rows are violated at most after it, as far as they tell.
    """

    step: Floats
    slack: float


def best_step(
    model: Quadratic, rows: LinearRows, lower: Floats, upper: Floats, penalty: float, solver: QpSolver = solve_piqp
) -> Step | None:
    """The step that is best for the model, the rows and the bounds.

    Args:
        model: of the objective. rows: to be kept. lower: (C,) bounds of the step. upper: likewise.
        penalty: cost of a unit of slack. solver: of the quadratic program.

    Returns:
        The step, or None where the solver finds none.
    """
    count, given = len(model.gradient), len(rows.values)
    scale = max(float(np.max(np.abs(model.gradient))), 1e-6)
    curvature = np.zeros((count + 1, count + 1), order="F")
    curvature[:count, :count] = model.curvature / scale
    gradients = np.ones((given, count + 1), order="F")
    gradients[:, :count] = rows.gradients
    program = QuadraticProgram(
        curvature,
        np.append(model.gradient, penalty) / scale,
        gradients,
        rows.required - rows.values,
        np.append(lower, 0.0),
        np.append(upper, np.inf),
    )
    found = minimum(program, solver)
    return None if found is None else Step(found[:count], float(found[count]))
