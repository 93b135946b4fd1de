"""What the search of one arm found, and where it stands."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from duocell.models.kinematics.nominal import Nominal
from duocell.models.robot.arm import Arm
from duocell.optimizer.certificate.certify import BranchAndBound
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.parameters.local import LocalParameters
from duocell.optimizer.parameters.search import SEARCH, SearchParameters
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.results.layout import Reason


@dataclass(eq=False, slots=True)
class ArmSearch:
    """What was found for one arm.

    Attributes:
        arm: the arm. parameters: of the search.
        best: best usable point whose way from pose to pose can be gone, or None.
        nearest: where there is none, what was seen that comes nearest: usable but for its way, or breaking least.
        objective: E there; infinite without a point.
        candidates: bases × postures looked at. starts: local solves.
        optima: usable points that local solves ended in, best first: (objective, point).
        basins: how often each distinct one was reached, best first: (objective, hits).
        finished: False if time ran out.
        reasons: why there is no point. proved: True if that is certain.
        problem: the reduced problem, for a certificate; None for arms without one.
        tree: branch and bound over its bases as far as the search needed it; a certificate can go on with it.
        lift: from a path of `problem` to one of the arm, where these are not the same. no_proof: why there is none.
        drawing: search of the arm that this one was drawn as, `meant`, where its own geometry has no closed form.
    """

    arm: Arm
    parameters: SearchParameters = SEARCH
    best: ArmSolution | None = None
    nearest: ArmSolution | None = None
    objective: float = np.inf
    candidates: int = 0
    starts: int = 0
    optima: list[tuple[float, ArmSolution]] = field(default_factory=list)
    basins: list[tuple[float, int]] = field(default_factory=list)
    finished: bool = True
    reasons: tuple[Reason, ...] = ()
    proved: bool = False
    problem: ReducedProblem | None = None
    tree: BranchAndBound | None = None
    drawing: ArmSearch | None = None
    meant: Nominal | None = None
    lift: Callable[[ArmSolution], ArmSolution] | None = None
    no_proof: str = ""

    @property
    def local(self) -> LocalParameters:
        """Of the local solves."""
        return self.parameters.local
