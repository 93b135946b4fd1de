"""What enclosures of joint values leave beside a task: for rounding, and for what a check lets pass.

Near a stretched elbow, a wrist point next to axis 1 and a straight wrist, angles change with the square root of a way:
what rounding does to a distance of a metre, 1e-16 m, is 1e-8 rad there, whatever formula is used. No slack of angles
covers that. So it is the places that are widened: by backward error analysis a formula that is exact to a few units in
the last place gives the exact angle for a wrist point that is a few units off, and such points are in the box. A slack
of angles (`joints.SLACK`) is then enough for all that is not near such a posture.

A check lets hands pass that miss their pose by a micrometre, and bases that stand as far out of their region. A proof
that nothing is possible has to enclose these too.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.kept import KEPT
from duocell.optimizer.certificate.bounds.angles.targets import Targets

UNITS = 64.0
"""Units in the last place of the largest coordinate that rounding makes of places, with room to spare."""
ONE = 8.0
"""m, and a coordinate that counts at least: lengths of arms."""
SINE = 1.0 + 1e-14
"""What computed sines are multiplied by before they are turned into angles that bound others."""


@dataclass(frozen=True, slots=True)
class Allowance:
    """How far the hand may be off its pose: ``shift`` m (of the wrist point), ``turn`` rad."""

    shift: float
    turn: float

    @staticmethod
    def of_rounding(targets: Targets) -> Allowance:
        """For rounding, and for what the arm that is meant is off this one; both seen from the wrist point."""
        largest = float(np.max(np.abs(targets.wrist), initial=0.0))
        eps = float(np.finfo(np.float64).eps)
        rounding = UNITS * eps * max(largest, ONE)
        return Allowance(rounding + targets.apart.wrist, UNITS * eps + targets.apart.angle)

    @staticmethod
    def of_checks(targets: Targets) -> Allowance:
        """For all that a check lets pass: poses missed by `KEPT` in place and direction, seen from the wrist point.

        Two more are for a tool of a metre, and for robots whose axes are parallel and level to 1e-7 only.
        """
        rounding = Allowance.of_rounding(targets)
        lever = float(np.linalg.norm(targets.form.wrist_in_flange))
        return Allowance((3.0 + lever) * KEPT + rounding.shift, KEPT + rounding.turn)


NONE = Allowance(0.0, 0.0)
"""For the value at a point, which is no enclosure."""
