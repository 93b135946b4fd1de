"""What all couplings are: a function of the base placements, and the set its values must lie in.

A kind of coupling is a class in a file of its own that says everything the program knows of it: its rows, and what
proofs may rely on (`relations`). Search, verification and proofs ask for these, and know of no kind. What a request
says of it stands in `duocell.service.schemas.coupling`.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, ClassVar, Self

import casadi as ca
import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.cell.coupling.relations import Relation
from duocell.models.robot.arm import Arm

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


@dataclass(frozen=True, slots=True)
class Coupling(ABC):
    """A tie between bases.

    Attributes:
        arms: indices into the arms of the cell.
        kind: word of a request.
    """

    arms: tuple[int, ...]
    kind: ClassVar[str]

    @abstractmethod
    def rows(self, bases: Sequence[Base]) -> Rows:
        """The rows at some placements.

        Args:
            bases: of all arms of the cell, in order.
        """

    def relations(self) -> tuple[Relation, ...]:
        """What holds wherever the rows do, for proofs; nothing where nothing is known."""
        return ()

    def check(self, arms: Sequence[Arm]) -> None:
        """Refuse arms that it cannot tie.

        Args:
            arms: of the cell.

        Raises:
            InvalidInput: with a pointer into the coupling.
        """
        return None  # most tie any

    def loosened(self, amount: float) -> Self | None:
        """The same that lets bases stand an amount [m] nearer or farther apart; None where there is no such thing."""
        return None


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


def arctan2(y: Scalar, x: Scalar) -> Scalar:
    """Angle of a point, of numbers, arrays or expressions."""
    symbolic = isinstance(y, ca.SX | ca.MX) or isinstance(x, ca.SX | ca.MX)
    return ca.atan2(y, x) if symbolic else np.arctan2(y, x)


def cosine(angle: Scalar) -> Scalar:
    """cos of a number, an array or an expression."""
    return ca.cos(angle) if isinstance(angle, ca.SX | ca.MX) else np.cos(angle)
