"""Values of the open parameters that a screening tries at every pose: what is between them is for the local solver."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.sampling import even_points
from duocell.models.cell.pose_freedom import PoseFreedom
from duocell.models.robot.arm import TURN
from duocell.models.robot.freedom import LENGTHS

SMALL_LENGTH, SMALL_ANGLE = 0.02, 0.1
"""m and rad; a range that is nowhere wider needs no samples, the local solver goes through all of it."""
ONE, MANY = {False: 24, True: 16}, {False: 48, True: 24}
"""Samples of one parameter, and of several together; fewer where the screening is coarse."""
LOOSE = 1.001
"""Times an allowed step, for rounding."""


@dataclass(frozen=True, eq=False, slots=True)
class ParameterSamples:
    """S choices of the open parameters at each of m poses.

    Attributes:
        values: (m, S, k) m and rad. links: (m - 1, S, S) True where a step from a choice to one of the next pose is
            allowed; None where all are.
    """

    values: Floats
    links: Bools | None

    @property
    def count(self) -> int:
        """S."""
        return int(self.values.shape[1])


def samples_of(freedom: PoseFreedom, poses: Ints, joined: Bools, coarse: bool) -> ParameterSamples:
    """Samples for some of the poses.

    Args:
        freedom: of all poses. poses: (m,) those that are asked about, ascending.
        joined: (m - 1,) True where the next of them is one of the same segment.
        coarse: fewer samples.
    """
    low, high = freedom.lower[poses], freedom.upper[poses]
    nominal = freedom.nominal[poses]
    endless = np.isinf(high)
    low, high = np.where(endless, nominal - 0.5 * TURN, low), np.where(endless, nominal + 0.5 * TURN, high)
    small = np.where(freedom.which < LENGTHS, SMALL_LENGTH, SMALL_ANGLE)
    wide = np.flatnonzero(np.any(high - low > small, axis=0))
    if not len(wide):
        return ParameterSamples(nominal[:, None, :].copy(), None)
    shares = _shares(freedom, wide, bool(np.any(endless[:, wide])), coarse)
    values = np.repeat(nominal[:, None, :], len(shares), axis=1)
    values[:, :, wide] = low[:, None, wide] + shares * (high - low)[:, None, wide]
    values = np.concatenate([values, nominal[:, None, :]], axis=1)
    return ParameterSamples(values, _links(freedom, poses, joined, values, endless))


def _shares(freedom: PoseFreedom, wide: Ints, endless: bool, coarse: bool) -> Floats:
    """(S, w) in [0, 1], where in their ranges the choices lie."""
    if len(wide) == 1:
        count = ONE[coarse]
        return (np.arange(count) / count if endless else np.linspace(0.0, 1.0, count))[:, None]
    return even_points(len(wide), MANY[coarse], 0)


def _links(freedom: PoseFreedom, poses: Ints, joined: Bools, values: Floats, endless: Bools) -> Bools | None:
    """(m - 1, S, S) which steps are allowed; a choice and the same choice at the next pose always go together."""
    if np.all(np.isinf(freedom.steps)):
        return None
    allowed = LOOSE * np.diff(poses)[:, None] * freedom.steps
    apart = np.abs(values[1:, None, :, :] - values[:-1, :, None, :])
    turned = np.abs(apart - TURN * np.round(apart / TURN))
    apart = np.where((endless[1:] | endless[:-1])[:, None, None, :], turned, apart)
    links: Bools = np.all(apart <= allowed[:, None, None, :], axis=-1) | ~joined[:, None, None]
    return links | np.eye(values.shape[1], dtype=np.bool_)
