"""Solve a program with IPOPT and say, for every way IPOPT can end, what the point is worth."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.iterations import Iterations
from duocell.optimizer.nlp.program import ArmSolution, Program
from duocell.optimizer.nlp.structure import Structure


class SolveStatus(StrEnum):
    """What a local solve ended with."""

    OPTIMAL = "optimal"
    ACCEPTABLE = "acceptable"  # solved to a looser tolerance
    LIMIT = "limit"  # iterations or time ran out; the point may be usable
    INFEASIBLE = "infeasible"  # converged to a point of least infeasibility
    DIVERGED = "diverged"
    CANCELLED = "cancelled"
    FAILED = "failed"  # the engine gave up or was called wrongly

    @property
    def has_point(self) -> bool:
        """True if the point is worth being verified."""
        return self in (SolveStatus.OPTIMAL, SolveStatus.ACCEPTABLE, SolveStatus.LIMIT)


STATUS: dict[str, SolveStatus] = {
    "Solve_Succeeded": SolveStatus.OPTIMAL,
    "Solved_To_Acceptable_Level": SolveStatus.ACCEPTABLE,
    "Feasible_Point_Found": SolveStatus.ACCEPTABLE,
    "Search_Direction_Becomes_Too_Small": SolveStatus.LIMIT,
    "Maximum_Iterations_Exceeded": SolveStatus.LIMIT,
    "Maximum_CpuTime_Exceeded": SolveStatus.LIMIT,
    "Maximum_WallTime_Exceeded": SolveStatus.LIMIT,
    "Infeasible_Problem_Detected": SolveStatus.INFEASIBLE,
    "Restoration_Failed": SolveStatus.INFEASIBLE,
    "Diverging_Iterates": SolveStatus.DIVERGED,
    "User_Requested_Stop": SolveStatus.CANCELLED,
    "Not_Enough_Degrees_Of_Freedom": SolveStatus.FAILED,
    "Error_In_Step_Computation": SolveStatus.FAILED,
    "Invalid_Problem_Definition": SolveStatus.FAILED,
    "Invalid_Option": SolveStatus.FAILED,
    "Invalid_Number_Detected": SolveStatus.FAILED,
    "Unrecoverable_Exception": SolveStatus.FAILED,
    "NonIpopt_Exception_Thrown": SolveStatus.FAILED,
    "Insufficient_Memory": SolveStatus.FAILED,
    "Internal_Error": SolveStatus.FAILED,
    "Unknown": SolveStatus.FAILED,
}
"""Every return status of IPOPT as CasADi spells it."""

IPOPT_OPTIONS: dict[str, Any] = {
    "print_level": 0,
    "sb": "yes",
    "tol": 1e-8,
    "constr_viol_tol": 1e-9,
    "max_iter": 120,
    "mu_init": 1e-3,  # starts are close: a large barrier would drive them back to the middle
    "bound_push": 1e-6,
    "bound_frac": 1e-6,
    "honor_original_bounds": "yes",  # limits hold exactly, whatever IPOPT relaxed them by
    "nlp_scaling_method": "none",  # metres, radians and costs per rad² are of one size already
}


@dataclass(frozen=True, eq=False, slots=True)
class Solve:
    """Result of one local solve.

    Attributes:
        status: what it ended with. engine_status: IPOPT's own word.
        points: one per arm, the last iterate.
        objective: E there.
        violation: largest violation of a row or bound.
        iterations: of IPOPT. wall_time: s.
    """

    status: SolveStatus
    engine_status: str
    points: list[ArmSolution]
    objective: float
    violation: float
    iterations: int
    wall_time: float


def solve_program(program: Program, start: Sequence[ArmSolution], time_limit: float = 60.0) -> Solve:
    """Solve from a start.

    Args:
        program: what to solve.
        start: one point per arm.
        time_limit: s, soft limit inside IPOPT.

    Returns:
        The result; never raises for a numerical failure, the status says it.

    Raises:
        Cancelled: whoever watches (`duocell.optimizer.monitoring.watch`) wants an end.
    """
    check_stop()
    if np.any(program.lower > program.upper):  # a posture that the limits in force rule out
        empty = float(np.max(program.lower - program.upper))
        return Solve(SolveStatus.INFEASIBLE, "Empty_Bounds", list(start), np.inf, empty, 0, 0.0)
    began = time.perf_counter()
    solver, iterations = _solver(program.structure, rounded_limit(time_limit))
    iterations.begin(program.scale, program.rows_lower, program.rows_upper)
    result = solver(
        x0=program.pack(start),
        p=program.parameters,
        lbx=program.lower,
        ubx=program.upper,
        lbg=program.rows_lower,
        ubg=program.rows_upper,
    )
    check_stop()
    stats = solver.stats()
    word = str(stats["return_status"])
    unknowns = np.asarray(result["x"]).ravel()
    rows = np.asarray(result["g"]).ravel()
    return Solve(
        status=STATUS.get(word, SolveStatus.FAILED),
        engine_status=word,
        points=program.unpack(unknowns, start),
        objective=float(result["f"]) * program.scale,
        violation=max(
            _outside(unknowns, program.lower, program.upper), _outside(rows, program.rows_lower, program.rows_upper)
        ),
        iterations=int(stats["iter_count"]),
        wall_time=time.perf_counter() - began,
    )


def rounded_limit(time_limit: float) -> float:
    """The largest power of two that is not longer: limits are compiled into solvers, and no two are the same."""
    return float(2.0 ** np.floor(np.log2(max(time_limit, 1.0 / 16.0))))


def _outside(values: Floats, lower: Floats, upper: Floats) -> float:
    return float(np.max(np.maximum(lower - values, values - upper), initial=0.0))


@lru_cache(maxsize=32)
def _solver(structure: Structure, time_limit: float) -> tuple[ca.Function, Iterations]:
    """IPOPT on a structure with its assembled derivatives (cached: building costs more than a solve).

    The callback is called by the solver but not kept alive by it: both are cached together.
    """
    iterations = Iterations(structure)
    problem: Any = {
        "x": structure.unknowns,
        "p": structure.parameters,
        "f": structure.objective,
        "g": structure.rows,
    }
    options: Any = {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": structure.gradient,
        "jac_g": structure.jacobian,
        "hess_lag": structure.hessian,
        "iteration_callback": iterations,
        "ipopt": {**IPOPT_OPTIONS, "max_wall_time": time_limit},
    }
    return ca.nlpsol("layout", "ipopt", problem, options), iterations
