"""Bases that obey a coupling, from free numbers: what is tied is computed, nothing is penalised but the regions.

At most one coupling of two arms, read from its definition.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, pi, sin

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Direction, Distance, Mirror, Rail, Rigid, SameHeight
from duocell.models.robot.arm import BaseRegion, Interval


@dataclass(frozen=True, eq=False)
class FreeBases:
    """The bases of a cell of two arms as a function of free numbers.

    Attributes:
        cell: the cell. tie: its coupling, or None. bounds: (D, 2) of the free numbers, equal where nothing is free.
    """

    cell: Cell
    tie: Coupling | None
    bounds: Floats

    def places(self, numbers: Floats) -> tuple[Floats, Floats | None, Floats]:
        """Bases of free numbers.

        Args:
            numbers: (S, D).

        Returns:
            (2, S, 3) m; (2, S) rad yaws or None where they are not tied; (S,) m, how far bases are out of their region.
        """
        x = numbers.T
        yaws = None
        match self.tie:
            case None:
                first, second = x[:3], x[3:6]
            case SameHeight():
                first, second = np.stack([x[0], x[1], x[4]]), np.stack([x[2], x[3], x[4]])
            case Distance():
                away = x[4] * np.array([np.cos(x[5]), np.sin(x[5])])
                first, second = x[:3], np.stack([*(x[:2] + away), x[3]])
            case Direction(angle=angle):
                first, second = x[:3], np.stack([x[0] + x[4] * cos(angle), x[1] + x[4] * sin(angle), x[3]])
            case Rail(angle=angle):
                aside = np.outer([-sin(angle), cos(angle)], x[2])
                along = [np.outer([cos(angle), sin(angle)], x[k]) for k in (0, 1)]
                first, second = (np.stack([*(a + aside), x[3]]) for a in along)
            case Mirror(point=point, angle=angle):
                normal = np.array([-sin(angle), cos(angle)])
                off = normal @ (x[:2] - np.array(point)[:, None])
                first, second = x[:3], np.stack([*(x[:2] - 2.0 * np.outer(normal, off)), x[2]])
                yaws = np.stack([x[3], 2.0 * angle - x[3]])
            case Rigid():
                ahead, aside = np.array([np.cos(x[3]), np.sin(x[3])]), np.array([-np.sin(x[3]), np.cos(x[3])])
                first, second = x[:3], np.stack([*(x[:2] + x[4] * ahead + x[5] * aside), x[2] + x[6]])
                yaws = np.stack([x[3], x[3] + x[7]])
            case _:
                raise ValueError(f"{self.tie.kind} is not known here")
        places = np.stack([first.T, second.T])
        return places, yaws, self._outside(places)

    def numbers_of(self, stands: Floats) -> Floats:
        """(D,) free numbers of bases (2, 4) that obey the coupling."""
        one, other = stands
        apart = other[:2] - one[:2]
        match self.tie:
            case None:
                rows = [*one[:3], *other[:3]]
            case SameHeight():
                rows = [*one[:2], *other[:2], one[2]]
            case Distance():
                rows = [*one[:3], other[2], np.hypot(*apart), np.arctan2(apart[1], apart[0])]
            case Direction():
                rows = [*one[:3], other[2], np.hypot(*apart)]
            case Rail(angle=angle):
                along, aside = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
                rows = [along @ one[:2], along @ other[:2], aside @ one[:2], one[2]]
            case Mirror():
                low = float(self.bounds[3, 0])
                rows = [*one[:3], low + (one[3] - low) % (2.0 * pi)]
            case Rigid(yaw=yaw):
                low = float(self.bounds[3, 0])
                turn = np.array([[cos(one[3]), sin(one[3])], [-sin(one[3]), cos(one[3])]])
                difference = yaw.low + (other[3] - one[3] - yaw.low + 1e-9) % (2.0 * pi) - 1e-9
                rows = [*one[:3], low + (one[3] - low) % (2.0 * pi), *(turn @ apart), other[2] - one[2], difference]
            case _:
                raise ValueError(f"{self.tie.kind} is not known here")
        return np.clip(np.array(rows, dtype=np.float64), self.bounds[:, 0], self.bounds[:, 1])

    def _outside(self, places: Floats) -> Floats:
        """(S,) m, bases out of their regions, summed; a hair of rounding is none."""
        total = np.zeros(places.shape[1])
        for arm, spots in zip(self.cell.arms, places, strict=True):
            low, high = arm.base.bounds[:3].T
            total += np.sum(np.maximum(np.maximum(low - spots, spots - high) - 1e-9, 0.0), axis=1)
        return total


def free_bases(cell: Cell) -> FreeBases:
    """The free numbers of a cell of two arms with at most one coupling.

    Raises:
        ValueError: other cells.
    """
    if len(cell.arms) != 2 or len(cell.couplings) > 1:
        raise ValueError("two arms and at most one coupling are searched")
    tie = cell.couplings[0] if cell.couplings else None
    if tie is not None and tie.arms == (1, 0):
        raise ValueError("the coupling names the arms in another order")
    rows = _free_rows(tie, [arm.base for arm in cell.arms])
    return FreeBases(cell, tie, np.array([[row.low, row.high] for row in rows]))


def _free_rows(tie: Coupling | None, regions: list[BaseRegion]) -> list[Interval]:
    """What the free numbers may be, with the regions of both arms."""
    x, y, z = ([getattr(r, side) for r in regions] for side in ("x", "y", "z"))
    level = _common(*z)
    far = float(np.hypot(_span(*x), _span(*y)))
    match tie:
        case None:
            return [x[0], y[0], z[0], x[1], y[1], z[1]]
        case SameHeight():
            return [x[0], y[0], x[1], y[1], level]
        case Distance(minimum=minimum, maximum=maximum):
            return [x[0], y[0], z[0], z[1], Interval(minimum, min(maximum, far)), Interval(-pi, pi)]
        case Direction():
            return [x[0], y[0], z[0], z[1], Interval(0.0, far)]
        case Rail(angle=angle, point=point):
            along, aside = np.array([cos(angle), sin(angle)]), np.array([-sin(angle), cos(angle)])
            spans = [_along(r.x, r.y, along) for r in regions]
            offset = _common(*(_along(r.x, r.y, aside) for r in regions))
            if point is not None:
                offset = Interval(float(aside @ point), float(aside @ point))
            return [*spans, offset, level]
        case Mirror():
            return [x[0], y[0], level, regions[0].yaw]
        case Rigid():
            return [x[0], y[0], z[0], regions[0].yaw, tie.x, tie.y, tie.z, tie.yaw]
        case _:
            raise ValueError(f"{tie.kind} is not known here")


def _common(one: Interval, other: Interval) -> Interval:
    low, high = max(one.low, other.low), min(one.high, other.high)
    return Interval(low, max(low, high))


def _span(one: Interval, other: Interval) -> float:
    return max(one.high, other.high) - min(one.low, other.low)


def _along(x: Interval, y: Interval, direction: Floats) -> Interval:
    """Extent of a rectangle in a direction."""
    ends = [direction @ [u, v] for u in (x.low, x.high) for v in (y.low, y.high)]
    return Interval(float(min(ends)), float(max(ends)))
