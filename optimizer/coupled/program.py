"""The nonlinear program of coupled arms: the arms' own programs, the couplings, and linear rows with one slack.

The arms' programs keep their compiled structure (`optimizer.structure`); couplings are exact functions of the bases.
The slack measures the largest shortfall of the linear rows and is charged for, so the program has a solution wherever
the arms' own rows have one.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np

from models.arrays import Floats
from models.cell import Cell
from models.chain import chain_of
from models.coupling import Coupling
from models.kinematics import characteristic_length
from optimizer.coupled.rows import LinearRows, joint_columns
from optimizer.local import conditioning_cuts
from optimizer.measure import largest_step
from optimizer.pose_rows import BASE
from optimizer.program import ArmPoint, Program, build_program
from optimizer.solve import IPOPT_OPTIONS, STATUS, SolveStatus, rounded_limit
from optimizer.structure import Structure

ITERATIONS = 40
ACCURATE = 5e-7
"""m or rad; rows that miss by more are no point of the task."""
SMALLEST_BLOCK = 16
"""Rows are padded to powers of two, so that few shapes have to be compiled."""


@dataclass(frozen=True, eq=False, slots=True)
class CoupledSolve:
    """Result of one coupled local solve.

    Attributes:
        status: what it ended with. points: one per arm. slack: what the linear rows lack at most, as far as they tell.
        violation: largest violation of a row.
    """

    status: SolveStatus
    points: tuple[ArmPoint, ...]
    slack: float
    violation: float

    @property
    def accurate(self) -> bool:
        """True if the point is on the task, whatever IPOPT says of its optimality."""
        return self.status.has_point and self.violation <= ACCURATE


def solve_coupled(
    cell: Cell, points: Sequence[ArmPoint], rows: LinearRows, radius: float, price: float, deadline: float
) -> CoupledSolve:
    """Solve around a layout.

    Args:
        cell: the cell. points: one per arm, where the rows were made.
        rows: linear rows there.
        radius: m that a base may move at most; turns and a redundant arm's joints are limited accordingly.
        price: E per unit of slack.
        deadline: `time.perf_counter` value, soft.
    """
    programs = [_arm_program(cell, index, point) for index, point in enumerate(points)]
    starts = np.cumsum([0] + [len(program.lower) for program in programs])
    size = max(SMALLEST_BLOCK, 1 << max(len(rows.values) - 1, 0).bit_length())
    compiled = _compiled(tuple(p.structure for p in programs), cell.couplings, _redundant(cell), size)
    solver = _solver(compiled, rounded_limit(max(deadline - time.perf_counter(), 0.05)))
    here = np.concatenate([program.pack([point]) for program, point in zip(programs, points, strict=True)])
    lower, upper = np.concatenate([p.lower for p in programs]), np.concatenate([p.upper for p in programs])
    reach = _reach(cell, radius)
    lower, upper = np.maximum(lower, here - reach), np.minimum(upper, here + reach)
    if np.any(lower > upper):
        return CoupledSolve(SolveStatus.INFEASIBLE, tuple(points), np.inf, np.inf)
    scale = float(np.mean([program.scale for program in programs]))
    gradients, wanted = np.zeros((size, rows.gradients.shape[1])), np.full(size, -np.inf)
    gradients[: len(rows.values)] = rows.gradients
    columns = joint_columns(cell, [int(start) for start in starts[:-1]])
    wanted[: len(rows.values)] = rows.required - rows.values + rows.gradients @ here[columns]
    ties = [coupling.rows([(0.0,) * BASE for _ in cell.arms]) for coupling in cell.couplings]
    rows_lower = np.concatenate([*(p.rows_lower for p in programs), *(rows.lower for rows in ties), wanted])
    rows_upper = np.concatenate(
        [*(p.rows_upper for p in programs), *(rows.upper for rows in ties), np.full(size, np.inf)]
    )
    result = solver(
        x0=np.append(here, max(rows.lack, 0.0)),
        p=np.concatenate(
            [
                *(program.parameters for program in programs),
                [program.scale / scale for program in programs],
                [price / scale],
                gradients.ravel(order="F"),
            ]
        ),
        lbx=np.append(lower, 0.0),
        ubx=np.append(upper, np.inf),
        lbg=rows_lower,
        ubg=rows_upper,
    )
    reached = np.asarray(result["g"]).ravel()
    violation = float(np.max(np.maximum(rows_lower - reached, reached - rows_upper), initial=0.0))
    unknowns = np.asarray(result["x"]).ravel()
    found = [
        program.unpack(unknowns[start:end], [point])[0]
        for program, point, start, end in zip(programs, points, starts, starts[1:], strict=False)
    ]
    status = STATUS.get(str(solver.stats()["return_status"]), SolveStatus.FAILED)
    return CoupledSolve(status, tuple(found), float(unknowns[-1]), violation)


def _arm_program(cell: Cell, index: int, point: ArmPoint) -> Program:
    """One arm's own program, with the rows that its path comes near to."""
    arm = cell.arms[index]
    steps = largest_step(cell.task, point.joints) > 0.8 * cell.max_joint_step
    cuts = None if arm.min_conditioning is None else [conditioning_cuts(arm, point.joints)]
    return build_program(cell, [arm], [point], keep_shoulder=point.signs is not None, steps=steps, cuts=cuts)


