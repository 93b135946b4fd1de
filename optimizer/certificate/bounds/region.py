"""The part of a base region from which every pose is near enough."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.kept import KEPT
from duocell.optimizer.certificate.bounds.angles.targets import Targets

SLACK = 5.0 * KEPT
"""m, for rounding and what a check lets pass: a base so far out of its region, a hand as far off its pose."""
MARGIN = np.array([-KEPT, KEPT])
"""m, what is added to the sides of a base region where nothing that a check lets pass may be left out."""
THIN = 1e-5
"""m; no more than that is no side to be searched."""


@dataclass(frozen=True, eq=False, slots=True)
class Region:
    """A box of base positions.

    Attributes:
        low: (3,) m. high: (3,) m; below ``low`` somewhere if the box is empty.
        culprits: (m,) True for the poses whose reach leaves nothing; all False if something is left.
        reach: m, scale of the arm.
    """

    low: Floats
    high: Floats
    culprits: Bools
    reach: float

    @property
    def empty(self) -> bool:
        """True if no base in the region is near enough to every pose."""
        return bool(np.any(self.high < self.low))


def reachable_region(targets: Targets, bounds: Floats) -> Region:
    """Cut a base region (3, 2) to what the reach of every pose leaves.

    With H and f the coordinates of W in the plane of the arm, ``|H - shoulder|`` and ``|f - shoulder|`` are at most
    the length of the links; height over the base is ``H level + offset lean``, distance from axis 1 is hypot(o, f).
    """
    form, lean, level = targets.form, targets.lean, targets.level
    links = form.planar.upper + form.planar.fore + float(np.hypot(*form.planar.hand))
    up = level * links + abs(lean) * form.offset
    middle = level * form.planar.shoulder[1]
    offset = (form.offset + abs(lean) * (abs(middle) + up)) / level
    across = float(np.hypot(offset, abs(form.planar.shoulder[0]) + links))
    centre = (targets.wrist - np.array([0.0, 0.0, targets.sigma * middle])) @ targets.mount.T
    half = np.abs(targets.mount) @ np.array([across, across, up]) + (SLACK + targets.apart.wrist)
    lows, highs = np.maximum(centre - half, bounds[:, 0]), np.minimum(centre + half, bounds[:, 1])
    low, high = np.max(lows, axis=0), np.min(highs, axis=0)
    culprits = np.zeros(len(centre), dtype=bool)
    for k in np.flatnonzero(high < low)[:1]:
        culprits[[np.argmax(lows[:, k]), np.argmin(highs[:, k])]] = True
        alone = lows[:, k] > highs[:, k]  # out of reach from everywhere, without the other poses
        culprits = alone if np.any(alone) else culprits
    return Region(low, high, culprits, across)
