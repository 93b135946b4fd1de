"""Gauss-Newton for many seeds of the unreduced problem at once (docs/method.md, section 6).

Every pose of every seed is linearised about its own joints; the joints are eliminated pose by pose (a 6x6 system
each), what is left is a system of at most four unknowns per seed, its base. Joint limits are an active set of stiff
springs, the self-motion of a pose goes a share of its way downhill in every iteration.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.kinematics.chain_columns import rotation_vectors
from duocell.models.robot.linear_limits import LinearLimits
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.single_arm.redundant.conditioning_pull import conditioning_pull
from duocell.optimizer.single_arm.redundant.normal_equations import backwards, bounded_step, factorised, forwards
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, seen_from_bases

FASTER, SLOWER, LEAST_PULL = 1.3, 0.5, 0.1
"""What becomes of a seed's pull after progress and after none, and its least."""
ERROR_PENALTY = 50.0
"""Penalty of the largest error [m or rad] of a pose in the merit that decides on progress."""
LARGEST_DAMPING, LEAST_DAMPING = 1e-2, 1e-7
"""m²: damping is the square of the error, within these."""
BASE_DAMPING = 1e-6
"""Relative; base coordinates that no pose feels stay where they are."""
UNREACHED = 0.01
"""m or rad; a pose with so large an error counts as much as the heaviest where the base is moved."""
LARGEST_STEP = 0.6
"""rad, any joint in one iteration."""


@dataclass(frozen=True, slots=True)
class Iterations:
    """How to iterate.

    Attributes:
        count: iterations. pull: share of the way downhill that self-motion goes at first, in [0, 1]; 0 for none.
        penalty: of a squared radian beyond a limit, in units of the mean joint weight.
        base_moves: False to leave the bases where they are.
        apart: the poses of a seed have nothing in common but a base that stays: each has a step size of its own.
        steps: also keep the steps between poses; not where there are poses between them that are left out.
        restraint: m or rad: a pose with so large an error goes half as fast downhill, for it has to arrive first.
        conditioning: σmin/σmax to be kept by self-motion where it is less, or 0.
    """

    count: int
    pull: float
    penalty: float
    base_moves: bool = True
    apart: bool = False
    steps: bool = False
    restraint: float = 0.05
    conditioning: float = 0.0


def gauss_newton(problem: UnreducedProblem, seeds: Seeds, how: Iterations) -> Seeds:
    """Seeds after some iterations; all of them are made, none is judged."""
    free = problem.free if how.base_moves else problem.free[:0]
    n, m, count = seeds.joints.shape
    joints, bases = seeds.joints, seeds.bases
    pull = np.full((m if how.apart else 1, count), how.pull)
    least, before = min(LEAST_PULL, how.pull), np.full(pull.shape, np.inf)
    for _ in range(how.count):
        check_stop()
        look = _linearise(problem, joints, bases, how)
        merit = look.cost + ERROR_PENALTY * look.missing
        merit = merit if how.apart else (problem.base_weights @ merit)[None]
        pull = np.where(merit > before * (1.0 + 1e-9), np.maximum(SLOWER * pull, least), FASTER * pull)
        pull = np.minimum(pull, 1.0)
        before = merit
        restrained = pull / (1.0 + (look.missing / how.restraint) ** 2)
        wish = (look.downhill.reshape(n, m, count) * restrained).reshape(n, m * count)
        if how.conditioning > 0.0:
            wish -= conditioning_pull(problem, joints.reshape(n, m * count), how.conditioning, look.inverse_metric)
        steps, base_steps = _solve(problem, look, wish, bases, free)
        steps = steps.reshape(n, m, count)
        longest = np.max(np.abs(steps), axis=0 if how.apart else (0, 1))
        scale = np.minimum(1.0, LARGEST_STEP / np.maximum(longest, 1e-12))
        joints = joints + scale * steps
        if len(free):
            bases = bases.copy()
            moved = bases[:, free] + scale[:, None] * base_steps
            bases[:, free] = np.clip(moved, problem.base_lower[free], problem.base_upper[free])
    return Seeds(joints, bases)


