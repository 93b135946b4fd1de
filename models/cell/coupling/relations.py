"""What proofs know of couplings: relations between the bases that hold wherever a coupling is kept.

A coupling says as many of them as it can (`Coupling.relations`). Proofs rely on every one, so each has to follow from
the coupling's rows; what is left unsaid excludes nothing.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import cos, inf, pi, sin

Direction = tuple[float, float, float]
"""A unit vector in the world."""
X: Direction = (1.0, 0.0, 0.0)
Y: Direction = (0.0, 1.0, 0.0)
Z: Direction = (0.0, 0.0, 1.0)


def along(angle: float) -> Direction:
    """The horizontal direction at an angle [rad] from the world's x axis."""
    return cos(angle), sin(angle), 0.0


def across(angle: float) -> Direction:
    """The horizontal direction to the left of that."""
    return -sin(angle), cos(angle), 0.0


@dataclass(frozen=True, slots=True)
class Linear:
    """``low <= Σ direction · position <= high`` over one or two base origins.

    Attributes:
        terms: number of the arm and direction of each. low: m, -inf for none. high: m, inf for none.
    """

    terms: tuple[tuple[int, Direction], ...]
    low: float = 0.0
    high: float = 0.0


@dataclass(frozen=True, slots=True)
class Common:
    """All base origins have the same coordinate in a direction.

    Attributes:
        arms: whose. direction: of the coordinate. value: m, of the coordinate where that is known, or None.
    """

    arms: tuple[int, ...]
    direction: Direction
    value: float | None = None

    def rows(self) -> tuple[Linear, ...]:
        """As few rows as say it."""
        if self.value is not None:
            return tuple(self._fixed(arm) for arm in self.arms)
        return tuple(Linear(difference(pair, self.direction)) for pair in pairwise(self.arms))

    def between(self, first: int, second: int) -> tuple[Linear, ...]:
        """Every row of two arms."""
        both = {first, second} <= set(self.arms)
        rows = (Linear(difference((first, second), self.direction)),) if both else ()
        fixed = () if self.value is None else (self._fixed(arm) for arm in (first, second) if arm in self.arms)
        return (*rows, *fixed)

    def _fixed(self, arm: int) -> Linear:
        return Linear(((arm, self.direction),), self.value or 0.0, self.value or 0.0)


@dataclass(frozen=True, slots=True)
class Separation:
    """How near to each other and how far apart two base origins are.

    Attributes:
        arms: two. minimum: m. maximum: m, inf for none.
        level: True for the horizontal distance, False for that in space.
        fields: names of the coupling's fields that say minimum and maximum; "" where none does.
    """

    arms: tuple[int, int]
    minimum: float = 0.0
    maximum: float = inf
    level: bool = True
    fields: tuple[str, str] = ("", "")


@dataclass(frozen=True, slots=True)
class Bearing:
    """In which horizontal direction the second base origin lies from the first, from an axis, modulo 2π.

    Attributes:
        arms: two. low: rad. high: rad.
        axis: number of the arm from whose yaw the direction counts, or None for the world's x axis.
    """

    arms: tuple[int, int]
    low: float
    high: float
    axis: int | None = None


@dataclass(frozen=True, slots=True)
class Yaws:
    """``low <= yaw of the second + sense · yaw of the first <= high`` modulo 2π.

    Attributes:
        arms: two. sense: 1 for their sum, -1 for their difference. low: rad. high: rad.
        words: a pair of yaws that keeps it; what else would help, before an angle.
        field: name of the coupling's field that says it. share: rad of that field that make up for one.
    """

    arms: tuple[int, int]
    sense: int
    low: float
    high: float
    words: tuple[str, str] = ("pair that keeps it", "turn its yaw by")
    field: str = ""
    share: float = 1.0


Relation = Linear | Common | Separation | Bearing | Yaws


def linear_rows(relations: Sequence[Relation]) -> tuple[Linear, ...]:
    """The linear relations as few rows."""
    rows: list[Linear] = []
    for relation in relations:
        if isinstance(relation, Linear):
            rows.append(relation)
        elif isinstance(relation, Common):
            rows += relation.rows()
    return tuple(rows)


def linear_between(relations: Sequence[Relation], first: int, second: int) -> tuple[Linear, ...]:
    """Every linear row that speaks of two arms and of no other."""
    rows: list[Linear] = []
    for relation in relations:
        if isinstance(relation, Common):
            rows += relation.between(first, second)
        elif isinstance(relation, Linear) and {arm for arm, _ in relation.terms} <= {first, second}:
            rows.append(relation)
    return tuple(rows)


def wrapped(angle: float) -> float:
    """An angle modulo 2π, in [-π, π)."""
    return (angle + pi) % (2.0 * pi) - pi


def difference(arms: tuple[int, int], direction: Direction) -> tuple[tuple[int, Direction], ...]:
    """Terms of the second base origin less the first."""
    x, y, z = direction
    return (arms[0], (-x, -y, -z)), (arms[1], direction)
