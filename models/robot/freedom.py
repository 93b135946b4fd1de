"""What a task leaves open: by how much the tool of an arm may be displaced at every pose, and how fast that may change.

A displacement is the product of eight elementary ones, each of which has one parameter:

    D = Trans(x, y, z) · Tilt(u, v) · Rot(x, a) · Rot(y, b) · Rot(z, c)

in axes that the request chooses. Tilt takes the z axis anywhere within a cone, the shortest way; the three turns after
it are the ranges of a box, or the roll about an axis. The displacement subgroups of R. Di Gregorio's chapter (a turn
about an axis, a cylinder, a plane, a sphere, a motion without rotation) are choices of the parameters that are open.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import IntEnum

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints, set_frozen

NAMES = ("x", "y", "z", "tilt_x", "tilt_y", "turn_x", "turn_y", "turn_z")
"""Of the parameters: m the first three, rad the others."""
SIZE = len(NAMES)
LENGTHS = 3
"""The first so many parameters are lengths."""
TILT = slice(3, 5)


class Frame(IntEnum):
    """The axes of a displacement, and the point that it turns about."""

    TOOL = 0
    """The tool centre point and its axes."""
    PART = 1
    """The origin and the axes of the part."""
    WORLD = 2
    """The tool centre point where the task wants it, and the axes of the world."""


@dataclass(frozen=True, eq=False)
class Freedom:
    """The displacements that an arm may choose from, pose by pose.

    Attributes:
        lower: (m, 8) m and rad, of the parameters in the order of `NAMES`. upper: (m, 8), not below. Both equal: the
            parameter is given. Those of the tilt are within its cone, see `duocell.models.cell.displacement`.
        cone: (m,) rad, half the opening angle of the cone of the tilt; 0 without one.
        axes: (m, 3, 3) columns are the axes x, y, z of the displacement, in the frame.
        frames: (m,) a `Frame` for each pose.
        steps: (8,) m and rad that a parameter may change by from pose to pose of a segment; infinite for any, 0 for one
            value at all poses.
        stand_in: True if the roll that is given stands for one that is open: steps of the last joint then say nothing.
    """

    lower: Floats
    upper: Floats
    cone: Floats
    axes: Floats
    frames: Ints
    steps: Floats
    stand_in: bool = False

    def __post_init__(self) -> None:
        m = len(self.lower)
        set_frozen(self, "lower", self.lower, (m, SIZE))
        set_frozen(self, "upper", self.upper, (m, SIZE))
        set_frozen(self, "cone", self.cone, (m,))
        set_frozen(self, "axes", self.axes, (m, 3, 3))
        set_frozen(self, "steps", self.steps, (SIZE,))
        if np.any(self.lower > self.upper):
            raise ValueError("a parameter of a displacement has an empty range")

    def __len__(self) -> int:
        return len(self.lower)

    @property
    def open(self) -> Bools:
        """(8,) True for parameters that are open at some pose."""
        free: Bools = np.any(self.upper > self.lower, axis=0)
        return free

    def rows(self, which: Ints) -> Freedom:
        """The same for some of the poses, in the given order."""
        return replace(
            self,
            lower=self.lower[which],
            upper=self.upper[which],
            cone=self.cone[which],
            axes=self.axes[which],
            frames=self.frames[which],
        )

    def fixed(self, values: Floats) -> Freedom:
        """One displacement for each pose, from parameters (m, 8)."""
        return replace(self, lower=values, upper=values)

    def with_places(self, rows: Ints, steps: Ints, fractions: Floats) -> Freedom:
        """The same with places between the poses as further poses, whose ranges lie between those of their neighbours.

        Args:
            rows: (m,) where the poses are in the longer task. steps: (K,) the pose before each place.
            fractions: (K,) of the way to the next.
        """
        added = np.ones(len(rows) + len(steps), dtype=np.bool_)
        added[rows] = False
        before = np.empty(len(added), dtype=np.int64)
        before[rows], before[added] = np.arange(len(rows)), steps
        share = np.zeros(len(added))
        share[added] = fractions
        after = np.where(share > 0.0, before + 1, before)

        def between(values: Floats) -> Floats:
            factor = share.reshape(-1, *[1] * (values.ndim - 1))
            one, other = values[before], values[after]
            ends = np.isinf(one) | np.isinf(other)
            with np.errstate(invalid="ignore"):  # ends that are infinite
                between_ends = one + factor * (other - one)
            return np.where(ends, one, between_ends)

        return replace(self.rows(before), lower=between(self.lower), upper=between(self.upper), cone=between(self.cone))
