"""The objective around a layout, as a convex quadratic of the layout's unknowns."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.path_samples import follow
from duocell.optimizer.nlp.pose_rows import BASE
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.manifold import Directions, Unknowns, directions

STEP = 1e-4
"""m and rad, of the differences of the gradient."""
FLATTEST = 1e-6
"""Smallest curvature, relative to the largest, that a step may rely on; negative ones would lead it astray."""


@dataclass(frozen=True, eq=False, slots=True)
class Quadratic:
    """f(x + step) ≈ f(x) + gradient · step + ½ step · curvature · step.

    Attributes:
        gradient: (C,). curvature: (C, C), positive definite.
    """

    gradient: Floats
    curvature: Floats

    def change(self, step: Floats) -> float:
        """What f changes by."""
        return float(self.gradient @ step + 0.5 * step @ self.curvature @ step)


def quadratic(cell: Cell, points: Sequence[ArmSolution], along: Sequence[Directions], unknowns: Unknowns) -> Quadratic:
    """The model at a layout: the exact gradient; the curvature by differences of it, or Gauss-Newton's.

    Args:
        cell: the cell. points: one per arm. along: directions at their poses. unknowns: of the cell.
    """
    gradient, curvature = np.zeros(unknowns.count), np.zeros((unknowns.count, unknowns.count))
    for a, (arm, point, tangents) in enumerate(zip(cell.arms, points, along, strict=True)):
        own = unknowns.own(a, len(cell.task))
        slopes = _slopes(tangents)
        pull = cell.objective.gradient(arm, point.joints, cell.task.weights)
        gradient[own] = np.einsum("mnc,mn->c", slopes, pull)
        newton = _differences(cell, arm, point, tangents) if unknowns.nullspace[a] == 0 else None
        if newton is None:
            bent = cell.objective.curvature(arm, point.joints, cell.task.weights) @ slopes
            newton = np.einsum("mnc,mnk->ck", slopes, bent)
        curvature[np.ix_(own, own)] = _convex(newton)
    return Quadratic(gradient, curvature)


def _slopes(tangents: Directions) -> Floats:
    """(m, n, 4 + m d) derivatives of the joints by the arm's own unknowns."""
    m, n, nullspace = tangents.by_nullspace.shape
    slopes = np.zeros((m, n, BASE + m * nullspace))
    slopes[:, :, :BASE] = tangents.by_base
    for d in range(nullspace):
        slopes[np.arange(m), :, BASE + nullspace * np.arange(m) + d] = tangents.by_nullspace[:, :, d]
    return slopes


def _differences(cell: Cell, arm: Arm, point: ArmSolution, tangents: Directions) -> Floats | None:
    """(4, 4) central differences of the gradient by the base; None where the arm cannot follow."""
    targets, m = cell.flange_targets(arm, point.free), len(cell.task)
    shifts = np.repeat(STEP * np.eye(BASE), 2, axis=0) * np.tile([1.0, -1.0], BASE)[:, None]
    places = np.array([*point.position, point.yaw]) + shifts
    bases = np.repeat(arm.base_in_world(places[:, :3], places[:, 3]), m, axis=0)
    near = (point.joints + np.einsum("mnc,sc->smn", tangents.by_base, shifts)).reshape(2 * BASE * m, -1)
    q, good = follow(arm.robot, np.eye(4), inverse(bases) @ np.tile(targets, (2 * BASE, 1, 1)), near, near)
    if not np.all(good):
        return None
    there = directions(arm, bases[:, :3, :3], q).by_base.reshape(2 * BASE, m, -1, BASE)
    pull = cell.objective.gradient(arm, q.reshape(2 * BASE, m, -1), cell.task.weights)
    gradients = np.einsum("smnc,smn->sc", there, pull)
    rows = gradients.reshape(BASE, 2, BASE)
    difference: Floats = (rows[:, 0] - rows[:, 1]) / (2.0 * STEP)
    return 0.5 * (difference + difference.T)


def _convex(matrix: Floats) -> Floats:
    """The matrix with its negative and smallest eigenvalues raised."""
    values, vectors = np.linalg.eigh(matrix)
    least = max(FLATTEST * float(np.max(np.abs(values), initial=0.0)), 1e-9)
    raised: Floats = (vectors * np.maximum(values, least)) @ vectors.T
    return raised
