"""Branch choice along the path for arms without a posture index: a shortest path through the layers of branches.

Every pose has a layer of inverse-kinematics branches (for a redundant arm: of sampled ones). A path takes one branch
per pose; consecutive ones must be within the allowed joint step. The cheapest path is found by dynamic programming
over the layers, and then unwrapped, given windings and given its best yaw like any other
(`duocell.optimizer.reduction.paths`). The segments of a task sequence get a shortest path each, in one posture where
the arm has postures.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import posture_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.inverse import branches
from duocell.models.kinematics.nominal import posture_form
from duocell.models.kinematics.wrist_singularity import wrist_shortfall
from duocell.models.objective.objective import Objective
from duocell.models.robot.arm import SINGULAR_WRIST, TURN, Arm
from duocell.models.robot.posture import ALL_SIGNS, Signs
from duocell.optimizer.nlp.measure import objective_of, step_excess
from duocell.optimizer.reduction.linear_sums import first_joint_limits, keep_sums, sum_excess
from duocell.optimizer.reduction.paths import choose_windings, choose_yaw, unwrap

BEYOND = 100.0
"""Cost of a radian outside the limits in the choice of branches: such a path may still be repaired."""
EXCLUDED = 1e3
"""Violation of a path whose posture the request does not admit."""
LEAP = 1e4
"""Cost of a step that is too long, per radian beyond the allowed one."""


@dataclass(frozen=True, eq=False, slots=True)
class LayeredPath:
    """A continuous path of an arm standing at one place.

    Attributes:
        position: (3,) m. yaw: rad. joints: (m, n) rad.
        objective: E of the arm. violation: rad beyond limits and steps; infinite if some pose has no branch.
        unreached: indices of poses without any branch.
        signs: its posture, for arms that have one.
    """

    position: Floats
    yaw: float
    joints: Floats
    objective: float
    violation: float
    unreached: tuple[int, ...] = ()
    signs: Signs | None = None


class StepLimits(NamedTuple):
    """What joints may do from pose to pose: ``most`` (n,) rad or m, and which are ``prismatic`` (n,)."""

    most: Floats
    prismatic: Bools


def layers_at(cell: Cell, arm: Arm, position: Floats, yaw: float, poses: Floats | None = None) -> list[Floats]:
    """Branches (K_j, n) of the poses (all, or the given indices) with the base at one place."""
    targets = cell.flange_targets(arm)
    chosen = targets if poses is None else targets[poses.astype(int)]
    found = branches(arm.robot, inverse(arm.base_in_world(position, yaw)) @ chosen)
    form = posture_form(arm.robot)
    if form is None or arm.posture.free:
        return list(found)
    return [
        np.array([q for q in layer if arm.posture.admits(posture_of(form, q))]).reshape(-1, arm.dof) for layer in found
    ]


def node_costs(objective: Objective, arm: Arm, layer: Floats, skip_first: bool, weight: float = 1.0) -> Floats:
    """(K,) cheapest cost of each branch by itself, every joint in its best turn.

    Args:
        objective: of the cell.
        arm: limits, reference and weights.
        layer: (K, n) rad modulo 2π, or m.
        skip_first: leave joint 1 out, because the base yaw will set it.
        weight: of the pose.
    """
    turn = np.where(arm.robot.prismatic, 0.0, TURN)
    values = layer + turn * np.round((arm.reference - layer) / TURN)
    low = np.where(np.isfinite(arm.lower), arm.lower, -np.inf)
    high = np.where(np.isfinite(arm.upper), arm.upper, np.inf)
    values = np.where(values < low, values + turn * np.ceil(np.maximum(low - values, 0.0) / TURN), values)
    values = np.where(values > high, values - turn * np.ceil(np.maximum(values - high, 0.0) / TURN), values)
    outside = np.maximum(low - values, 0.0) + np.maximum(values - high, 0.0)
    here = values
    if skip_first:
        here = np.concatenate([np.broadcast_to(arm.reference[:1], (len(values), 1)), values[:, 1:]], axis=1)
    total = weight * objective.of_poses(arm, here)
    total += BEYOND * np.sum(outside[:, 1:] if skip_first else outside, axis=1)
    if arm.linear_limits is not None:
        sums = arm.linear_limits.violation(values)
        total += BEYOND * np.sum(sums if not skip_first else sums * (arm.linear_limits.matrix[:, 0] == 0.0), axis=1)
    return total + BEYOND / SINGULAR_WRIST * wrist_shortfall(arm, layer.T[..., None])


def best_path(cell: Cell, arm: Arm, position: Floats, yaw: float) -> LayeredPath:
    """The cheapest continuous path with the base at ``position`` (3,) [m].

    Args:
        cell: task and step limit.
        arm: the arm.
        position: base origin in the world.
        yaw: rad; where a yaw only shifts joint 1 it is replaced by the best one.
    """
    sigma = chain_of(arm.robot).vertical_sign
    layers = layers_at(cell, arm, position, 0.0 if sigma else yaw)
    unreached = tuple(j for j, layer in enumerate(layers) if not len(layer))
    if unreached:
        return LayeredPath(position, yaw, np.empty((0, arm.dof)), np.inf, np.inf, unreached)
    weights = cell.task.weights / cell.task.weight_scale
    costs = [
        node_costs(cell.objective, arm, layer, bool(sigma), float(w)) for layer, w in zip(layers, weights, strict=True)
    ]
    joints = _cheapest(cell, arm, layers, costs).T.copy()
    return finish_path(cell, arm, position, 0.0 if sigma else yaw, joints)


def finish_path(cell: Cell, arm: Arm, position: Floats, yaw: float, joints: Floats) -> LayeredPath:
    """Unwrap joint values (n, m) found with the base at ``position`` and ``yaw``, choose their windings and the best
    yaw.
    """
    sigma = chain_of(arm.robot).vertical_sign
    task = cell.task
    segments = task.weights, task.starts
    slides = int(arm.robot.slides)
    _, step = unwrap(joints[slides:], task.starts)
    violation = max(float(np.max(step)) - cell.max_joint_step, 0.0)
    if slides:
        violation += max(step_excess(cell, arm, joints.T), float(np.max(arm.limit_excess(joints.T)[:, 0])), 0.0)
    for i in range(max(int(sigma != 0), slides), arm.dof):
        violation += float(choose_windings(joints[i], arm.lower[i], arm.upper[i], arm.reference[i], *segments))
    keep_sums(arm, joints, task.starts, free_yaw=bool(sigma))
    if sigma:
        joints[0] += sigma * yaw  # as if the yaw were zero
        best, out = choose_yaw(
            joints[0], *first_joint_limits(arm, joints), arm.reference[0], arm.base, sigma, *segments
        )
        yaw, violation = float(best), violation + float(out)
    path = joints.T
    violation += float(wrist_shortfall(arm, joints)) + float(sum_excess(arm, joints))
    objective = objective_of(cell, arm, path)
    form = posture_form(arm.robot)
    postures = (
        []
        if form is None
        else [posture_of(form, path[(segment.start + segment.stop) // 2]) for segment in task.segments]
    )
    signs = postures[0] if postures else None
    if signs is not None and not (arm.posture.admits(signs) and len(set(postures)) == 1):
        violation += EXCLUDED
    signs = None if closed_form(arm.robot) is None else signs  # programs of arms not quite as drawn know of none
    return LayeredPath(position, yaw, path, objective, violation, signs=signs)


def _cheapest(cell: Cell, arm: Arm, layers: list[Floats], costs: list[Floats]) -> Floats:
    """(m, n) the branches taken: a shortest path for each segment, in one posture where there are several segments."""
    segments, form = cell.task.segments, posture_form(arm.robot)
    limits = StepLimits(cell.step_limits(arm.robot), arm.robot.prismatic)
    paths = []
    if form is not None and len(segments) > 1:
        signs = [[posture_of(form, q) for q in layer] for layer in layers]
        for posture in ALL_SIGNS:
            own = [[k for k, other in enumerate(layer) if other == posture] for layer in signs]
            if all(own):
                some = [layer[k] for layer, k in zip(layers, own, strict=True)]
                paths.append(_segments(segments, some, [c[k] for c, k in zip(costs, own, strict=True)], limits))
    return min(paths or [_segments(segments, layers, costs, limits)], key=lambda path: path[0])[1]


def _segments(
    segments: tuple[slice, ...], layers: list[Floats], costs: list[Floats], limits: StepLimits
) -> tuple[float, Floats]:
    """The cost of a shortest path for each segment by itself, and the branches (m, n) taken."""
    total, taken = 0.0, []
    for segment in segments:
        cost, chosen = _shortest(layers[segment], costs[segment], limits)
        total += cost
        taken += [layer[k] for layer, k in zip(layers[segment], chosen, strict=True)]
    return total, np.array(taken)


def _shortest(layers: list[Floats], costs: list[Floats], limits: StepLimits) -> tuple[float, list[int]]:
    """Cost of the shortest path, and the index of the branch it takes in each layer."""
    total, back = costs[0], []
    for before, after, cost in zip(layers, layers[1:], costs[1:], strict=False):
        step, excess = np.zeros((2, len(before), len(after)))
        for i in range(before.shape[1]):
            turn = np.subtract.outer(before[:, i], after[:, i])
            if not limits.prismatic[i]:
                turn -= TURN * np.round(turn / TURN)
            np.abs(turn, out=turn)
            np.maximum(step, turn, out=step)
            np.maximum(excess, turn - limits.most[i], out=excess)
        costs_to = total[:, None] + LEAP * excess + 1e-6 * step
        best = np.argmin(costs_to, axis=0)
        back.append(best)
        total = costs_to[best, np.arange(len(after))] + cost
    path = [int(np.argmin(total))]
    for best in reversed(back):
        path.append(int(best[path[-1]]))
    return float(np.min(total)), path[::-1]
