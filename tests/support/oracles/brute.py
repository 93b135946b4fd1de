"""Brute force for one six-joint arm, sharing nothing with the optimizer but the problem statement.

Branches come from ssik (for the source's PUMA from the source's own formulas), postures from the joint axes, windings
from trying all of them, the yaw from trying every turn; bases from a dense grid, refined by Nelder and Mead.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache
from itertools import product

import numpy as np
import ssik
from scipy.optimize import minimize

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.chain import chain_of
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import ALL_SIGNS
from duocell.models.robot.robot import Robot
from tests.support.angles import TURN, wrapped
from tests.support.oracles import puma
from tests.support.oracles.signs import axis_signs

TURNS = range(-3, 4)
USELESS = 1e9


def branches_of(robot: Robot, pose: Floats) -> Floats:
    """(K, 6) joint values that reach a flange pose in the base frame."""
    if robot.ssik_name is None:
        found = [puma.solve(pose, *signs) for signs in ALL_SIGNS]
        return np.array([q for q in found if q is not None]).reshape(-1, 6)
    solutions = _solver(robot.ssik_name).solve(pose, respect_limits=False, allow_rescue=False)
    return np.array([s.q for s in solutions]).reshape(-1, 6)


@lru_cache
def _solver(name: str) -> ssik.Manipulator:
    return ssik.Manipulator.from_prebuilt(name)


def cost_at(cell: Cell, arm: Arm, position: Floats) -> float:
    """Least joint availability of the arm with its base at a position, over postures, windings and yaws; `USELESS` if
    there is no path.
    """
    return min((path_cost(cell, arm, path) for path in paths_at(cell, arm, position)), default=USELESS)


def paths_at(cell: Cell, arm: Arm, position: Floats) -> list[Floats]:
    """Paths (m, 6) modulo 2π with joint 1 for yaw 0, whatever their limits, of an arm with its base at a position."""
    targets = cell.flange_targets(arm).copy()
    targets[:, :3, 3] -= position
    targets[:, :3] = arm.mount.T @ targets[:, :3]
    layers = []
    for target in targets:
        layer = branches_of(arm.robot, target)
        if not len(layer):
            return []
        layers.append(layer)
    return _paths(arm.robot, layers)


def _paths(robot: Robot, layers: list[Floats]) -> list[Floats]:
    """Paths (m, 6) in one posture; without postures, those that follow the nearest branch."""
    signs = axis_signs(robot, np.concatenate(layers))
    if signs is None:
        paths = [layers[0]]
        for layer in layers[1:]:
            apart = np.abs(wrapped(paths[-1][:, None] - layer[None])).max(axis=-1)
            paths.append(layer[np.argmin(apart, axis=1)])
        return list(np.stack(paths, axis=1))
    labelled, at = [], 0
    for layer in layers:
        labelled.append({tuple(s): q for s, q in zip(signs[at : at + len(layer)], layer, strict=True)})
        at += len(layer)
    kept = [posture for posture in labelled[0] if all(posture in layer for layer in labelled)]
    return [np.array([layer[posture] for layer in labelled]) for posture in kept]


def path_cost(cell: Cell, arm: Arm, path: Floats) -> float:
    """Least objective of a path (m, 6) modulo 2π with joint 1 for yaw 0; the segments of a task sequence have their own
    turns.
    """
    total, firsts = 0.0, []
    for segment in cell.task.segments:
        steps = wrapped(np.diff(path[segment], axis=0))
        if np.max(np.abs(steps), initial=0.0) > cell.max_joint_step:
            return USELESS
        way = np.concatenate([path[segment][:1], path[segment][:1] + np.cumsum(steps, axis=0)])
        firsts.append(way[:, 0])
        for i in range(1, 6):
            shifted = way[:, i] + TURN * np.array(TURNS)[:, None]
            inside = np.all((shifted >= arm.lower[i]) & (shifted <= arm.upper[i]), axis=1)
            if not inside.any():
                return USELESS
            errors = cell.task.weights[segment] * (shifted[inside] - arm.reference[i]) ** 2
            total += arm.weights[i] * np.sum(errors, axis=1).min()
    return float(total + _yaw_cost(arm, firsts, cell.task.weights))


def _yaw_cost(arm: Arm, firsts: list[Floats], weights: Floats) -> float:
    """Least cost of joint 1 over every allowed yaw and every turn of every segment."""
    sigma = chain_of(arm.robot).vertical_sign
    best = USELESS
    for others in product(TURNS, repeat=len(firsts) - 1):  # of the later segments against the first
        first = np.concatenate([way + TURN * turn for way, turn in zip(firsts, (0, *others), strict=True)])
        for turn in range(-6, 7):
            ends = [-sigma * yaw + TURN * turn for yaw in (arm.base.yaw.low, arm.base.yaw.high)]
            low = max(min(ends), arm.lower[0] - first.min())
            high = min(max(ends), arm.upper[0] - first.max())
            if low <= high:
                wanted = arm.reference[0] - (np.average(first, weights=weights) if weights.any() else first.mean())
                shift = min(max(wanted, low), high)
                best = min(best, arm.weights[0] * float(np.sum(weights * (first + shift - arm.reference[0]) ** 2)))
    return best


def brute_force(
    cell: Cell,
    arm: Arm,
    counts: tuple[int, int, int],
    known: Floats | None = None,
    judge: Callable[[Cell, Arm, Floats], float] = cost_at,
) -> float:
    """Best objective found on a grid over the base region, the best few points refined.

    Args:
        cell: the task.
        arm: of six joints, the first upright.
        counts: grid points along x, y, z.
        known: (3,) a position worth trying as well.
        judge: what a position costs.
    """
    bounds = arm.base.bounds[:3]
    free = bounds[:, 1] > bounds[:, 0]
    axes = [
        np.linspace(pair[0], pair[1], count) if count > 1 else [pair.mean()]
        for pair, count in zip(bounds, counts, strict=True)
    ]
    points = [np.array(point) for point in product(*axes)]
    if known is not None:
        points.append(known)
    values = np.array([judge(cell, arm, point) for point in points])
    best = float(values.min())
    for index in np.argsort(values)[:3]:
        if values[index] >= USELESS or not free.any():
            continue

        def cost(x: Floats, start: Floats = points[index]) -> float:
            position = start.copy()
            position[free] = x
            if np.any(position < bounds[:, 0]) or np.any(position > bounds[:, 1]):
                return USELESS
            return judge(cell, arm, position)

        start = points[index][free]
        width = 0.5 * (bounds[free, 1] - bounds[free, 0]) / np.maximum(np.array(counts)[free] - 1, 1)
        towards_the_middle = np.where(start > bounds[free].mean(axis=1), -width, width)
        simplex = np.concatenate([start[None], start + np.diag(towards_the_middle)])
        found = minimize(
            cost,
            start,
            method="Nelder-Mead",
            options={"initial_simplex": simplex, "xatol": 1e-4, "fatol": 1e-6, "maxfev": 120},
        )
        best = min(best, float(found.fun))
    return best
