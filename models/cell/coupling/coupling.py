"""The one interface of all couplings: a function of the base placements, and the set its values must lie in."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput

Scalar = Any
"""A number, a NumPy array or a CasADi expression: rows are written once and evaluated on all three."""
Base = Sequence[Scalar] | Floats
"""x, y, z [m] and yaw [rad] of one arm's base."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Constraints ``lower <= value <= upper``.

    Attributes:
        values: one scalar per row, in metres or radians (near the allowed set, so that violations add up).
        lower: one number per row; -inf for none. upper: likewise.
        labels: one phrase per row, for people.
    """

    values: tuple[Scalar, ...]
    lower: tuple[float, ...]
    upper: tuple[float, ...]
    labels: tuple[str, ...]


class Coupling(Protocol):
    """A tie between bases."""

    @property
    def arms(self) -> tuple[int, ...]:
        """Indices into the arms of the cell."""
        ...

    @property
    def kind(self) -> str:
        """The contract's word."""
        ...

    def rows(self, bases: Sequence[Base]) -> Rows:
        """The rows at some placements.

        Args:
            bases: of all arms of the cell, in order.
        """
        ...


def check_arms(arms: Sequence[int], least: int, most: int | None) -> None:
    """Refuse too few, too many or repeated arms.

    Raises:
        InvalidInput: pointer ``/arms``.
    """
    if len(set(arms)) != len(arms):
        raise InvalidInput("an arm cannot be coupled with itself; name different arms.", "/arms")
    if len(arms) < least or (most is not None and len(arms) > most):
        wanted = f"{least}" if most == least else f"{least} or more"
        raise InvalidInput(f"this coupling needs {wanted} arms, got {len(arms)}.", "/arms")


def sine(angle: Scalar) -> Scalar:
    """sin of a number, an array or an expression."""
    return ca.sin(angle) if isinstance(angle, ca.SX | ca.MX) else np.sin(angle)
