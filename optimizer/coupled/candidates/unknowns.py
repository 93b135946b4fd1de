r"""What couplings leave free: the base positions as an affine function of independent unknowns.

A coupling row that is affine in the positions and ties one coordinate of two arms (a height, a distance from a
vertical plane) makes these two coordinates one unknown; a row of one arm fixes a coordinate. Arms then share the tied
unknowns, and each has the rest of its position for itself: for given tied unknowns the arms are independent. Rows of
any other form (a distance, a side, a yaw) are left to `duocell.optimizer.coupled.candidates.loose`.

Nothing here refers to the axes of the world: samples are counted from the sides of the regions, in an order and a sense
that turn with the task.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.base.sampling import even_points
from duocell.models.cell.cell import Cell

SAME = 1e-9
"""Directions that differ by less are the same; a row whose slope changes by less is affine."""
GENERIC = np.array([0.61, 0.33, 0.72])
"""A direction in the frame of the part; its mean over the task, seen from above, tells which way is which."""
SPLIT = 0.3
"""rad; where the quadrants of that direction begin: off the directions that people prefer."""


@dataclass(frozen=True, eq=False, slots=True)
class Samples:
    """Sampled positions of one arm.

    Attributes:
        positions: (N, 3) m. groups: (N,) arms whose samples have the same number keep their tied coordinates together.
        cells: (N, 3) m, the same places counted from the sides of the arm's box, in axes that turn with the task.
    """

    positions: Floats
    groups: Ints
    cells: Floats


@dataclass(frozen=True, eq=False, slots=True)
class _Coordinate:
    """A coordinate of an arm's position, ``direction · position = sign · unknown + offset``."""

    arm: int
    direction: Floats
    unknown: int
    sign: float
    offset: float


@dataclass(frozen=True, eq=False, slots=True)
class TiedUnknowns:
    """The free unknowns of the positions.

    Attributes:
        boxes: (A, 3, 2) m, where the arms' bases may stand.
        bounds: (t, 2) m, of the tied unknowns; low == high where one is fixed.
        coordinates: what they decide.
        heading: (2,) unit, a horizontal direction that turns with the task.
    """

    boxes: Floats
    bounds: Floats
    coordinates: tuple[_Coordinate, ...]
    heading: Floats

    @staticmethod
    def of(cell: Cell, boxes: Floats) -> TiedUnknowns:
        """Take out what the couplings of a cell tie.

        Args:
            cell: couplings and task. boxes: (A, 3, 2) m, where the bases may stand.
        """
        heading = heading_of(cell)
        ties = _affine_ties(cell, heading)
        return TiedUnknowns(boxes, *_merged(ties, boxes, [arm.name for arm in cell.arms], heading), heading)

    @property
    def empty(self) -> bool:
        """True if a tied coordinate has no value that suits all arms."""
        return bool(np.any(self.bounds[:, 0] > self.bounds[:, 1] + SAME))

    def of_arm(self, arm: int) -> list[_Coordinate]:
        """The tied coordinates of one arm."""
        return [one for one in self.coordinates if one.arm == arm]

    def moves(self) -> Floats:
        """(U, A, 3) m per m: how the positions follow each free unknown, tied ones first."""
        rows = []
        count = len(self.boxes)
        for number in np.flatnonzero(self.bounds[:, 1] > self.bounds[:, 0] + SAME):
            row = np.zeros((count, 3))
            for arm in range(count):
                own = self.of_arm(arm)
                if own:
                    slopes = np.array([one.sign if one.unknown == number else 0.0 for one in own])
                    row[arm] = np.linalg.pinv(np.array([one.direction for one in own])) @ slopes
            rows.append(row)
        for arm in range(count):
            for direction in self._free_directions(arm):
                row = np.zeros((count, 3))
                row[arm] = direction
                rows.append(row)
        return np.array(rows).reshape(-1, count, 3)

    def _free_directions(self, arm: int) -> list[Floats]:
        """Unit directions in which an arm may move by itself, along the axes of its box where it can."""
        box, own = self.boxes[arm], [one.direction for one in self.of_arm(arm)]
        flat = [direction for direction in own if abs(direction[2]) < 0.5]
        free: list[Floats] = []
        if not flat:
            free += [axis for axis in _axes(self.heading) if _width(box, axis) > 0.0]
        elif len(flat) == 1:
            free.append(_along(flat[0], self.heading))
        if len(flat) == len(own) and box[2, 1] > box[2, 0]:
            free.append(np.array([0.0, 0.0, 1.0]))
        return free

    def sampled(self, count: int, seed: int) -> list[Samples]:
        """About ``count`` positions of every arm, spread evenly over what the couplings leave.

        Args:
            count: of positions. seed: of the points.
        """
        tied = np.flatnonzero(self.bounds[:, 1] > self.bounds[:, 0] + SAME)
        own = [self._free_directions(arm) for arm in range(len(self.boxes))]
        groups = self._groups(tied, own, count)
        values = np.tile(self.bounds[:, 0], (groups, 1))
        if len(tied):
            width = self.bounds[tied, 1] - self.bounds[tied, 0]
            values[:, tied] += even_points(len(tied), groups, seed) * width
        return [self._of_arm(arm, own[arm], values, ceil(count / groups), seed) for arm in range(len(self.boxes))]

    def _groups(self, tied: Ints, own: Sequence[Sequence[Floats]], count: int) -> int:
        """How many values of the tied unknowns: all unknowns of an arm are sampled about equally densely."""
        if not len(tied):
            return 1
        most = max(range(len(own)), key=lambda arm: len(own[arm]))
        rest = [_width(self.boxes[most], direction) for direction in own[most]]
        width = [*(self.bounds[tied, 1] - self.bounds[tied, 0])]
        if not rest:
            return count
        spacing = (float(np.prod([*width, *rest])) / count) ** (1.0 / (len(width) + len(rest)))
        return int(np.clip(round(float(np.prod(width)) / spacing ** len(width)), 2, count))

    def _of_arm(self, arm: int, free: Sequence[Floats], values: Floats, each: int, seed: int) -> Samples:
        """Positions of one arm for values (T, t) of the tied unknowns, ``each`` of every one."""
        box, own = self.boxes[arm], self.of_arm(arm)
        each = each if free else 1
        wanted = np.stack([one.sign * values[:, one.unknown] + one.offset for one in own], axis=-1) if own else None
        start = np.tile(box.mean(axis=1), (len(values), 1))
        if wanted is not None:
            rows = np.array([one.direction for one in own])
            start += (wanted - start @ rows.T) @ np.linalg.pinv(rows).T
        groups = np.repeat(np.arange(len(values)), each)
        positions = start[groups]
        if free:
            shares = even_points(len(free), len(positions), seed + 1)
            for number, direction in enumerate(free):
                low, high = _span(positions, direction, box)
                positions = positions + (low + shares[:, number] * (high - low))[:, None] * direction
        inside = np.all((positions >= box[:, 0] - SAME) & (positions <= box[:, 1] + SAME), axis=1)
        positions, groups = positions[inside], groups[inside]
        return Samples(positions, groups, self.cells(arm, positions))

    def cells(self, arm: int, positions: Floats) -> Floats:
        """(N, 3) m, positions counted from the sides of an arm's box, in axes that turn with the task."""
        middle = self.boxes[arm].mean(axis=1)
        axes = np.vstack([*_axes(self.heading), [0.0, 0.0, 1.0]])
        turned: Floats = (positions - middle) @ axes.T
        return turned