def _redundant(cell: Cell) -> tuple[bool, ...]:
    return tuple(arm.dof > 6 for arm in cell.arms)


def _reach(cell: Cell, radius: float) -> Floats:
    """(N,) how far each unknown may move: joints that follow from a base are left free."""
    parts = []
    for arm in cell.arms:
        turn = radius / max(characteristic_length(arm.robot), 0.1)
        joints = 3.0 * radius if arm.dof > 6 else np.inf
        yaw = np.inf if chain_of(arm.robot).vertical_sign else 2.0 * turn  # where it only shifts joint 1
        parts += [np.full(3, radius), np.array([yaw]), np.full(arm.dof * len(cell.task), joints)]
    return np.concatenate(parts)


@dataclass(frozen=True, eq=False, slots=True)
class _Compiled:
    """Symbols and derivatives as `casadi.nlpsol` takes them."""

    problem: dict[str, ca.MX]
    gradient: ca.Function
    jacobian: ca.Function
    hessian: ca.Function


@lru_cache(maxsize=32)
def _compiled(
    structures: tuple[Structure, ...], couplings: tuple[Coupling, ...], redundant: tuple[bool, ...], size: int
) -> _Compiled:
    """Join the arms' structures, the couplings and ``size`` linear rows (cached)."""
    count = len(structures)
    sizes = [s.unknowns.numel() for s in structures]
    starts = [sum(sizes[:a]) for a in range(count)]
    total = sum(sizes)
    taken = [np.arange(start, start + BASE) for start in starts]
    taken += [np.arange(starts[a] + BASE, starts[a] + sizes[a]) for a in range(count) if redundant[a]]
    pick = _picking(np.concatenate(taken), total)  # the columns of the linear rows
    base = _picking(np.concatenate(taken[:count]), total)
    ties = _Ties(couplings, count)

    x = ca.MX.sym("x", total + 1)
    p = ca.MX.sym("p", sum(s.parameters.numel() for s in structures) + count + 1 + size * pick.shape[0])
    xs = [x[start : start + n] for start, n in zip(starts, sizes, strict=True)]
    ps, at = [], 0
    for s in structures:
        ps.append(p[at : at + s.parameters.numel()])
        at += s.parameters.numel()
    factors, price = p[at : at + count], p[at + count]
    gradients = ca.reshape(p[at + count + 1 :], size, pick.shape[0])
    lam_f = ca.MX.sym("lam_f")
    rows = [s.rows.numel() for s in structures]
    lam = ca.MX.sym("lam", sum(rows) + ties.count + size)

    values = [ca.Function("arm", [s.unknowns, s.parameters], [s.objective, s.rows]) for s in structures]
    own = [value(xa, pa) for value, xa, pa in zip(values, xs, ps, strict=True)]
    slopes = [s.gradient(xa, pa)[1] for s, xa, pa in zip(structures, xs, ps, strict=True)]
    blocks = [s.jacobian(xa, pa)[1] for s, xa, pa in zip(structures, xs, ps, strict=True)]
    bends, row = [], 0
    for a, (s, xa, pa) in enumerate(zip(structures, xs, ps, strict=True)):
        bends.append(s.hessian(xa, pa, lam_f * factors[a], lam[row : row + rows[a]]))
        row += rows[a]
    bases = base @ x[:total]
    linear = gradients @ (pick @ x[:total]) + x[total]
    f = sum((factors[a] * own[a][0] for a in range(count)), price * x[total])
    g = ca.vertcat(*(values[1] for values in own), ties.value(bases), linear)
    slope = ca.vertcat(*(factors[a] * slopes[a] for a in range(count)), price)
    column = ca.vertcat(ca.MX(sum(rows) + ties.count, 1), ca.MX.ones(size, 1))
    jacobian = ca.horzcat(ca.vertcat(ca.diagcat(*blocks), ties.jacobian(bases) @ base, gradients @ pick), column)
    bend = ca.diagcat(*bends) + base.T @ ties.hessian(bases, lam[row : row + ties.count]) @ base
    hessian = ca.diagcat(bend, ca.MX(1, 1))
    point = [x, p]
    return _Compiled(
        {"x": x, "p": p, "f": f, "g": g},
        ca.Function("nlp_grad_f", point, [f, slope], ["x", "p"], ["f", "grad_f_x"]),
        ca.Function("nlp_jac_g", point, [g, jacobian], ["x", "p"], ["g", "jac_g_x"]),
        ca.Function(
            "nlp_hess_l",
            [*point, lam_f, lam],
            [ca.triu(hessian)],
            ["x", "p", "lam_f", "lam_g"],
            ["triu_hess_gamma_x_x"],
        ),
    )


