"""Changes of a request by one number, for everything that a conflict may name."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np
import shapely

from models.arm import Arm, Interval
from models.arrays import Floats
from models.cell import Cell
from models.coupling import Distance
from models.floor import Floor
from models.pose import transform
from models.shapes import Body, HalfSpace
from models.surroundings import PairClass
from optimizer.infeasibility.largest import KINDS, Largest, largest_clearance, largest_conditioning
from optimizer.why_not.elements import Element, Kind, Selection

PRECISE = 5e-5
"""m, of the largest clearance that is possible."""


@dataclass(frozen=True, eq=False, slots=True)
class Remedy:
    """A change of one number.

    Attributes:
        change: makes the cell for an amount; more of it never hurts. words: says it to people.
        pointer: JSON pointer to the field. least, most: amounts, the first to be tried and the largest.
        exact: decimal step, in the unit of the amount; amounts are rounded up to it.
        kept: how much of what is asked for an arm can keep, by its index and a deadline; None where no tree says so.
        required: what is asked for, where ``kept`` is given.
    """

    change: Callable[[float], Cell]
    words: Callable[[float], str]
    pointer: str
    least: float
    most: float
    exact: float
    kept: Callable[[int, float], Largest | None] | None = None
    required: float = 0.0


def candidates(cell: Cell, conflict: Selection) -> Iterator[Remedy]:
    """Changes of what a conflict names, the cheapest first."""
    kinds = {element.kind for element in conflict.elements}
    arms = [element.index for element in conflict.elements if element.kind is Kind.ARM]
    obstacles = [element for element in conflict.elements if element.kind is Kind.OBSTACLE]
    classes = [
        (PairClass.SELF, Kind.SELF in kinds),
        (PairClass.ARM_OBSTACLE, bool(obstacles and arms)),
        (PairClass.ARM_PART, bool(Kind.PART in kinds and arms)),
        (PairClass.PART_OBSTACLE, bool(obstacles and Kind.PART in kinds and not arms)),
        (PairClass.ARM_ARM, len(arms) > 1),
    ]
    asked = cell.surroundings.clearances
    yield from (_clearance(cell, kind) for kind, named in classes if named and asked.required(kind))
    for element in conflict.elements:
        if element.kind is Kind.CONDITIONING:
            yield _conditioning(cell, element.index)
    if Kind.STEP in kinds:
        yield _step(cell)
    if Kind.FLOOR in kinds and cell.surroundings.floor is not None:
        if cell.surroundings.floor.margin > 0.0:
            yield _margin(cell, cell.surroundings.floor)
        yield _floor(cell, cell.surroundings.floor)
    if Kind.REGION in kinds:
        yield from (_region(cell, element.index) for element in conflict.elements if element.kind is Kind.REGION)
    if Kind.COUPLING in kinds:
        yield from (_coupling(cell, element.index) for element in conflict.elements if element.kind is Kind.COUPLING)
    yield from (
        _obstacle(cell, element)
        for element in obstacles
        if not isinstance(cell.surroundings.obstacles[element.index].shape, HalfSpace)
    )


def _clearance(cell: Cell, kind: PairClass) -> Remedy:
    """Less of a clearance."""
    required = cell.surroundings.clearances.required(kind) or 0.0
    field = "self_collision" if kind is PairClass.SELF else str(kind)

    def change(amount: float) -> Cell:
        asked = replace(cell.surroundings.clearances, **{field: max(required - amount, 0.0)})
        return replace(cell, surroundings=replace(cell.surroundings, clearances=asked))

    def words(amount: float) -> str:
        less = f"{1e3 * (required - amount):.1f}".removesuffix(".0")
        return f"ask for {less} mm instead of {1e3 * required:g} mm of {kind} clearance"

    def kept(arm: int, deadline: float) -> Largest | None:
        return largest_clearance(change(required), arm, kind, PRECISE, deadline)

    first, own = min(0.02 * required, required), kept if kind in KINDS else None
    return Remedy(change, words, f"/clearance/{kind}", first, required, 1e-4, own, required)


def _conditioning(cell: Cell, a: int) -> Remedy:
    """Less of a conditioning."""
    arm = cell.arms[a]
    wanted = arm.min_conditioning or 0.0

    def change(amount: float) -> Cell:
        return _with_arm(cell, a, replace(arm, min_conditioning=max(wanted - amount, 1e-4)))

    def words(amount: float) -> str:
        return f"ask for a conditioning of {wanted - amount:.3f} instead of {wanted:g} of {arm.name}"

    def kept(index: int, deadline: float) -> Largest | None:
        return largest_conditioning(change(wanted), a, 1e-3 * wanted, deadline) if index == a else None

    return Remedy(change, words, f"/arms/{a}/min_conditioning", 0.1 * wanted, wanted, 1e-3, kept, wanted)


def _step(cell: Cell) -> Remedy:
    """Longer joint steps, which more poses do as well."""

    def change(amount: float) -> Cell:
        return replace(cell, max_joint_step=cell.max_joint_step + amount)

    def words(amount: float) -> str:
        return f"allow joint steps of {cell.max_joint_step + amount:.3f} rad, or add poses between"

    most = np.pi - cell.max_joint_step
    return Remedy(change, words, "/max_joint_step", min(0.1 * cell.max_joint_step, most), most, 1e-3)


def _margin(cell: Cell, floor: Floor) -> Remedy:
    """Less of a margin on the floor."""

    def change(amount: float) -> Cell:
        less = Floor(floor.allowed, floor.forbidden, max(floor.margin - amount, 0.0))
        return replace(cell, surroundings=replace(cell.surroundings, floor=less))

    def words(amount: float) -> str:
        margin = 1e3 * floor.margin
        return f"ask for {margin - 1e3 * amount:.0f} mm instead of {margin:.0f} mm of margin on the floor"

    least = 0.1 * floor.margin
    return Remedy(change, words, "/floor/margin", least, floor.margin, 1e-3, required=floor.margin)


def _floor(cell: Cell, floor: Floor) -> Remedy:
    """An allowed floor that reaches farther, and forbidden ones that reach less far."""

    def change(amount: float) -> Cell:
        allowed = None if floor.allowed is None else _grown(floor.allowed, amount)
        smaller = (shapely.Polygon(p).buffer(-amount, join_style="mitre") for p in floor.forbidden)
        pieces = [piece for polygon in smaller for piece in getattr(polygon, "geoms", [polygon]) if not piece.is_empty]
        left = tuple(np.array(piece.exterior.coords)[:-1] for piece in pieces)
        return replace(cell, surroundings=replace(cell.surroundings, floor=Floor(allowed, left, floor.margin)))

    def words(amount: float) -> str:
        return f"let bases stand {1e3 * amount:.0f} mm farther out on the floor, on every side"

    return Remedy(change, words, "/floor", 0.05, 3.0, 1e-3)


def _grown(polygon: Floats, amount: float) -> Floats:
    outline = shapely.Polygon(polygon).buffer(amount, join_style="mitre")
    return np.array(outline.exterior.coords)[:-1]


def _region(cell: Cell, a: int) -> Remedy:
    """A base region that reaches farther along x and y."""
    arm = cell.arms[a]

    def change(amount: float) -> Cell:
        x, y = (Interval(side.low - amount, side.high + amount) for side in (arm.base.x, arm.base.y))
        return _with_arm(cell, a, replace(arm, base=replace(arm.base, x=x, y=y)))

    def words(amount: float) -> str:
        return f"let {arm.name} stand {1e3 * amount:.0f} mm farther out of its base region"

    return Remedy(change, words, f"/arms/{a}/base", 0.05, 3.0, 1e-3)


def _coupling(cell: Cell, k: int) -> Remedy:
    """A coupling left out, or a distance with wider limits."""
    coupling = cell.couplings[k]
    names = " and ".join(cell.arms[arm].name for arm in coupling.arms)
    others = cell.couplings[:k], cell.couplings[k + 1 :]
    if isinstance(coupling, Distance):

        def wider(amount: float) -> Cell:
            low, high = max(coupling.minimum - amount, 0.0), coupling.maximum + amount
            return replace(cell, couplings=(*others[0], Distance(coupling.arms, low, high), *others[1]))

        def in_words(amount: float) -> str:
            return f"let {names} stand {1e3 * amount:.0f} mm nearer or farther apart than coupling distance does"

        return Remedy(wider, in_words, f"/coupling/{k}", 0.05, 3.0, 1e-3)

    def change(amount: float) -> Cell:
        del amount
        return replace(cell, couplings=(*others[0], *others[1]))

    def words(amount: float) -> str:
        del amount
        return f"drop coupling {coupling.kind} of {names}"

    return Remedy(change, words, f"/coupling/{k}", 1.0, 1.0, 1.0)


def _obstacle(cell: Cell, element: Element) -> Remedy:
    """An obstacle moved away from the task, along the floor or down or up."""
    obstacle = cell.surroundings.obstacles[element.index]
    off = obstacle.pose[:3, 3] - np.mean(cell.task.poses[:, :3, 3], axis=0)
    off = np.array([0.0, 0.0, off[2]]) if abs(off[2]) > np.hypot(off[0], off[1]) else np.array([off[0], off[1], 0.0])
    far = float(np.linalg.norm(off))
    way = off / far if far > 1e-9 else np.array([1.0, 0.0, 0.0])

    def change(amount: float) -> Cell:
        moved = Body(obstacle.name, transform(np.eye(3), amount * way) @ obstacle.pose, obstacle.shape)
        others = cell.surroundings.obstacles
        changed = (*others[: element.index], moved, *others[element.index + 1 :])
        return replace(cell, surroundings=replace(cell.surroundings, obstacles=changed))

    def words(amount: float) -> str:
        to = ", ".join(f"{component:.2f}" for component in way)
        return f"move {obstacle.name} by {1e3 * amount:.0f} mm towards ({to})"

    return Remedy(change, words, f"/obstacles/{element.index}/pose/position", 0.02, 3.0, 1e-3)


def _with_arm(cell: Cell, a: int, arm: Arm) -> Cell:
    return replace(cell, arms=(*cell.arms[:a], arm, *cell.arms[a + 1 :]))