@dataclass(frozen=True, eq=False, slots=True)
class _Linearised:
    """All poses of all seeds about their joints.

    Attributes:
        error: (6, N) m and rad in base axes, what is missing to the targets. jacobian: (n, 6, N).
        targets: (3, N) m, in the base frames.
        inverse_metric: (n, N). downhill: (n, N) rad, the gradient of cost and penalties in that metric.
        cost: (m, K) with penalties. missing: (m, K) largest error of a pose.
    """

    error: Floats
    jacobian: Floats
    targets: Floats
    inverse_metric: Floats
    downhill: Floats
    cost: Floats
    missing: Floats


def _linearise(problem: UnreducedProblem, joints: Floats, bases: Floats, how: Iterations) -> _Linearised:
    """Look at paths (n, m, K).

    A limit is as hard at a pose that counts for little as at any other: what a pose does is weighted by what it counts
    for, so its springs are stiffer by as much.
    """
    n, m, count = joints.shape
    q = joints.reshape(n, m * count)
    columns, position, jacobian = problem.chain.forward_and_jacobian(q)
    wanted, targets = seen_from_bases(problem, bases)
    error = np.concatenate([targets - position, rotation_vectors(columns, wanted)])
    beyond = np.maximum(q - problem.upper[:, None], 0.0) - np.maximum(problem.lower[:, None] - q, 0.0)
    off = q - problem.reference_column
    weights = problem.joint_weights[:, None]
    springs = np.repeat(how.penalty / np.minimum(problem.base_weights, 1.0), count)
    metric = problem.metric[:, None] + springs * (beyond != 0.0)
    force = weights * off + springs * beyond
    cost = np.sum(weights * off * off + springs * beyond * beyond, axis=0)
    if problem.arm.linear_limits is not None:
        force, metric, cost = _with_sums(problem.arm.linear_limits, q, springs, force, metric, cost)
    if how.steps:
        force, metric, cost = _with_steps(problem, joints, springs, force, metric, cost)
    return _Linearised(
        error=error,
        jacobian=jacobian,
        targets=targets,
        inverse_metric=1.0 / metric,
        downhill=force / metric,
        cost=cost.reshape(m, count),
        missing=np.max(np.abs(error), axis=0).reshape(m, count),
    )


def _with_sums(
    limits: LinearLimits, q: Floats, springs: Floats, force: Floats, metric: Floats, cost: Floats
) -> tuple[Floats, Floats, Floats]:
    """Forces (n, N), metric (n, N) and cost (N,) with springs on sums of joints beyond their linear limits.

    A spring on a sum links its joints; the metric has only a diagonal, which for every joint takes the others' part as
    well: so joints that move at once do not overshoot.
    """
    sums, matrix = limits.matrix @ q, limits.matrix
    beyond = np.maximum(sums - limits.upper[:, None], 0.0) - np.maximum(limits.lower[:, None] - sums, 0.0)
    linked = np.abs(matrix) * np.sum(np.abs(matrix), axis=1, keepdims=True)
    force = force + springs * (matrix.T @ beyond)
    metric = metric + springs * (linked.T @ (beyond != 0.0))
    return force, metric, cost + springs * np.sum(beyond * beyond, axis=0)


def _with_steps(
    problem: UnreducedProblem, joints: Floats, springs: Floats, force: Floats, metric: Floats, cost: Floats
) -> tuple[Floats, Floats, Floats]:
    """Forces (n, N), metric (n, N) and cost (N,) with springs between poses whose joints are too far apart.

    Both ends are moved at once, each as if the other stayed, in a metric of twice the spring: so they do not overshoot.
    """
    n, m, count = joints.shape
    step = np.diff(joints, axis=1)
    excess = (
        np.sign(step) * np.maximum(np.abs(step) - problem.step_limits[:, None, None], 0.0) * problem.joined[:, None]
    )
    if not np.any(excess):
        return force, metric, cost
    pulled, stiff = np.zeros(joints.shape), np.zeros(joints.shape)
    pulled[:, :-1] -= excess
    pulled[:, 1:] += excess
    stiff[:, :-1] += excess != 0.0
    stiff[:, 1:] += excess != 0.0
    penalty = np.zeros((m, count))
    penalty[1:] = np.sum(excess * excess, axis=0)
    flat = n, m * count
    return (
        force + springs * pulled.reshape(flat),
        metric + 2.0 * springs * stiff.reshape(flat),
        cost + springs * penalty.reshape(-1),
    )


