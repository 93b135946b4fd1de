"""A second net: at the best bases, the best path through the postures of all seeds.

Seeds are paths that were continued from one posture; the best path may take its poses from several of them, or turn a
joint with a range of more than a turn the other way round. So the postures of all seeds, and some fresh ones, are
brought to every pose from one base, with all their turns, and a shortest path through these layers is taken.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.kinematics.chain_columns import rotation_vectors
from duocell.models.robot.arm import TURN
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.parameters.unreduced import UnreducedParameters
from duocell.optimizer.reduction.linear_sums import sum_excess
from duocell.optimizer.single_arm.redundant.carriage import carriage_nodes, carried_form
from duocell.optimizer.single_arm.redundant.conditioning_pull import conditioning_values
from duocell.optimizer.single_arm.redundant.draws import drawn_postures, fit_to_bases
from duocell.optimizer.single_arm.redundant.gauss_newton import Iterations, gauss_newton
from duocell.optimizer.single_arm.redundant.unreduced_problem import Seeds, UnreducedProblem, seen_from_bases

DRAWS_PER_KEPT = 8
"""Postures drawn for each that is kept for a pose."""
MISSED, MISSED_PENALTY = 2e-2, 1e4
"""m or rad: nodes farther from their pose are taken only if nothing else is left."""
OVER_PENALTY, ERROR_PENALTY, LEAP_PENALTY, CONDITIONING_PENALTY = 30.0, 100.0, 300.0, 300.0
"""Per radian beyond limits, per error, per radian of too long a step, per share of conditioning; a cost is about 1."""
STEP_SLACK = 1.2
"""Times the allowed step that costs nothing: iterations and IPOPT move the path."""
SORTED = 4
"""Times the nodes kept that are looked at for near copies."""


def recombined(
    problem: UnreducedProblem, bases: Floats, pool: Seeds, parameters: UnreducedParameters, seed: int
) -> Seeds:
    """One path for each base (K, 4), made of the postures of a pool of seeds."""
    paths = [_at(problem, base, pool, parameters, seed) for base in bases]
    return Seeds(np.stack(paths, axis=2), bases)


def over_carriage(problem: UnreducedProblem, bases: Floats, parameters: UnreducedParameters) -> Seeds | None:
    """The best path for each base (K, 4) of an arm with a closed form on a linear axis; None for other arms, or if some
    pose is out of reach from all of the bases.
    """
    form, paths, kept = carried_form(problem), [], []
    if form is None:
        return None
    for base in bases:
        check_stop()
        nodes = carriage_nodes(problem, form, base, parameters.carriage_places)
        if all(some.shape[1] for some in nodes):
            layers = [_cheapest(problem, j, some, base, parameters.carriage_nodes) for j, some in enumerate(nodes)]
            paths.append(_path(problem, layers, 1.0))
            kept.append(base)
    return Seeds(np.stack(paths, axis=2), np.array(kept)) if paths else None


def distinct_bases(bases: Floats, most: int, apart: float) -> Ints:
    """Indices of the first ``most`` bases (K, 4) that are ``apart`` [m] from each other."""
    kept: list[int] = []
    for k in range(len(bases)):
        if all(np.max(np.abs(bases[k, :3] - bases[i, :3])) >= apart for i in kept):
            kept.append(k)
            if len(kept) == most:
                break
    return np.array(kept, dtype=np.int64)


def _at(problem: UnreducedProblem, base: Floats, pool: Seeds, parameters: UnreducedParameters, seed: int) -> Floats:
    """(n, m) the best path from one base (4,)."""
    return _path(problem, _layers(problem, base, pool, parameters, seed), STEP_SLACK)


def _path(problem: UnreducedProblem, layers: list[_Layer], slack: float) -> Floats:
    """(n, m) the best path through the nodes of all poses; steps may be ``slack`` times as long as allowed."""
    path: list[Floats] = []
    for segment in problem.segments:
        scale = problem.step_scale[:, None, None]
        path += _shortest(layers[segment], problem.endless, slack * problem.max_step, scale)
    joints = np.stack(path, axis=1)
    for segment in problem.segments:
        joints[problem.endless, segment] = np.unwrap(joints[problem.endless, segment], axis=1)
    return joints


@dataclass(frozen=True, eq=False, slots=True)
class _Layer:
    """Nodes of one pose: joints (n, k) rad and what each costs (k,)."""

    joints: Floats
    costs: Floats


def _layers(
    problem: UnreducedProblem, base: Floats, pool: Seeds, parameters: UnreducedParameters, seed: int
) -> list[_Layer]:
    """Distinct cheap postures of every pose from one base."""
    draws = drawn_postures(problem, DRAWS_PER_KEPT * parameters.layer_draws, seed)
    count = min(parameters.layer_draws, draws.shape[1])
    fresh = [fit_to_bases(problem, j, base[None], draws, count)[:, :, 0] for j in range(len(problem.positions))]
    joints = np.concatenate([pool.joints, np.stack(fresh, axis=1)], axis=2)
    seeds = Seeds(joints, np.tile(base, (joints.shape[2], 1)))
    how = Iterations(parameters.layer_iterations, 0.4, parameters.stiff, base_moves=False, apart=True)
    joints = _turned(problem, gauss_newton(problem, seeds, how).joints)
    costs = _node_costs(problem, joints, base)
    return [
        _thinned(joints[:, j], costs[j], parameters.layer_nodes, parameters.layer_spacing)
        for j in range(len(problem.positions))
    ]


def _turned(problem: UnreducedProblem, joints: Floats) -> Floats:
    """Nodes (n, m, k) in the turns nearest to the reference that limits leave, and once more a turn to either side."""
    low, high = problem.lower[:, None, None], problem.upper[:, None, None]
    first, last = np.ceil((low - joints) / TURN - 1e-3), np.floor((high - joints) / TURN + 1e-3)
    turns = np.round((problem.reference_column[:, :, None] - joints) / TURN)
    whole = problem.turns[:, None, None]
    joints = joints + whole * np.where(first <= last, np.clip(turns, first, last), 0.0)
    others = []
    for i in np.flatnonzero((problem.upper - problem.lower >= TURN) & ~problem.endless & (problem.turns > 0.0)):
        for turn in (-TURN, TURN):
            other = joints.copy()
            other[i] += turn
            others.append(other)
    return np.concatenate([joints, *others], axis=2)


def _node_costs(problem: UnreducedProblem, joints: Floats, base: Floats) -> Floats:
    """(m, k) what nodes (n, m, k) cost by themselves."""
    n, m, count = joints.shape
    flat = joints.reshape(n, m * count)
    columns, position = problem.chain.forward(flat)
    wanted, targets = seen_from_bases(problem, base[None])
    wanted, targets = np.repeat(wanted, count, axis=2), np.repeat(targets, count, axis=1)
    error = np.maximum(
        np.max(np.abs(targets - position), axis=0), np.max(np.abs(rotation_vectors(columns, wanted)), axis=0)
    )
    low, high = problem.lower[:, None], problem.upper[:, None]
    over = np.sum(np.maximum(np.maximum(low - flat, flat - high), 0.0), axis=0)
    over += sum_excess(problem.arm, flat[..., None])
    weights = np.repeat(problem.weights, count)
    costs = weights * problem.costs_of_poses(flat) + OVER_PENALTY * over
    costs += np.where(error > MISSED, MISSED_PENALTY, ERROR_PENALTY * error)
    wanted_conditioning = problem.arm.min_conditioning
    if wanted_conditioning is not None:
        violation = np.maximum(wanted_conditioning - conditioning_values(problem, flat), 0.0)
        costs += CONDITIONING_PENALTY * violation / wanted_conditioning
    shaped: Floats = costs.reshape(m, count)
    return shaped


def _cheapest(problem: UnreducedProblem, pose: int, nodes: Floats, base: Floats, most: int) -> _Layer:
    """The cheapest of the nodes (n, k) of one pose, in all their turns."""
    one = problem.only(np.array([pose]), problem.weights[[pose]])
    joints = _turned(one, nodes[:, None])
    costs = _node_costs(one, joints, base)[0]
    order = np.argsort(costs, kind="stable")[:most]
    return _Layer(joints[:, 0, order], costs[order])


def _thinned(joints: Floats, costs: Floats, most: int, spacing: float) -> _Layer:
    """The cheapest nodes, without near copies."""
    order = np.argsort(costs, kind="stable")[: SORTED * most]
    some = joints[:, order]
    near = np.max(np.abs(some[:, :, None] - some[:, None, :]), axis=0) < spacing
    alive = np.ones(len(order), dtype=np.bool_)
    kept = []
    for k in range(len(order)):
        if alive[k]:
            kept.append(k)
            alive &= ~near[k]
            if len(kept) == most:
                break
    return _Layer(some[:, kept], costs[order[kept]])


def _shortest(layers: list[_Layer], endless: Bools, allowed: float, scale: Floats | float = 1.0) -> list[Floats]:
    """Joints (n,) of each pose of one segment on the cheapest path; steps count times ``scale`` (n, 1, 1)."""
    total, back = layers[0].costs, []
    for before, after in pairwise(layers):
        step = before.joints[:, :, None] - after.joints[:, None, :]
        step[endless] -= TURN * np.round(step[endless] / TURN)
        step *= scale
        costs_to = total[:, None] + LEAP_PENALTY * np.maximum(np.max(np.abs(step), axis=0) - allowed, 0.0)
        best = np.argmin(costs_to, axis=0)
        back.append(best)
        total = costs_to[best, np.arange(len(best))] + after.costs
    path = [int(np.argmin(total))]
    for best in reversed(back):
        path.append(int(best[path[-1]]))
    return [layer.joints[:, k] for layer, k in zip(layers, reversed(path), strict=True)]
