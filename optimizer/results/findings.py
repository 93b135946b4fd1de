"""What is found out about a layout in a real cell: clearances, alternatives, tolerance, what blocks it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from duocell.optimizer.results.placement import Placement


@dataclass(frozen=True, slots=True)
class Clearance:
    """What a class of pairs keeps along the whole path, between the poses too.

    Attributes:
        kind: word of the contract: arm_arm, arm_part, arm_obstacle, part_obstacle, self.
        required: m. distance: m, signed, the smallest met by Coal at any sample of the path.
        first: name of a body ("main / link 3"). second: likewise.
        pose: index of the pose before that sample. fraction: of the way to the next pose, 0 to 1.
        lower_bound: m, nothing of the class comes nearer anywhere on the path; None if that is not known.
        certain: True if nothing between the samples can change whether ``distance >= required``.
    """

    kind: str
    required: float
    distance: float
    first: str
    second: str
    pose: int
    fraction: float
    lower_bound: float | None
    certain: bool


@dataclass(frozen=True, eq=False)
class Alternative:
    """Another layout of the same cell, as thoroughly checked as the answer.

    Attributes:
        objective: E. placements: one per arm. clearances: as in the layout.
        note: why one might prefer it, one sentence with numbers.
    """

    objective: float
    placements: tuple[Placement, ...]
    clearances: tuple[Clearance, ...]
    note: str


@dataclass(frozen=True, slots=True)
class Tolerance:
    """What is left of a layout if its bases are not exactly where they should be.

    Every base is off by up to ``position`` along x, y and z, and by up to ``angle`` in yaw; the arms still follow the
    same object poses in the same postures.

    Attributes:
        position: m, that was asked about. angle: rad.
        samples: layouts with errors looked at, the corners of every arm's errors among them.
        feasible: share of them that still can do the task: limits, joint steps and the distances asked for.
        margin: rad, smallest joint margin over those that can be followed, negative beyond a limit.
        margin_by_sensitivity: rad, its first-order estimate.
        clearances: word of a class -> m, smallest distance over the same.
        largest: factor on both errors up to which every sampled layout stays feasible (1 = exactly those asked about).
        note: what breaks first, one sentence.
    """

    position: float
    angle: float
    samples: int
    feasible: float
    margin: float
    margin_by_sensitivity: float
    clearances: Mapping[str, float]
    largest: float
    note: str


@dataclass(frozen=True, slots=True)
class Relaxation:
    """A change of the cell that makes it feasible, found by trying it.

    Attributes:
        what: one sentence ("allow main to stand up to 0.25 m farther out").
        pointer: JSON pointer of the field to change. objective: E of the layout that becomes possible.
    """

    what: str
    pointer: str
    objective: float


@dataclass(frozen=True, slots=True)
class Explanation:
    """What blocks an infeasible cell.

    Attributes:
        blocking: these by themselves leave no layout; proved, or no layout was found.
        irreducible: True if it is proved that they leave none, and a layout of what they concern is known without any
            one of them; False: they block all layouts that were met.
        relaxations: changes that help, each with the smallest number that was found, cheapest first.
        behind: what still leaves no layout once the first conflict is undone, where undoing it is not enough; else ().
    """

    blocking: tuple[str, ...]
    irreducible: bool
    relaxations: tuple[Relaxation, ...]
    behind: tuple[str, ...] = ()
