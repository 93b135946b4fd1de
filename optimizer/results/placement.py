"""Where one arm stands, what it does there, and how far it is from its limits."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.robot.joint import JointKind
from duocell.optimizer.results.measured import Measured, TermShare


@dataclass(frozen=True, eq=False)
class Displacement:
    """What an arm has chosen of what its poses leave open.

    Attributes:
        names: (k) of the parameters, as in `duocell.models.robot.freedom`.
        values: (m, k) m and rad.
        tools: (m, 4, 4) the tool centre point in the world.
    """

    names: tuple[str, ...]
    values: Floats
    tools: Floats

    def __post_init__(self) -> None:
        set_frozen(self, "values", self.values, (None, len(self.names)))
        set_frozen(self, "tools", self.tools, (None, 4, 4))


@dataclass(frozen=True, eq=False)
class Placement:
    """Where one arm stands and how it moves there.

    Attributes:
        arm: its name.
        position: (3,) m, base origin in the world.
        yaw: rad, in the interval of the request.
        joints: (m, n) rad, or m for those of ``joint_kinds`` that are prismatic.
        posture: names of the signs, or None for arms without them.
        objective: this arm's part of the objective.
        joint_margins: (n,) rad or m, smallest distance to a limit over the path; inf for joints without end.
        minimum_margin: rad, smallest of those of revolute joints; inf if none has limits.
        displacement: what was chosen where poses leave something open, or None.
        linear_margins: of every linear limit its name, and rad, the smallest distance of its sum to its limits.
        minimum_conditioning: smallest σmin/σmax of the Jacobian (translation divided by ``characteristic_length``).
        characteristic_length: m.
        singularity_distances: name of a singular set ("elbow", "wrist", "shoulder") -> smallest distance over the path
            (rad for elbow and wrist, m for shoulder); empty for arms without a closed form.
        geometry: where the shape of the arm's links comes from: mesh | cited | estimated.
        mount: (3, 3) orientation of the base in the world at yaw 0.
        mounting_face: (4, 4) m, the face it is bolted down with, in the base frame; None where it is not known.
        measures: of the path, every one that is known. terms: the objective, measure by measure.
        avoids_singularities: the rule it was judged by: False where the arm may go through wrist singularities.
        joint_kinds: n kinds; empty: all joints are revolute.
    """

    arm: str
    position: Floats
    yaw: float
    joints: Floats
    posture: dict[str, str] | None
    objective: float
    joint_margins: Floats
    minimum_margin: float
    minimum_conditioning: float
    characteristic_length: float
    singularity_distances: dict[str, float]
    geometry: str = "estimated"
    mount: Floats = field(default_factory=lambda: np.eye(3))
    avoids_singularities: bool = True
    mounting_face: Floats | None = None
    linear_margins: tuple[tuple[str, float], ...] = ()
    joint_kinds: tuple[JointKind, ...] = ()
    measures: tuple[Measured, ...] = ()
    terms: tuple[TermShare, ...] = ()
    displacement: Displacement | None = None

    def __post_init__(self) -> None:
        set_frozen(self, "position", self.position, (3,))
        set_frozen(self, "joints", self.joints, (None, None))
        set_frozen(self, "joint_margins", self.joint_margins, (None,))
        set_frozen(self, "mount", self.mount, (3, 3))
