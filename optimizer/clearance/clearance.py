"""Is the way between the poses free? Distances along a whole path, certain to a stated resolution.

Between two poses the object moves straight and turns the short way, and the arms follow it on their branch. The way is
sampled ever finer until bounds of the motion between samples leave no room for a contact
(`duocell.optimizer.clearance.continuous_collision`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import Clearances, PairClass
from duocell.models.collision.collision import CollisionModel, Contact
from duocell.optimizer.clearance.continuous_collision import ContinuousCollisionCheck, Resolution
from duocell.optimizer.results.findings import Clearance


@dataclass(frozen=True, eq=False)
class ClassClearance:
    """What a class of pairs keeps on the whole path.

    Attributes:
        kind: the class. required: m.
        distance: m, the smallest at any sample. contact: there.
        pose: index of the pose before that sample. fraction: of the way to the next pose, 0 to 1.
        lower_bound: m, no pair of the class comes nearer anywhere on the path; -inf if not all of it was seen.
    """

    kind: PairClass
    required: float
    distance: float
    contact: Contact
    pose: int
    fraction: float
    lower_bound: float

    @property
    def clear(self) -> bool:
        """True if no sample comes too near."""
        return self.distance >= self.required - KEPT

    @property
    def certain(self) -> bool:
        """True if nothing between the samples can change what `clear` says.

        Where it is False, the samples are as close as the resolution.
        """
        return not self.clear or self.lower_bound >= self.required - KEPT


@dataclass(frozen=True, slots=True)
class Break:
    """A place where an arm cannot follow the object: ``fraction`` of the way from ``pose`` to the next."""

    arm: str
    pose: int
    fraction: float


@dataclass(frozen=True, slots=True)
class LimitExcess:
    """Where a joint is nearest to its limits, or farthest beyond them.

    Attributes:
        arm: its name. joint: name of the joint, or of a linear limit.
        pose: index of the pose before. fraction: of the way to the next pose.
        amount: beyond the limit, in ``unit``; negative: what is left.
        unit: rad, or m of a joint that shifts.
    """

    arm: str
    joint: str
    pose: int
    fraction: float
    amount: float
    unit: str = "rad"


@dataclass(frozen=True, eq=False)
class PathClearance:
    """The check of a whole path.

    Attributes:
        classes: those asked for that have pairs.
        breaks: empty if every arm follows the object between all poses.
        worst_limit: largest excess of a joint over its limits at any sample.
        limits_certain: True if nothing between the samples exceeds a limit that the samples keep.
        samples: configurations looked at.
    """

    classes: tuple[ClassClearance, ...]
    breaks: tuple[Break, ...]
    worst_limit: LimitExcess
    limits_certain: bool
    samples: int

    @property
    def limit_excess(self) -> float:
        """rad, largest excess of a joint over its limits at any sample; negative: what is left."""
        return self.worst_limit.amount

    @property
    def clear(self) -> bool:
        """True if the path can be followed and every class keeps its distance at every sample."""
        return not self.breaks and all(found.clear for found in self.classes)

    @property
    def certain(self) -> bool:
        """True if `clear` holds between the samples too."""
        return all(found.certain for found in self.classes)


def check_clearance(
    cell: Cell,
    model: CollisionModel,
    clearances: Clearances,
    bases: Floats,
    joints: Sequence[Floats],
    resolution: Resolution | None = None,
) -> PathClearance:
    """Check a layout's path at and between its poses.

    Args:
        cell: task and arms.
        model: of the same arms, in the same order.
        clearances: distances to keep.
        bases: (A, 4, 4) base of each arm in the world.
        joints: per arm (m, n) rad at the poses, as accurate as `duocell.optimizer.verification.verify` asks for.
        resolution: where to stop; default 1 mm and 0.5°.
    """
    check = ContinuousCollisionCheck(cell, model, clearances, bases, joints, resolution or Resolution())
    while len(check.left):
        check.halve()
    return PathClearance(
        classes=tuple(found for kind in model.kinds if (found := _class(check, kind)) is not None),
        breaks=tuple(Break(*place) for place in check.breaks),
        worst_limit=_worst_limit(cell, check),
        limits_certain=check.limits_certain and not check.breaks,
        samples=len(check.step),
    )


def found_clearances(path: PathClearance) -> tuple[Clearance, ...]:
    """What a path keeps, in words for a result."""
    return tuple(
        Clearance(
            kind=str(found.kind),
            required=found.required,
            distance=found.distance,
            first=found.contact.first,
            second=found.contact.second,
            pose=found.pose,
            fraction=found.fraction,
            lower_bound=found.lower_bound if np.isfinite(found.lower_bound) else None,
            certain=found.certain,
        )
        for found in path.classes
    )


def _worst_limit(cell: Cell, check: ContinuousCollisionCheck) -> LimitExcess:
    """The joint nearest to its limits over all samples."""
    worst = []
    for arm, q in zip(cell.arms, check.joints, strict=True):
        excess = arm.limit_excess(q)
        k, i = np.unravel_index(int(np.argmax(excess)), excess.shape)
        place = int(check.step[k]), float(check.fraction[k])
        worst.append(LimitExcess(arm.name, arm.bounded_names[i], *place, float(excess[k, i]), arm.bounded_units[i]))
    return max(worst, key=lambda one: one.amount)


def _class(check: ContinuousCollisionCheck, kind: PairClass) -> ClassClearance | None:
    """The closest pair of a class."""
    required = check.clearances.required(kind)
    found = check.model.closest(check.places, kind, check.gaps)
    if found is None or required is None:
        return None
    k, contact = found
    of_kind = np.array([other is kind for other in check.model.bodies.kinds])
    least = -np.inf if check.breaks else float(np.min(check.least[of_kind]))
    return ClassClearance(
        kind, required, contact.distance, contact, int(check.step[k]), float(check.fraction[k]), least
    )
