"""From joint angles modulo 2π to a path: unwrapping, the best 2π lifts, the best yaw.

All functions take paths with the poses on the last axis and any number of axes before it.
"""

from __future__ import annotations

import numpy as np

from models.arm import TURN, BaseRegion
from models.arrays import Floats


def unwrap(joints: Floats) -> tuple[Floats, Floats]:
    """Take every step the short way round, in place.

    Args:
        joints: (..., m) rad modulo 2π.

    Returns:
        The same array, continuous, and the largest step (...) rad, at most π.
    """
    steps = np.diff(joints, axis=-1)
    turns = np.round(steps / TURN)
    steps -= TURN * turns
    joints[..., 1:] -= TURN * np.cumsum(turns, axis=-1)
    return joints, np.max(np.abs(steps), axis=-1, initial=0.0)


def lift(path: Floats, lower: float, upper: float, reference: float) -> Floats:
    """Shift each path (..., m) in place by the 2π multiple that costs least inside the limits.

    The cost is a convex quadratic of the shift, so the nearest allowed multiple to its minimiser is the best one.

    Returns:
        (...) rad, what sticks out of the limits.
    """
    wanted = np.round((reference - np.mean(path, axis=-1)) / TURN)
    if not np.isfinite(upper - lower):
        path += TURN * wanted[..., None]
        return np.zeros(path.shape[:-1])
    low, high = np.min(path, axis=-1), np.max(path, axis=-1)
    first, last = np.ceil((lower - low) / TURN - 1e-12), np.floor((upper - high) / TURN + 1e-12)
    centred = np.round((0.5 * (lower + upper) - 0.5 * (low + high)) / TURN)
    lifts = np.where(first <= last, np.clip(wanted, first, last), centred)
    path += TURN * lifts[..., None]
    low, high = low + TURN * lifts, high + TURN * lifts
    outside: Floats = np.maximum(lower - low, 0.0) + np.maximum(high - upper, 0.0)
    return outside


def choose_yaw(
    path: Floats, lower: float, upper: float, reference: float, region: BaseRegion, sigma: int
) -> tuple[Floats, Floats]:
    """Shift the path of joint 1 in place by the best base yaw and 2π lift.

    A base yaw shifts joint 1 by ``-sigma · yaw`` and nothing else, so the best one is a clipped mean.

    Args:
        path: (..., m) rad, joint 1 for a yaw of zero, continuous.
        lower: rad, limit of joint 1. upper: likewise.
        reference: rad, of joint 1.
        region: allowed yaw.
        sigma: sense of joint 1 about the vertical, ±1.

    Returns:
        yaw (...) in the allowed interval, and (...) rad, what sticks out of the limits.
    """
    first = path[..., 0].copy()
    wanted = reference - np.mean(path, axis=-1)
    low, high = lower - np.min(path, axis=-1), upper - np.max(path, axis=-1)
    with np.errstate(invalid="ignore"):  # limits of a joint without end
        shift = np.where(low <= high, np.clip(wanted, low, high), 0.5 * (low + high))
    if not region.yaw_free:
        start = min(-sigma * region.yaw.low, -sigma * region.yaw.high)
        shift = _nearest_allowed(shift, low, high, start, region.yaw.width)
    path += shift[..., None]
    beyond = np.maximum(low - shift, 0.0) + np.maximum(shift - high, 0.0)
    yaw = -sigma * (path[..., 0] - first)
    return region.yaw.low + _modulo(yaw - region.yaw.low, region.yaw.width), beyond


def _nearest_allowed(shift: Floats, low: Floats, high: Floats, start: float, width: float) -> Floats:
    """The shift of joint 1 in ``[start, start + width] + 2πk`` nearest to ``shift``, inside (low, high) if possible."""
    turn = np.floor((shift - start) / TURN)
    before = np.minimum(shift, start + TURN * turn + width)
    after = start + TURN * (turn + 1.0)
    outside_before = np.maximum(low - before, 0.0) + np.maximum(before - high, 0.0)
    outside_after = np.maximum(low - after, 0.0) + np.maximum(after - high, 0.0)
    worse = (outside_before > outside_after) | (
        (outside_before == outside_after) & (np.abs(before - shift) > np.abs(after - shift))
    )
    return np.where(worse, after, before)


def _modulo(offset: Floats, width: float) -> Floats:
    """``offset`` modulo 2π in [0, width]; rounding that falls just outside is pulled back to the nearer end."""
    wrapped = np.mod(offset, TURN)
    past = wrapped > min(width, TURN)
    nearer_start = TURN - wrapped < wrapped - width
    return np.where(past, np.where(nearer_start, 0.0, min(width, TURN)), wrapped)
