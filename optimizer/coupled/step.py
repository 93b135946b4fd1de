"""One step of a refinement: a convex quadratic program with one slack for all its rows, solved by IPOPT."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from models.arrays import Floats
from optimizer.coupled.linear_rows import LinearRows
from optimizer.coupled.quadratic import Quadratic

SMALLEST_BLOCK = 16
"""Rows are padded to powers of two, so that few shapes have to be compiled."""
OPTIONS: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "mehrotra_algorithm": "yes",  # made for convex quadratic programs
    "jac_d_constant": "yes",
    "hessian_constant": "yes",
    "tol": 1e-9,
    "max_iter": 100,
    "honor_original_bounds": "yes",
}


@dataclass(frozen=True, eq=False, slots=True)
class Step:
    """A step and what it promises.

    Attributes:
        step: (C,) change of the unknowns. slack: what the rows lack at most after it, as far as they tell.
    """

    step: Floats
    slack: float


def best_step(model: Quadratic, rows: LinearRows, lower: Floats, upper: Floats, price: float) -> Step | None:
    """The step that is best for the model, the rows and the bounds.

    Args:
        model: of the objective. rows: to be kept. lower: (C,) bounds of the step. upper: likewise.
        price: cost of a unit of slack.

    Returns:
        The step, or None where IPOPT finds none.
    """
    count, given = len(model.gradient), len(rows.values)
    size = max(SMALLEST_BLOCK, 1 << max(given - 1, 0).bit_length())
    gradients, wanted = np.zeros((size, count)), np.full(size, -np.inf)
    gradients[:given], wanted[:given] = rows.gradients, rows.required - rows.values
    scale = max(float(np.max(np.abs(model.gradient))), 1e-6)
    solver = _solver(count, size)
    result = solver(
        x0=np.append(np.zeros(count), max(rows.lack, 0.0) + 1e-3),
        p=np.concatenate(
            [
                model.gradient / scale,
                (model.curvature / scale).ravel(order="F"),
                [price / scale],
                gradients.ravel(order="F"),
            ]
        ),
        lbx=np.append(lower, 0.0),
        ubx=np.append(upper, np.inf),
        lbg=wanted,
        ubg=np.full(size, np.inf),
    )
    if not solver.stats()["success"]:
        return None
    found = np.asarray(result["x"]).ravel()
    return Step(found[:-1], float(found[-1]))


@lru_cache(maxsize=64)
def _solver(count: int, size: int) -> ca.Function:
    """IPOPT on the program of ``count`` unknowns and ``size`` rows (cached: building costs more than solving)."""
    x = ca.MX.sym("x", count + 1)
    p = ca.MX.sym("p", count + count**2 + 1 + size * count)
    step, slack = x[:count], x[count]
    gradient, curvature = p[:count], ca.reshape(p[count : count + count**2], count, count)
    price, rows = p[count + count**2], ca.reshape(p[count + count**2 + 1 :], size, count)
    pull = curvature @ step
    f = ca.dot(gradient, step) + 0.5 * ca.dot(step, pull) + price * slack
    g = rows @ step + slack
    lam_f, lam_g = ca.MX.sym("lam_f"), ca.MX.sym("lam_g", size)
    slope, jacobian = ca.vertcat(gradient + pull, price), ca.horzcat(rows, ca.MX.ones(size, 1))
    hessian = ca.triu(ca.diagcat(lam_f * curvature, ca.MX(1, 1)))
    options: Any = {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": ca.Function("nlp_grad_f", [x, p], [f, slope], ["x", "p"], ["f", "grad_f_x"]),
        "jac_g": ca.Function("nlp_jac_g", [x, p], [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        "hess_lag": ca.Function(
            "nlp_hess_l", [x, p, lam_f, lam_g], [hessian], ["x", "p", "lam_f", "lam_g"], ["triu_hess_gamma_x_x"]
        ),
        "ipopt": OPTIONS,
    }
    problem: Any = {"x": x, "p": p, "f": f, "g": g}
    return ca.nlpsol("step", "ipopt", problem, options)
