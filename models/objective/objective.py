"""What a layout is to be best at: a weighted sum of measures, over the poses of the task and over the arms."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidInput
from duocell.models.base.weights import check_weights
from duocell.models.objective.joint_availability import JointAvailability
from duocell.models.objective.measure import Measure
from duocell.models.robot.arm import Arm


@dataclass(frozen=True, slots=True)
class Term:
    """One measure of an objective, and by what its cost is multiplied."""

    measure: Measure
    weight: float = 1.0


@dataclass(frozen=True, slots=True)
class Objective:
    """Σ weight of the term · weight of the pose · cost of the measure, over terms, arms and poses: the less the better.

    Attributes:
        terms: no measure twice. None at all: every layout is as good as any other.

    Raises:
        InvalidInput: a measure stands twice, or a weight is not positive or out of range.
    """

    terms: tuple[Term, ...]

    def __post_init__(self) -> None:
        check_weights(np.array([term.weight for term in self.terms]), "")
        seen: list[Measure] = []
        for index, term in enumerate(self.terms):
            if term.weight == 0.0:
                raise InvalidInput("a weight of 0 asks for nothing; leave the measure out.", f"/{index}/weight")
            if term.measure in seen:
                raise InvalidInput(
                    f"{term.measure.name} stands twice; add the weights up and name it once.", f"/{index}/measure"
                )
            seen.append(term.measure)

    @property
    def measures(self) -> tuple[Measure, ...]:
        """Of the terms."""
        return tuple(term.measure for term in self.terms)

    @property
    def name(self) -> str:
        """The measures with their weights, in words."""
        single = len(self.terms) == 1
        parts = [t.measure.name if single else f"{t.weight:g} {t.measure.name}" for t in self.terms]
        return " + ".join(parts)

    @property
    def unit(self) -> str:
        """Of the sum; "1" where the measures differ in theirs, whose weights then carry what is missing."""
        units = {term.measure.cost_unit for term in self.terms}
        return units.pop() if len(units) == 1 else "1"

    @property
    def keeps_reduction(self) -> bool:
        """True if the turns and the base yaw that suit joint availability are best for the whole sum."""
        return all(term.measure.keeps_reduction for term in self.terms)

    @property
    def bounded(self) -> bool:
        """True if lower bounds are known (`duocell.optimizer.certificate`): of joint availability alone they are."""
        return len(self.terms) == 1 and self.terms[0].measure.bounded

    def of_paths(self, arm: Arm, joints: Floats, counts: Floats | None) -> Floats:
        """(...) of many paths (n, ..., m): joints first, poses last; ``counts`` (m,) of the poses, None for 1."""
        total: Floats = np.zeros(joints.shape[1:-1])
        for index, term in enumerate(self.terms):
            part = term.weight * term.measure.of_paths(arm, joints, counts)
            total = part if index == 0 else total + part
        return total

    def of_path(self, arm: Arm, joints: Floats, counts: Floats) -> float:
        """Of one path (m, n); ``counts`` (m,) as in `of_paths`."""
        return sum(term.weight * float(counts @ term.measure.costs(arm, joints)) for term in self.terms)

    def of_poses(self, arm: Arm, joints: Floats) -> Floats:
        """(...) of single poses (..., n), each counted once."""
        total: Floats = np.zeros(joints.shape[:-1])
        for term in self.terms:
            total = total + term.weight * term.measure.costs(arm, joints)
        return total

    def gradient(self, arm: Arm, joints: Floats, counts: Floats) -> Floats:
        """(..., m, n) derivatives of the sum by joint values (..., m, n)."""
        total: Floats = np.zeros(joints.shape)
        for term in self.terms:
            total = total + term.weight * term.measure.gradient(arm, joints, counts)
        return total

    def curvature(self, arm: Arm, joints: Floats, counts: Floats) -> Floats:
        """(m, n, n) second derivatives of the sum by the joint values (m, n) of each pose."""
        total: Floats = np.zeros((*joints.shape, arm.dof))
        for term in self.terms:
            total = total + term.weight * term.measure.curvature(arm, joints, counts)
        return total

    def scale(self, arm: Arm) -> float:
        """What a pose typically costs: what violations and tolerances are measured against; 1 without terms."""
        return sum(term.weight * term.measure.scale(arm) for term in self.terms) or 1.0


JOINT_AVAILABILITY = Objective((Term(JointAvailability()),))
"""The objective where none is asked for."""
NOTHING = Objective(())
"""For searches that ask for nothing but a usable path."""
