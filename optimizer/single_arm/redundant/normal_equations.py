"""Small positive definite systems, one for each of many columns, solved by loops over their few rows.

A batched LAPACK call costs microseconds per 6x6 matrix; the same written out over contiguous rows of all columns costs
a tenth of that.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats

SMALLEST_PIVOT = 1e-14
PASSES = 5
"""Solves of a bounded quadratic at most; four coordinates are seldom fixed and released oftener."""


def factorised(jacobian: Floats, inverse_metric: Floats, damping: Floats) -> tuple[Floats, Floats]:
    """Cholesky factor of ``J W⁻¹ Jᵀ + εI``.

    Args:
        jacobian: (n, 6, N). inverse_metric: (n, N), the diagonal of W⁻¹. damping: (N,) ε.

    Returns:
        The lower factor (6, 6, N) (what is above the diagonal is arbitrary), and ``W⁻¹ Jᵀ`` as (n, 6, N).
    """
    weighted = jacobian * inverse_metric[:, None]
    factor = np.empty((6, 6, jacobian.shape[2]))
    for a in range(6):
        factor[a:, a] = np.einsum("in,ibn->bn", weighted[:, a], jacobian[:, a:])
        factor[a, a] += damping
    for a in range(6):
        for b in range(a):
            factor[a:, a] -= factor[a:, b] * factor[a, b]
        factor[a, a] = np.sqrt(np.maximum(factor[a, a], SMALLEST_PIVOT))
        factor[a + 1 :, a] /= factor[a, a]
    return factor, weighted


def forwards(factor: Floats, rows: Floats) -> None:
    """Solve ``L y = rows`` in place; rows (6, ..., N)."""
    for a in range(6):
        for b in range(a):
            rows[a] -= factor[a, b] * rows[b]
        rows[a] /= factor[a, a]


def backwards(factor: Floats, rows: Floats) -> None:
    """Solve ``Lᵀ y = rows`` in place; rows (6, N)."""
    for a in range(5, -1, -1):
        for b in range(a + 1, 6):
            rows[a] -= factor[b, a] * rows[b]
        rows[a] /= factor[a, a]


def bounded_step(hessian: Floats, gradient: Floats, lower: Floats, upper: Floats) -> Floats:
    """(K, d) minimisers of convex quadratics within bounds, by active sets.

    What leaves its bounds is fixed there and the rest solved again; where nothing leaves, what the gradient draws
    inwards is released. All quadratics go through the same few passes; one that needs more is clipped.

    Args:
        hessian: (K, d, d). gradient: (K, d). lower: (K, d) <= 0 <= upper: (K, d).
    """
    diagonal = np.arange(hessian.shape[1])
    fixed = np.zeros(gradient.shape, dtype=np.bool_)
    value = np.zeros(gradient.shape)
    for _ in range(PASSES):
        rest = np.where(fixed, -value, gradient + np.einsum("kab,kb->ka", hessian, value))
        reduced = np.where(fixed[:, :, None] | fixed[:, None, :], 0.0, hessian)
        reduced[:, diagonal, diagonal] = np.where(fixed, 1.0, hessian[:, diagonal, diagonal])
        step = -np.linalg.solve(reduced, rest[..., None])[..., 0]
        leaving = ~fixed & ((step < lower) | (step > upper))
        slope = gradient + np.einsum("kab,kb->ka", hessian, step)
        inwards = fixed & np.where(value <= lower, slope < 0.0, slope > 0.0)
        inwards &= ~np.any(leaving, axis=1, keepdims=True)
        if not np.any(leaving | inwards):
            break
        fixed = (fixed | leaving) & ~inwards
        value = np.where(fixed, np.clip(step, lower, upper), 0.0)
    return np.clip(step, lower, upper)
