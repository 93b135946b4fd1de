"""Why one arm has no layout by itself: a proof on its tree of boxes, and what of its cell the proof needs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from models.cell import Cell
from optimizer.certificate.arm_tree import ArmTree
from optimizer.certificate.exclusion.causes import YAW, Cause
from optimizer.coupled.scene import Scene
from optimizer.reduced import reduced_problem
from optimizer.watch import check_stop
from optimizer.why_not.elements import OWN, Element, Kind, Selection, restricted

BOXES = 6000
"""Bounded in one proof at most."""
AROUND = (Kind.OBSTACLE, Kind.PART, Kind.SELF, Kind.FLOOR)
"""What may also take away the yaws of a base."""


@dataclass(frozen=True, slots=True)
class ArmConflict:
    """An arm that has no layout by itself, proved.

    Attributes:
        arm: index. selection: what leaves no layout; nothing else of the cell is needed for the proof.
        irreducible: True if for every member but the arm and its poses a layout of the arm without it is known.
    """

    arm: int
    selection: Selection
    irreducible: bool


def arm_conflict(cell: Cell, deadline: float) -> ArmConflict | None:
    """The first arm that is proved to have no layout among its surroundings; None where none is.

    Args:
        cell: the cell. deadline: `time.perf_counter` value, soft.
    """
    proved = proved_arm(cell, deadline)
    return None if proved is None else _minimal(cell, *proved, deadline)


def proved_arm(cell: Cell, deadline: float) -> tuple[int, ArmTree] | None:
    """Index and tree of the first arm that is proved to have no layout by itself; None where none is."""
    for index in range(len(cell.arms)):
        tree = arm_tree(cell, index, deadline)
        if tree is not None and tree.empty:
            return index, tree
    return None


def arm_tree(cell: Cell, index: int, deadline: float) -> ArmTree | None:
    """The tree of an arm, worked off until it is empty or a layout of the arm by itself is met; None without one."""
    problem = reduced_problem(cell, cell.arms[index])
    if problem is None:
        return None
    tree = ArmTree(Scene.of(cell), index, problem)
    while not tree.empty and tree.alone is None and tree.boxes < BOXES and time.perf_counter() < deadline:
        check_stop()
        if not tree.work_off(np.inf, by_size=True):
            break
    return tree


def _minimal(cell: Cell, index: int, tree: ArmTree, deadline: float) -> ArmConflict:
    """What the proof needs: first few elements that leave no layout, then none of them that can be left out.

    What excluded nothing is out at no cost; what lost the last yaw may have been anything around the base.
    """
    counts = np.bincount(tree.nodes.code, minlength=len(tree.excluder.causes))
    numbers = elements_of(cell, index, tree.excluder.causes.all)
    weight = {element: int(np.sum(counts[some])) for element, some in numbers.items()}
    used = [e for e in numbers if weight[e] > 0 or (counts[YAW] > 0 and e.kind in AROUND)]
    used.sort(key=lambda e: (e.kind in OWN, -weight[e]))
    search = _Minimal(cell, index, deadline)
    chosen, irreducible = frozenset(search.enough(used)), True
    for element in [*(e for e in reversed(used) if e in chosen), Element(Kind.REGION, index)]:
        smaller = search.tree(chosen - {element})
        if smaller is not None and smaller.empty:
            chosen -= {element}
        else:
            irreducible &= smaller is not None and smaller.alone is not None
    selection = Selection(chosen | {Element(Kind.ARM, index)}, 0, len(cell.task) - 1)
    return ArmConflict(index, selection, irreducible)


@dataclass(frozen=True, eq=False, slots=True)
class _Minimal:
    """Trees of one arm of a cell of which but some elements are left."""

    cell: Cell
    index: int
    deadline: float

    def enough(self, used: Sequence[Element]) -> list[Element]:
        """The first so many of some elements, and the region, that leave no layout; all of them together do."""
        region, count = Element(Kind.REGION, self.index), 1
        while count < len(used):
            some = [*used[:count], region]
            tree = self.tree(frozenset(some))
            if tree is not None and tree.empty:
                return some
            count *= 2
        return [*used, region]

    def tree(self, chosen: frozenset[Element]) -> ArmTree | None:
        """The tree where nothing but some elements are asked for."""
        arms = frozenset(Element(Kind.ARM, a) for a in range(len(self.cell.arms)))
        left = Selection(arms | chosen, 0, len(self.cell.task) - 1)
        return arm_tree(restricted(self.cell, left), self.index, self.deadline)


def elements_of(cell: Cell, index: int, causes: tuple[Cause, ...]) -> dict[Element, list[int]]:
    """Elements of a cell, and the numbers of the causes that they give for one arm."""
    obstacles = {obstacle.name: k for k, obstacle in enumerate(cell.surroundings.obstacles)}
    found: dict[Element, list[int]] = {}
    for number, cause in enumerate(causes):
        match cause.kind:
            case "obstacle":
                element = Element(Kind.OBSTACLE, obstacles[cause.name])
            case "part":
                element = Element(Kind.PART)
            case "self":
                element = Element(Kind.SELF)
            case "floor":
                element = Element(Kind.FLOOR)
            case "conditioning":
                element = Element(Kind.CONDITIONING, index)
            case "limit":
                element = Element(Kind.LIMITS, index, cause.joint or 0)
            case "path":
                element = Element(Kind.STEP)
            case _:
                continue
        found.setdefault(element, []).append(number)
    return found