def heading_of(cell: Cell) -> Floats:
    """(2,) unit: a horizontal direction that turns with the task, and that no order of poses or arms changes."""
    seen = np.sum(cell.task.poses[:, :2, :3] @ GENERIC, axis=0)
    length = float(np.linalg.norm(seen))
    return seen / length if length > 1e-6 else np.array([np.cos(SPLIT), np.sin(SPLIT)])


def _axes(heading: Floats) -> tuple[Floats, Floats]:
    """The horizontal axes of the world, in the order and with the signs that the heading's quadrant says."""
    quarter = int(np.floor((np.arctan2(heading[1], heading[0]) - SPLIT) / (0.5 * np.pi)))
    first = np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])[quarter % 4]
    return first, np.array([-first[1], first[0], 0.0])


def _oriented(direction: Floats, heading: Floats) -> Floats:
    """A direction with the sense of the heading, or upwards."""
    along = float(direction[2]) if abs(direction[2]) > 0.5 else float(direction[:2] @ heading)
    if abs(along) < SAME:
        along = float(direction[0] * heading[1] - direction[1] * heading[0])
    oriented: Floats = direction * np.sign(along)
    return oriented


def _along(direction: Floats, heading: Floats) -> Floats:
    """The horizontal direction across a horizontal one."""
    return _oriented(np.array([-direction[1], direction[0], 0.0]), heading)


def _width(box: Floats, direction: Floats) -> float:
    return float(np.abs(direction) @ (box[:, 1] - box[:, 0]))


def _span(positions: Floats, direction: Floats, box: Floats) -> tuple[Floats, Floats]:
    """(N,) how far positions may go back and forth along a direction inside a box; nothing where they are outside."""
    low, high = np.full(len(positions), -np.inf), np.full(len(positions), np.inf)
    for axis in np.flatnonzero(np.abs(direction) > SAME):
        ends = (box[axis] - positions[:, axis, None]) / direction[axis]
        low, high = np.maximum(low, ends.min(axis=1)), np.minimum(high, ends.max(axis=1))
    return low, np.maximum(low, high)


@dataclass(frozen=True, eq=False, slots=True)
class _Tie:
    """``Σ sign · direction · position = total`` over one or two arms, each given as (arm, direction, sign)."""

    terms: tuple[tuple[int, Floats, float], ...]
    total: float