@lru_cache(maxsize=32)
def _solver(compiled: _Compiled, time_limit: float) -> ca.Function:
    options: Any = {
        "print_time": False,
        "error_on_fail": False,
        "grad_f": compiled.gradient,
        "jac_g": compiled.jacobian,
        "hess_lag": compiled.hessian,
        "ipopt": {**IPOPT_OPTIONS, "max_iter": ITERATIONS, "max_wall_time": time_limit},
    }
    problem: Any = compiled.problem
    return ca.nlpsol("coupled", "ipopt", problem, options)


class _Ties:
    """Couplings as functions of the bases (4A,), with their derivatives."""

    def __init__(self, couplings: tuple[Coupling, ...], arms: int) -> None:
        x = ca.SX.sym("bases", BASE * arms)
        bases = [[x[BASE * a + i] for i in range(BASE)] for a in range(arms)]
        values = ca.vertcat(*(value for coupling in couplings for value in coupling.rows(bases).values))
        values = ca.SX(values) if couplings else ca.SX(0, 1)
        self.count = values.numel()
        lam = ca.SX.sym("lam", self.count)
        hessian = ca.hessian(ca.dot(lam, values), x)[0]
        self.value = ca.Function("ties", [x], [values])
        self.jacobian = ca.Function("ties_jacobian", [x], [ca.jacobian(values, x)])
        self.hessian = ca.Function("ties_hessian", [x, lam], [ca.triu(hessian)])


def _picking(taken: np.ndarray, total: int) -> ca.MX:
    """Matrix that picks unknowns."""
    k = len(taken)
    order = np.argsort(taken)
    starts = np.concatenate([[0], np.cumsum(np.bincount(taken, minlength=total))])
    pattern = ca.Sparsity(k, total, starts.tolist(), np.arange(k)[order].tolist())
    return ca.MX(pattern, ca.MX.ones(k))
