"""Changes of a request by one number, for everything that a conflict may name."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
import shapely

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import PairClass
from duocell.models.geometry.shapes import HalfSpace
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.optimizer.infeasibility.changes.arms import (
    freed,
    limits,
    linear_limit,
    turned_or_raised,
    wider_region,
    with_arm,
)
from duocell.optimizer.infeasibility.changes.obstacles import moved_obstacle
from duocell.optimizer.infeasibility.changes.remedy import FARTHEST, Remedy
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.largest import KINDS, Largest, largest_clearance, largest_conditioning
from duocell.optimizer.infeasibility.requirements import Kind, Requirement, Selection

PRECISE = 5e-5
"""m, of the largest clearance that is possible."""
CHEAPEST = (
    Kind.CONDITIONING,
    Kind.STEP,
    Kind.LINEAR,
    Kind.LIMITS,
    Kind.FLOOR,
    Kind.REGION,
    Kind.POSTURE,
    Kind.SINGULARITIES,
    Kind.COUPLING,
    Kind.OBSTACLE,
    Kind.PART,
    Kind.SELF,
    Kind.ARM,
)
"""What is changed first."""


def candidates(cell: Cell, conflict: Selection) -> Iterator[Remedy]:
    """Changes of what a conflict names, the cheapest first."""
    kinds = {requirement.kind for requirement in conflict.requirements}
    arms = [requirement.index for requirement in conflict.requirements if requirement.kind is Kind.ARM]
    obstacles = [requirement for requirement in conflict.requirements if requirement.kind is Kind.OBSTACLE]
    classes = [
        (PairClass.SELF, Kind.SELF in kinds),
        (PairClass.ARM_OBSTACLE, bool(obstacles and arms)),
        (PairClass.ARM_PART, bool(Kind.PART in kinds and arms)),
        (PairClass.PART_OBSTACLE, bool(obstacles and Kind.PART in kinds and not arms)),
        (PairClass.ARM_ARM, len(arms) > 1),
    ]
    asked = cell.surroundings.clearances
    yield from (_clearance(cell, kind) for kind, named in classes if named and asked.required(kind))
    for requirement in sorted(conflict.requirements, key=lambda one: (CHEAPEST.index(one.kind), one.index, one.joint)):
        yield from _loosened(cell, requirement)
    for requirement in sorted(
        (one for one in conflict.requirements if one.kind is Kind.REGION), key=lambda one: one.index
    ):
        yield from turned_or_raised(cell, requirement)


def _loosened(cell: Cell, requirement: Requirement) -> Iterator[Remedy]:
    """Changes of one requirement."""
    index, floor = requirement.index, cell.surroundings.floor
    match requirement.kind:
        case Kind.CONDITIONING:
            yield _conditioning(cell, requirement)
        case Kind.STEP:
            yield _step(cell, requirement)
        case Kind.LIMITS:
            yield limits(cell, requirement)
        case Kind.LINEAR if cell.arms[index].linear_limits is not None:
            yield linear_limit(cell, requirement)
        case Kind.FLOOR if floor is not None:
            yield from _floors(cell, floor, requirement)
        case Kind.REGION:
            yield wider_region(cell, requirement)
        case Kind.POSTURE | Kind.SINGULARITIES:
            yield freed(cell, requirement)
        case Kind.COUPLING:
            yield _coupling(cell, requirement)
        case Kind.OBSTACLE if not isinstance(cell.surroundings.obstacles[index].shape, HalfSpace):
            yield moved_obstacle(cell, requirement)
        case _:
            return


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

    def kept(arm: int, effort: Effort) -> Largest | None:
        return largest_clearance(change(required), arm, kind, PRECISE, effort)

    first, own = min(0.02 * required, required), kept if kind in KINDS else None
    return Remedy(change, words, f"/clearance/{kind}", first, required, 1e-4, kept=own, required=required)


def _conditioning(cell: Cell, requirement: Requirement) -> Remedy:
    """Less of a conditioning."""
    a = requirement.index
    arm = cell.arms[a]
    wanted = arm.min_conditioning or 0.0

    def change(amount: float) -> Cell:
        return with_arm(cell, a, replace(arm, min_conditioning=max(wanted - amount, 1e-4)))

    def words(amount: float) -> str:
        return f"ask for a conditioning of {wanted - amount:.3f} instead of {wanted:g} of {arm.name}"

    def kept(index: int, effort: Effort) -> Largest | None:
        return largest_conditioning(change(wanted), a, 1e-3 * wanted, effort) if index == a else None

    def need(joints: Sequence[Floats]) -> Floats:
        own, poses = joints[a], joints[a].shape[1]
        paths, which = np.unique(own.reshape(len(own), -1), axis=0, return_inverse=True)
        length = characteristic_length(arm.robot)
        kept_at = conditioning_of(chain_of(arm.robot), arm.tool, paths.reshape(-1, own.shape[2]), length)
        less: Floats = wanted - np.min(kept_at.reshape(-1, poses), axis=1)
        return less[which.ravel()]

    pointer = f"/arms/{a}/min_conditioning"
    return Remedy(change, words, pointer, 0.1 * wanted, wanted, 1e-3, requirement, kept, wanted, need=need)


def _step(cell: Cell, requirement: Requirement) -> Remedy:
    """Longer joint steps."""

    def change(amount: float) -> Cell:
        return replace(cell, max_joint_step=cell.max_joint_step + amount)

    def words(amount: float) -> str:
        return f"allow joint steps of {cell.max_joint_step + amount:.3f} rad instead of {cell.max_joint_step:.3g} rad"

    def need(joints: Sequence[Floats]) -> Floats:
        turning = [own[..., ~arm.robot.prismatic] for own, arm in zip(joints, cell.arms, strict=True)]
        steps = [np.abs(np.diff(own, axis=1))[:, cell.task.joined] for own in turning]
        longest: Floats = np.max([np.max(some, axis=(1, 2), initial=0.0) for some in steps], axis=0)
        return longest - cell.max_joint_step

    least, most = 0.1 * cell.max_joint_step, np.pi - cell.max_joint_step
    return Remedy(change, words, "/max_joint_step", min(least, most), most, 1e-3, requirement, need=need)


def _floors(cell: Cell, floor: Floor, requirement: Requirement) -> Iterator[Remedy]:
    if floor.margin > 0.0:
        yield _margin(cell, floor, requirement)
    yield _floor(cell, floor, requirement)


def _margin(cell: Cell, floor: Floor, requirement: Requirement) -> Remedy:
    """Less of a margin on the floor."""

    def change(amount: float) -> Cell:
        less = Floor(floor.allowed, floor.forbidden, max(floor.margin - amount, 0.0))
        return replace(cell, surroundings=replace(cell.surroundings, floor=less))

    def words(amount: float) -> str:
        margin = 1e3 * floor.margin
        return f"ask for {margin - 1e3 * amount:.0f} mm instead of {margin:.0f} mm of margin on the floor"

    least = 0.1 * floor.margin
    return Remedy(change, words, "/floor/margin", least, floor.margin, 1e-3, requirement, required=floor.margin)


def _floor(cell: Cell, floor: Floor, requirement: Requirement) -> Remedy:
    """An allowed floor that reaches farther, and forbidden ones that reach less far."""

    def change(amount: float) -> Cell:
        allowed = None if floor.allowed is None else _grown(floor.allowed, amount)
        smaller = (shapely.Polygon(p).buffer(-amount, join_style="mitre") for p in floor.forbidden)
        pieces = [piece for polygon in smaller for piece in getattr(polygon, "geoms", [polygon]) if not piece.is_empty]
        left = tuple(np.array(piece.exterior.coords)[:-1] for piece in pieces)
        return replace(cell, surroundings=replace(cell.surroundings, floor=Floor(allowed, left, floor.margin)))

    def words(amount: float) -> str:
        return f"let bases stand {1e3 * amount:.0f} mm farther out on the floor, on every side"

    return Remedy(change, words, "/floor", 0.05, FARTHEST, 1e-3, requirement)


def _grown(polygon: Floats, amount: float) -> Floats:
    outline = shapely.Polygon(polygon).buffer(amount, join_style="mitre")
    return np.array(outline.exterior.coords)[:-1]


def _coupling(cell: Cell, requirement: Requirement) -> Remedy:
    """A coupling with wider limits where it has such, or left out."""
    k = requirement.index
    coupling = cell.couplings[k]
    names = " and ".join(cell.arms[arm].name for arm in coupling.arms)
    others = cell.couplings[:k], cell.couplings[k + 1 :]
    if coupling.loosened(0.0) is not None:

        def wider(amount: float) -> Cell:
            looser = coupling.loosened(amount) or coupling
            return replace(cell, couplings=(*others[0], looser, *others[1]))

        def in_words(amount: float) -> str:
            return f"let {names} stand {1e3 * amount:.0f} mm nearer or farther apart than coupling {coupling.kind} does"

        return Remedy(wider, in_words, f"/coupling/{k}", 0.05, FARTHEST, 1e-3, requirement)

    def change(amount: float) -> Cell:
        del amount
        return replace(cell, couplings=(*others[0], *others[1]))

    def words(amount: float) -> str:
        del amount
        return f"drop coupling {coupling.kind} of {names}"

    return Remedy(change, words, f"/coupling/{k}", 1.0, 1.0, 1.0, requirement)