def _affine_ties(cell: Cell, heading: Floats) -> list[_Tie]:
    """Rows of the couplings that tie coordinates of one or two arms."""
    count = len(cell.arms)
    rng = np.random.default_rng(1)
    start, *others = np.zeros((count, 4)), rng.normal(size=(count, 4)), rng.normal(size=(count, 4))
    units = np.eye(4 * count).reshape(count, 4, count, 4)
    ties = []
    for coupling in cell.couplings:
        rows = coupling.rows([*start])
        values = [coupling.rows([*place]).values for place in others]
        moved = [[coupling.rows([*(start + unit)]).values for unit in of_arm] for of_arm in units]
        for k, (low, high) in enumerate(zip(rows.lower, rows.upper, strict=True)):
            here = float(rows.values[k])
            slopes = np.array([[float(value[k]) - here for value in of_arm] for of_arm in moved])
            affine = all(
                abs(here + float(np.sum(slopes * place)) - float(value[k])) < SAME
                for place, value in zip(others, values, strict=True)
            )
            terms = [_term(arm, slopes[arm], heading) for arm in range(count) if np.any(np.abs(slopes[arm]) > SAME)]
            plain = [term for term in terms if term is not None]
            if low == high and affine and len(plain) == len(terms) and len(terms) in (1, 2):
                ties.append(_Tie(tuple(plain), low - here))
    return ties


def _term(arm: int, slope: Floats, heading: Floats) -> tuple[int, Floats, float] | None:
    """One arm's part of a row; None if it is no coordinate of its position."""
    direction = slope[:3]
    upright = abs(direction[2]) > 1.0 - SAME
    if abs(slope[3]) > SAME or abs(np.linalg.norm(direction) - 1.0) > SAME or not (upright or abs(direction[2]) < SAME):
        return None
    oriented = _oriented(direction, heading)
    return arm, oriented, float(np.sign(oriented @ direction))


_Node = tuple[int, Floats]
"""A coordinate of an arm's position: number of the arm, direction."""
_Row = tuple[list[tuple[int, float]], float]
"""A tie of nodes: number and sign of each, total."""


def _merged(
    ties: Sequence[_Tie], boxes: Floats, names: Sequence[str], heading: Floats
) -> tuple[Floats, tuple[_Coordinate, ...]]:
    """Bounds of the tied unknowns, and the coordinates that they decide; rows that contradict others are left out."""
    nodes, rows = _nodes(ties)
    bounds: list[list[float]] = []
    found: dict[int, _Coordinate] = {}
    for root in _in_order(nodes, names, heading):
        if root not in found:
            group = _tied_to(root, len(bounds), nodes, rows)
            bounds.append(_range(list(group.values()), rows, list(group), boxes))
            found |= group
    return np.array(bounds).reshape(-1, 2), tuple(found[number] for number in sorted(found))


def _nodes(ties: Sequence[_Tie]) -> tuple[list[_Node], list[_Row]]:
    """The coordinates that ties speak of, each once, and the ties as rows of them."""
    nodes: list[_Node] = []

    def number_of(arm: int, direction: Floats) -> int:
        for number, (other, known) in enumerate(nodes):
            if other == arm and np.allclose(known, direction, rtol=0.0, atol=SAME):
                return number
        nodes.append((arm, direction))
        return len(nodes) - 1

    rows = [([(number_of(arm, d), sign) for arm, d, sign in tie.terms], tie.total) for tie in ties]
    return nodes, rows


def _in_order(nodes: Sequence[_Node], names: Sequence[str], heading: Floats) -> list[int]:
    """Numbers of nodes in an order that no turn of the world and no order of the arms changes."""
    place = []
    for arm, direction in nodes:
        angle = float(np.arctan2(heading[0] * direction[1] - heading[1] * direction[0], heading @ direction[:2]))
        place.append((bool(abs(direction[2]) > 0.5), round(angle, 6), names[arm]))
    return sorted(range(len(nodes)), key=lambda number: place[number])


def _tied_to(root: int, unknown: int, nodes: Sequence[_Node], rows: Sequence[_Row]) -> dict[int, _Coordinate]:
    """A node and all that rows tie to it, by their numbers: one unknown, that of the node, decides them."""
    group = {root: _Coordinate(*nodes[root], unknown, 1.0, 0.0)}
    waiting = [root]
    for number in waiting:  # grows
        for pair, total in rows:
            ends = dict(pair)
            others = [end for end in ends if end != number and end not in group]
            if number in ends and others:
                here, other = group[number], others[0]
                turn = ends[number] * ends[other]
                offset = ends[other] * total - turn * here.offset
                group[other] = _Coordinate(*nodes[other], unknown, -turn * here.sign, offset)
                waiting.append(other)
    return group


def _range(
    coordinates: Sequence[_Coordinate],
    rows: Sequence[_Row],
    members: Sequence[int],
    boxes: Floats,
) -> list[float]:
    """Low and high of an unknown: what all boxes leave, or the value that a row of one arm gives it."""
    low, high = -np.inf, np.inf
    for one in coordinates:
        ends = np.sort(one.direction[:, None] * boxes[one.arm], axis=1).sum(axis=0)
        ends = np.sort((ends - one.offset) * one.sign)
        low, high = max(low, float(ends[0])), min(high, float(ends[1]))
    for pair, total in rows:
        if len(pair) == 1 and pair[0][0] in members:
            one = coordinates[members.index(pair[0][0])]
            value = (pair[0][1] * total - one.offset) * one.sign
            low, high = max(low, value), min(high, value)
    return [low, high]
