"""From joint angles modulo 2π to a path: unwrapping, the best 2π windings, the best yaw.

All functions take paths with the poses on the last axis and any number of axes before it. Where a path consists of
several segments (`starts`: index of the first pose of each), every segment is unwrapped and gets windings by itself;
the yaw is the same for all of them. ``weights`` (m,) are what the poses count for, None for 1.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.robot.arm import TURN, BaseRegion
from duocell.optimizer.reduction.common_yaw import SegmentShifts

Starts = tuple[int, ...]
ONE: Starts = (0,)
"""A path of one segment."""


def unwrap(joints: Floats, starts: Starts = ONE) -> tuple[Floats, Floats]:
    """Take every step the short way round, in place.

    Args:
        joints: (..., m) rad modulo 2π.
        starts: of the segments.

    Returns:
        The same array, continuous within each segment, and the largest step there (...) rad, at most π.
    """
    if len(starts) > 1:
        largest = [unwrap(part)[1] for part in _segments(joints, starts)]
        return joints, np.max(largest, axis=0)
    steps = np.diff(joints, axis=-1)
    turns = np.round(steps / TURN)
    steps -= TURN * turns
    joints[..., 1:] -= TURN * np.cumsum(turns, axis=-1)
    return joints, np.max(np.abs(steps), axis=-1, initial=0.0)


def choose_windings(
    path: Floats,
    lower: float,
    upper: float,
    reference: float,
    weights: Floats | None = None,
    starts: Starts = ONE,
) -> Floats:
    """Shift each path (..., m) in place by the 2π multiple that costs least inside the limits.

    The cost is a convex quadratic of the shift, so the nearest allowed multiple to its minimiser is the best one.

    Returns:
        (...) rad, what sticks out of the limits, added over the segments.
    """
    if len(starts) > 1:
        shares = _shares(weights, starts)
        parts = zip(_segments(path, starts), shares, strict=True)
        total: Floats = np.sum([choose_windings(part, lower, upper, reference, share) for part, share in parts], axis=0)
        return total
    wanted = np.round((reference - mean(path, weights)) / TURN)
    if not np.isfinite(upper - lower):
        path += TURN * wanted[..., None]
        return np.zeros(path.shape[:-1])
    low, high = np.min(path, axis=-1), np.max(path, axis=-1)
    first, last = np.ceil((lower - low) / TURN - 1e-12), np.floor((upper - high) / TURN + 1e-12)
    centred = np.round((0.5 * (lower + upper) - 0.5 * (low + high)) / TURN)
    windings = np.where(first <= last, np.clip(wanted, first, last), centred)
    path += TURN * windings[..., None]
    low, high = low + TURN * windings, high + TURN * windings
    outside: Floats = np.maximum(lower - low, 0.0) + np.maximum(high - upper, 0.0)
    return outside


def choose_yaw(
    path: Floats,
    lower: float | Floats,
    upper: float | Floats,
    reference: float,
    region: BaseRegion,
    sigma: int,
    weights: Floats | None = None,
    starts: Starts = ONE,
) -> tuple[Floats, Floats]:
    """Shift the path of joint 1 in place by the best base yaw and 2π winding.

    A base yaw shifts joint 1 by ``-sigma · yaw`` and nothing else, so the best one is a clipped mean.

    Args:
        path: (..., m) rad, joint 1 for a yaw of zero, continuous.
        lower: rad, limit of joint 1, or one for each value of the path (..., m). upper: likewise.
        reference: rad, of joint 1.
        region: allowed yaw.
        sigma: sense of joint 1 about the vertical, ±1.
        weights: of the poses. starts: of the segments.

    Returns:
        yaw (...) in the allowed interval, and (...) rad, what sticks out of the limits.
    """
    if len(starts) > 1:
        return _choose_common_yaw(path, (lower, upper, reference), region, sigma, weights, starts)
    first = path[..., 0].copy()
    wanted = reference - mean(path, weights)
    low, high = np.max(lower - path, axis=-1), np.min(upper - path, axis=-1)
    with np.errstate(invalid="ignore"):  # limits of a joint without end
        shift = np.where(low <= high, np.clip(wanted, low, high), 0.5 * (low + high))
    if not region.yaw_free:
        start = min(-sigma * region.yaw.low, -sigma * region.yaw.high)
        shift = _nearest_allowed(shift, low, high, start, region.yaw.width)
    path += shift[..., None]
    beyond = np.maximum(low - shift, 0.0) + np.maximum(shift - high, 0.0)
    yaw = -sigma * (path[..., 0] - first)
    return region.yaw.low + _modulo(yaw - region.yaw.low, region.yaw.width), beyond


def _choose_common_yaw(
    path: Floats,
    joint: tuple[float | Floats, float | Floats, float],
    region: BaseRegion,
    sigma: int,
    weights: Floats | None,
    starts: Starts,
) -> tuple[Floats, Floats]:
    """As `choose_yaw` for several segments: one yaw, a winding for each segment."""
    lower, upper, reference = joint
    parts, shares = _segments(path, starts), _shares(weights, starts)
    shifts = SegmentShifts(
        wanted=np.array([reference - mean(part, share) for part, share in zip(parts, shares, strict=True)]),
        weights=np.array([part.shape[-1] if s is None else np.sum(s) for part, s in zip(parts, shares, strict=True)]),
        low=np.array([np.max(part, axis=-1) for part in _segments(lower - path, starts)]),
        high=np.array([np.min(part, axis=-1) for part in _segments(upper - path, starts)]),
        start=np.asarray(0.0 if region.yaw_free else min(-sigma * region.yaw.low, -sigma * region.yaw.high)),
        width=TURN if region.yaw_free else region.yaw.width,
    )
    best = shifts.best()
    impossible = np.isinf(best.cost)
    if np.any(impossible):
        nearest = shifts.nearest()
        shift = np.where(impossible, nearest.yaw_shift, best.yaw_shift)
        turns = np.where(impossible, nearest.turns, best.turns)
    else:
        shift, turns = best.yaw_shift, best.turns
    total = shift + TURN * turns
    for part, own in zip(parts, total, strict=True):
        part += own[..., None]
    beyond = np.sum(np.maximum(shifts.low - total, 0.0) + np.maximum(total - shifts.high, 0.0), axis=0)
    yaw = region.yaw.low + _modulo(-sigma * shift - region.yaw.low, region.yaw.width)
    return yaw, np.where(impossible, beyond, 0.0)


def mean(path: Floats, weights: Floats | None) -> Floats:
    """(...) mean over the poses; weights that are all 0 count as 1."""
    if weights is None or not np.any(weights):
        return np.asarray(np.mean(path, axis=-1))
    return np.asarray(path @ weights / np.sum(weights))


def _segments(path: Floats, starts: Starts) -> list[Floats]:
    """Views of the segments (..., m_b) of a path (..., m)."""
    return np.split(path, starts[1:], axis=-1)


def _shares(weights: Floats | None, starts: Starts) -> list[Floats] | list[None]:
    """The weights of each segment's poses."""
    return [None] * len(starts) if weights is None else np.split(weights, starts[1:])


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
