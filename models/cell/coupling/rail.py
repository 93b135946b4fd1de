"""Bases on one straight horizontal rail."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import cos, sin
from typing import ClassVar

from duocell.models.cell.coupling.coupling import Base, Coupling, Rows, check_arms
from duocell.models.cell.coupling.relations import Common, Relation, Z, across


@dataclass(frozen=True, slots=True)
class Rail(Coupling):
    """All base origins on one line of a given direction, at one height.

    Attributes:
        arms: two or more.
        angle: rad, direction of the rail from the world's x axis.
        point: (x, y) m that the rail passes through, or None where only its direction is given.
    """

    angle: float
    point: tuple[float, float] | None = None
    kind: ClassVar[str] = "rail"

    def __post_init__(self) -> None:
        check_arms(self.arms, 1 if self.point is not None else 2, None)

    def rows(self, bases: Sequence[Base]) -> Rows:
        """How far the bases are off the rail, and differences of height [m]."""
        aside = [-sin(self.angle) * bases[arm][0] + cos(self.angle) * bases[arm][1] for arm in self.arms]
        if self.point is None:
            off = [second - first for first, second in pairwise(aside)]
        else:
            level = -sin(self.angle) * self.point[0] + cos(self.angle) * self.point[1]
            off = [value - level for value in aside]
        heights = [bases[j][2] - bases[i][2] for i, j in pairwise(self.arms)]
        zeros = (0.0,) * (len(off) + len(heights))
        labels = ("on the rail",) * len(off) + ("same height",) * len(heights)
        return Rows((*off, *heights), zeros, zeros, labels)

    def relations(self) -> tuple[Relation, ...]:
        """One height, and one coordinate across the rail, which its point gives."""
        aside = across(self.angle)
        level = None if self.point is None else aside[0] * self.point[0] + aside[1] * self.point[1]
        return Common(self.arms, Z), Common(self.arms, aside, level)