def _solve(
    problem: UnreducedProblem, look: _Linearised, wish: Floats, bases: Floats, free: Ints
) -> tuple[Floats, Floats]:
    """Steps of the joints (n, N) and of the free base coordinates (K, d)."""
    size = np.max(np.abs(look.error), axis=0)
    damping = np.minimum(LARGEST_DAMPING, size * size) + LEAST_DAMPING
    factor, weighted = factorised(look.jacobian, look.inverse_metric, damping)
    rows = np.zeros((6, 1 + len(free), look.error.shape[1]))
    rows[:, 0] = look.error + np.einsum("in,ian->an", wish, look.jacobian)
    _fill_base_columns(problem, look.targets, bases, free, rows[:, 1:])
    forwards(factor, rows)
    base_steps = np.empty((len(bases), 0))
    if len(free):
        base_steps = _base_steps(problem, rows, bases, free, look.missing)
        m = len(problem.positions)
        rows[:, 0] += np.einsum("abn,bn->an", rows[:, 1:], np.tile(base_steps.T, m))
    solved = rows[:, 0]
    backwards(factor, solved)
    return np.einsum("an,ian->in", solved, weighted) - wish, base_steps


def _fill_base_columns(problem: UnreducedProblem, targets: Floats, bases: Floats, free: Ints, columns: Floats) -> None:
    """How the error (6, d, N) changes with each free base coordinate: B of the method."""
    m = len(problem.positions)
    cos, sin = np.tile(np.cos(bases[:, 3]), m), np.tile(np.sin(bases[:, 3]), m)
    for column, k in enumerate(free):
        if k < 3:
            x, y, z = problem.arm.mount[k]
            columns[0, column] = -(cos * x + sin * y)
            columns[1, column] = sin * x - cos * y
            columns[2, column] = -z
        else:
            columns[0, column] = targets[1]
            columns[1, column] = -targets[0]
            columns[5, column] = -1.0


def _weights_of_bases(problem: UnreducedProblem, missing: Floats) -> Floats:
    """(m, K) what poses count for where the base is moved: one that is not reached as much as the heaviest.

    By their weights alone a dwell of hundreds of poses would keep the base where the few others are out of reach.
    """
    own = problem.base_weights[:, None]
    return np.maximum(own, np.max(own) * np.minimum(missing / UNREACHED, 1.0))


def _base_steps(problem: UnreducedProblem, rows: Floats, bases: Floats, free: Ints, missing: Floats) -> Floats:
    """(K, d) steps of the bases from rows (6, 1 + d, N) that the factors have been applied to."""
    m, count, d = len(problem.positions), len(bases), len(free)
    split = rows.reshape(6, 1 + d, m, count)
    scaled = split * np.sqrt(_weights_of_bases(problem, missing))
    hessian, gradient = np.empty((count, d, d)), np.empty((count, d))
    for a in range(d):
        gradient[:, a] = np.einsum("rjk,rjk->k", scaled[:, 1 + a], scaled[:, 0])
        for b in range(a + 1):
            hessian[:, a, b] = hessian[:, b, a] = np.einsum("rjk,rjk->k", scaled[:, 1 + a], scaled[:, 1 + b])
    trace = np.trace(hessian, axis1=1, axis2=2)
    hessian += BASE_DAMPING * trace[:, None, None] * np.eye(d)
    here = bases[:, free]
    return bounded_step(hessian, gradient, problem.base_lower[free] - here, problem.base_upper[free] - here)
