"""What the bounds need to know of a task: wrist points and orientations, in axes of the base at yaw 0.

A base may be mounted in any fixed orientation. The geometry is done in axes of the mount; for upright bases, hanging
bases and bases on walls a box of positions is a box there too, for others the smallest box around it is taken.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.closed_form import ClosedForm
from duocell.models.kinematics.difference import SAME, Difference
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.reduction.reduced import ReducedProblem


@dataclass(frozen=True, eq=False, slots=True)
class Targets:
    """The poses of a reduced problem in the terms of `duocell.models.kinematics.closed_form`.

    Attributes:
        form: the robot's closed form.
        sigma: sense of joint 1 about the base's z axis; h1 is (0, 0, σ).
        mount: (3, 3) base orientation in the world at yaw 0.
        wrist: (m, 3) m, position of W relative to axis 1 if the base stood at the world's origin.
        turned: (m, 3, 3) rotation that the six joints have to make together.
        last_axis: (m, 3) direction of axis 6, the same wherever the base stands.
        dims: number of coordinates along the mount's axes that may vary: 3, or 2 where the last one is fixed.
        apart: how far hands may be off, because another arm is meant; see `ReducedProblem`.
    """

    form: ClosedForm
    sigma: int
    mount: Floats
    wrist: Floats
    turned: Floats
    last_axis: Floats
    dims: int
    apart: Difference = SAME

    @staticmethod
    def of(problem: ReducedProblem) -> Targets:
        """The targets of an arm's reduced problem."""
        form = problem.form
        turned = problem.rotations @ form.home_rotation.T
        mount = problem.arm.mount
        wrist = problem.positions @ mount + problem.rotations @ form.wrist_in_flange - form.origin
        bounds = problem.arm.base.bounds[:3]
        rises = float((bounds[:, 1] - bounds[:, 0]) @ np.abs(mount[:, 2])) > 1e-12
        dims = 3 if rises or problem.apart != SAME else 2  # a hand may be too high or too low where the base is not
        return Targets(form, problem.sigma, mount, wrist, turned, turned @ form.axes[5], dims, problem.apart)

    @property
    def upright(self) -> bool:
        """True if the mount's axes are the world's."""
        return bool(np.array_equal(self.mount, np.eye(3)))

    def local(self, boxes: Boxes) -> Boxes:
        """Boxes along the mount's axes that hold ``boxes``, which lie along the world's."""
        if self.upright:
            return boxes
        return Boxes(boxes.centre @ self.mount, boxes.half @ np.abs(self.mount), boxes.posture)

    @property
    def lean(self) -> float:
        """n · h1: zero where the parallel axes are level."""
        return float(self.form.n @ self.form.axes[0])

    @property
    def level(self) -> float:
        """Length of the level part of n."""
        return float(np.linalg.norm(np.cross(self.form.n, self.form.axes[0])))

    @property
    def across(self) -> Floats:
        """(3,) direction of the level part of n."""
        across: Floats = (self.form.n - self.lean * self.form.axes[0]) / self.level
        return across
