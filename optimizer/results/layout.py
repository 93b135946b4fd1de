"""Results: frozen, complete, free of any engine's types."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from enum import StrEnum

import numpy as np

from duocell.models.base.arrays import Floats, set_frozen
from duocell.optimizer.results.findings import Alternative, Clearance, Explanation, Tolerance
from duocell.optimizer.results.measured import TermShare
from duocell.optimizer.results.placement import Placement


class Outcome(StrEnum):
    """What is known of a cell in the end. Neither ``optimal`` nor ``infeasible`` is said without a proof."""

    OPTIMAL = "optimal"  # usable, and proved to be the best within the gap that was asked for
    FEASIBLE = "feasible"  # usable; how far from the best, is known as far as the certificate says
    INFEASIBLE = "infeasible"  # proved: there is no usable layout; reasons say why
    UNKNOWN = "unknown"  # nothing usable found and nothing proved; reasons say what stopped it

    @staticmethod
    def of(*, usable: bool, proved: bool) -> Outcome:
        """The word for a usable layout, or for none, with or without a proof that this is the answer."""
        if usable:
            return Outcome.OPTIMAL if proved else Outcome.FEASIBLE
        return Outcome.INFEASIBLE if proved else Outcome.UNKNOWN

    @property
    def usable(self) -> bool:
        """True if there is a layout."""
        return self in (Outcome.OPTIMAL, Outcome.FEASIBLE)

    @property
    def proved(self) -> bool:
        """True if there is a proof."""
        return self in (Outcome.OPTIMAL, Outcome.INFEASIBLE)


@dataclass(frozen=True, slots=True)
class Reason:
    """Why an arm cannot do its part of the task.

    Attributes:
        arm: name of the arm.
        kind: out_of_reach | joint_limit | joint_step | posture | segments | conditioning | singularity |
            limit_reached | not_found | floor | coupling | collision.
        poses: indices of the poses concerned (0-based).
        joint: name of the joint concerned, or None.
        amount: by how much, in ``unit``; None where there is no number.
        unit: "m", "rad" or "".
        detail: one sentence for a person.
    """

    arm: str
    kind: str
    poses: tuple[int, ...]
    detail: str
    joint: str | None = None
    amount: float | None = None
    unit: str = ""


@dataclass(frozen=True, slots=True)
class SegmentShare:
    """One segment of the task.

    Attributes:
        name: label given by the user. first_pose: index. poses: how many.
        weight: largest weight of its poses.
        objective: its part of the objective over all arms; None where an arm has no placement.
    """

    name: str
    first_pose: int
    poses: int
    weight: float
    objective: float | None


@dataclass(frozen=True, slots=True)
class Search:
    """What the search did: evidence where no proof is possible.

    Attributes:
        candidates: base placements × postures evaluated.
        starts: local optimisations run.
        basins: distinct local optima found.
        wall_time: s.
        ended: False if the time limit cut the search, or the proof that is tried unasked, before it was through.
        first_feasible_time: s from the start to the first usable layout of the whole cell; None without one.
    """

    candidates: int
    starts: int
    basins: int
    wall_time: float
    ended: bool = True
    first_feasible_time: float | None = None


@dataclass(frozen=True, slots=True)
class Verification:
    """Numbers by Pinocchio, which did not produce the answer.

    Attributes:
        max_position_error: m. max_orientation_error: rad. max_joint_step: rad between consecutive poses of a segment.
        max_prismatic_step: m, likewise, of joints that shift; None where there is none.
        limits_respected: every joint inside its limits to 1e-6 and every base inside its region.
        tolerances_respected: every pose inside what the task leaves open there, from where the joints take the hand.
    """

    max_position_error: float
    max_orientation_error: float
    max_joint_step: float
    limits_respected: bool
    max_prismatic_step: float | None = None
    tolerances_respected: bool = True


@dataclass(frozen=True, slots=True)
class ArmCertificate:
    """Proof for one arm: no base in its region scores less than ``lower_bound``.

    ``lower_bound`` is None where the arm is proved infeasible or where no proof is offered (``note`` says which).
    ``ended`` is False if its time limit cut the proof.
    """

    arm: str
    lower_bound: float | None
    gap: float | None
    proved: bool
    boxes: int
    wall_time: float
    note: str = ""
    ended: bool = True


@dataclass(frozen=True, slots=True)
class Certificate:
    """Proof for the whole cell.

    Attributes:
        lower_bound: no layout scores less; None where infeasible or where no proof is offered.
        gap: of the answer, ``(objective - lower_bound) / max(objective, 1e-9)``; None without both.
        proved: ``gap`` is at most ``wanted``, or ``infeasible``.
        boxes: bounded. wall_time: s. arms: the proofs of the arms alone.
        wanted: the gap that was asked for.
        infeasible: there is no usable layout at all; ``reasons`` say why.
        ended: False if its time limit cut the proof.
    """

    lower_bound: float | None
    gap: float | None
    proved: bool
    boxes: int
    wall_time: float
    arms: tuple[ArmCertificate, ...]
    wanted: float = 0.0
    infeasible: bool = False
    reasons: tuple[Reason, ...] = ()
    ended: bool = True


@dataclass(frozen=True, eq=False)
class PenaltyCycle:
    """One cycle of a penalty method: the minimum of Φ for one value of its parameter.

    Attributes:
        phase: "reach", "exterior" or "interior".
        parameter: r' or r; 0 in the reach phase, which has none.
        penalised: Φ there. objective: E there; None where the inverse kinematics do not exist.
        placement: (4,) x, y, z [m], yaw [rad].
        worst: largest constraint row [rad or m]; positive means violated.
        iterations: line searches of the conjugate gradients. evaluations: of Φ with its gradient.
    """

    phase: str
    parameter: float
    penalised: float
    objective: float | None
    placement: Floats
    worst: float
    iterations: int
    evaluations: int

    def __post_init__(self) -> None:
        set_frozen(self, "placement", self.placement, (4,))


@dataclass(frozen=True, eq=False)
class BaselineArm:
    """Result of a baseline method for one arm.

    Attributes:
        arm: its name.
        position: (3,) m. yaw: rad.
        objective: E of the arm at the last point; None where the inverse kinematics do not exist there.
        feasible: True if every constraint of the problem holds there.
        start: (4,) x, y, z [m], yaw [rad] where the method began, or None if it did not run.
        posture: names of the signs, or None.
        trace: every cycle.
        note: what a reader should know: an infeasible start, an extra phase, why there is no result.
        mount: (3, 3) orientation of the base in the world at yaw 0.
    """

    arm: str
    position: Floats
    yaw: float
    objective: float | None
    feasible: bool
    start: Floats | None = None
    posture: dict[str, str] | None = None
    trace: tuple[PenaltyCycle, ...] = ()
    note: str = ""
    mount: Floats = field(default_factory=lambda: np.eye(3))

    def __post_init__(self) -> None:
        set_frozen(self, "mount", self.mount, (3, 3))


@dataclass(frozen=True, slots=True)
class Baseline:
    """Result of a method of the literature on the same problem."""

    method: str
    objective: float | None
    wall_time: float
    feasible: bool
    arms: tuple[BaselineArm, ...]
    note: str = ""


@dataclass(frozen=True, slots=True)
class Layout:
    """The answer for a cell.

    Attributes:
        outcome: what is known.
        objective: what was minimised, or None without a usable layout.
        placements: of the arms that work, in the order of the cell; without a usable layout also the nearest that was
            seen, and what it breaks stands in the reasons.
        reasons: why there is no usable layout, and what stopped the search.
        search: evidence.
        verification: None where there is no placement.
        clearances: what every class of pairs keeps along the whole path; empty if none was asked for.
        alternatives: other layouts, best first, if asked for.
        tolerance: what installation errors leave, if asked for.
        explanation: what blocks an infeasible cell, if asked for.
        segments: of the task, in order; one for a plain task.
    """

    outcome: Outcome
    objective: float | None
    placements: tuple[Placement, ...]
    reasons: tuple[Reason, ...]
    search: Search
    verification: Verification | None
    certificate: Certificate | None = None
    baselines: tuple[Baseline, ...] = ()
    clearances: tuple[Clearance, ...] = ()
    alternatives: tuple[Alternative, ...] = ()
    tolerance: Tolerance | None = None
    explanation: Explanation | None = None
    segments: tuple[SegmentShare, ...] = ()

    @property
    def proved(self) -> bool:
        """True only with a proof: of optimality within the gap that was asked for, or of infeasibility."""
        return self.outcome.proved

    @property
    def usable(self) -> bool:
        """True if there is a layout."""
        return self.outcome.usable

    @property
    def objective_terms(self) -> tuple[TermShare, ...]:
        """The objective, measure by measure over all arms; empty without one."""
        if self.objective is None:
            return ()
        return tuple(
            replace(shares[0], cost=sum(share.cost for share in shares))
            for shares in zip(*(placement.terms for placement in self.placements), strict=True)
        )
