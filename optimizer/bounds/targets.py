"""What the bounds need to know of a task: wrist points and orientations, seen from a base that is not turned."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from models.arrays import Floats
from models.closed_form import ClosedForm
from optimizer.reduced import ReducedProblem


@dataclass(frozen=True, eq=False, slots=True)
class Targets:
    """The poses of a reduced problem in the terms of `models.closed_form`.

    Attributes:
        form: the robot's closed form.
        sigma: sense of joint 1 about the world's vertical; h1 is (0, 0, σ).
        wrist: (m, 3) m, position of W relative to axis 1 if the base stood at the world's origin.
        turned: (m, 3, 3) rotation that the six joints have to make together.
        last_axis: (m, 3) direction of axis 6, the same wherever the base stands.
        dims: number of coordinates that may vary: 2, or 3 where z is free.
    """

    form: ClosedForm
    sigma: int
    wrist: Floats
    turned: Floats
    last_axis: Floats
    dims: int

    @staticmethod
    def of(problem: ReducedProblem) -> Targets:
        """The targets of an arm's reduced problem."""
        form = problem.form
        turned = problem.rotations @ form.home_rotation.T
        wrist = problem.positions + problem.rotations @ form.wrist_in_flange - form.origin
        dims = 2 if problem.arm.base.z.fixed else 3
        return Targets(form, problem.sigma, wrist, turned, turned @ form.axes[5], dims)

    @property
    def lean(self) -> float:
        """n · h1: zero where the parallel axes are level."""
        return float(self.form.n @ self.form.axes[0])

    @property
    def level(self) -> float:
        """Length of the level part of n."""
        return float(np.sqrt(1.0 - self.lean**2))

    @property
    def across(self) -> Floats:
        """(3,) direction of the level part of n."""
        across: Floats = (self.form.n - self.lean * self.form.axes[0]) / self.level
        return across
