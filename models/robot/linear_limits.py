"""Linear limits between the joints of one arm, as parallelogram arms have them: a sum of joint values has a range.

Two joints that are driven through one linkage cannot be in any two of their places at once: an arm whose joint 3 is
held by a parallelogram folds no farther than joint 2 leaves it. Each such limit is one row
``lower <= Σ_j c_j q_j <= upper`` in joint values, counted with their turns.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.base.errors import InvalidRobot

LEAST, MOST = 0.01, 100.0
"""Size of coefficients that are not 0."""
NARROWEST = 1e-4
"""rad; a row with less room leaves no way to follow a task along."""


@dataclass(frozen=True, eq=False)
class LinearLimits:
    """Rows ``lower <= matrix @ q <= upper``.

    Attributes:
        names: of the rows, for people. matrix: (k, n) dimensionless. lower: (k,) rad. upper: (k,) rad.

    Raises:
        InvalidRobot: a row without a joint, or with less room than `NARROWEST`; a coefficient out of range, or what is
            no number.
    """

    names: tuple[str, ...]
    matrix: Floats
    lower: Floats
    upper: Floats

    def __post_init__(self) -> None:
        rows = len(self.names)
        set_frozen(self, "matrix", self.matrix, (rows, None))
        for name in ("lower", "upper"):
            set_frozen(self, name, getattr(self, name), (rows,))
        for k in range(rows):
            fault = row_fault(self.matrix[k].tolist(), float(self.lower[k]), float(self.upper[k]))
            if fault is not None:
                raise InvalidRobot(f"linear limit {self.names[k]}: {fault}")

    def __len__(self) -> int:
        return len(self.names)

    def values(self, joints: Floats) -> Floats:
        """(..., k) rad, the sums at joint values (..., n)."""
        values: Floats = joints @ self.matrix.T
        return values

    def violation(self, joints: Floats) -> Floats:
        """(..., k) rad by which the sums at joint values (..., n) lie outside their range; 0 inside."""
        values = self.values(joints)
        outside: Floats = np.maximum(np.maximum(self.lower - values, values - self.upper), 0.0)
        return outside

    def narrowed(self, amount: float) -> LinearLimits:
        """The same rows, narrower by ``amount`` [rad] at either end, but never to less than a point."""
        room = np.minimum(amount, 0.5 * (self.upper - self.lower - NARROWEST))
        return replace(self, lower=self.lower + room, upper=self.upper - room)

    def without(self, row: int) -> LinearLimits | None:
        """The other rows; None where there are none."""
        kept = [k for k in range(len(self)) if k != row]
        names = tuple(self.names[k] for k in kept)
        return LinearLimits(names, self.matrix[kept], self.lower[kept], self.upper[kept]) if kept else None


def row_fault(coefficients: Sequence[float], lower: float, upper: float) -> str | None:
    """What is wrong with a row, with what to do; None if nothing is."""
    sizes = np.abs(np.asarray(coefficients, dtype=np.float64))
    if not np.any(sizes > 0.0):
        return "every coefficient is 0. Give those of the joints that it is about."
    if not np.all((sizes == 0.0) | ((sizes >= LEAST) & (sizes <= MOST))):
        return f"a coefficient is 0, or between {LEAST:g} and {MOST:g} on either side of it. Scale the row."
    if not (np.isfinite(lower) and np.isfinite(upper)):
        return f"lower ({lower:g}) and upper ({upper:g}) are no angles. Give both in rad."
    if upper - lower < NARROWEST:
        return (
            f"lower ({lower:g} rad) is not {NARROWEST:g} rad below upper ({upper:g} rad). Exchange them, or widen the "
            "range."
        )
    return None


def row_name(coefficients: Sequence[float], joints: Sequence[str]) -> str:
    """The name of a row that was given none: its sum, as ``joint_2 + joint_3``."""
    words = []
    for value, joint in zip(coefficients, joints, strict=True):
        if value != 0.0:
            size = "" if abs(value) == 1.0 else f"{abs(value):g} "
            words.append(f"{'-' if value < 0.0 else '+'} {size}{joint}")
    return " ".join(words).removeprefix("+ ")


def sums_between(coefficients: Floats, lower: Floats, upper: Floats) -> tuple[float, float]:
    """rad, the least and the largest sum that joint limits (n,) leave to a row (n,)."""
    used = coefficients != 0.0
    ends = coefficients[used, None] * np.stack([lower[used], upper[used]], axis=-1)
    return float(np.sum(np.min(ends, axis=1))), float(np.sum(np.max(ends, axis=1)))
