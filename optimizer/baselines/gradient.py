"""E(Γ) of one posture with its exact gradient, the joint values followed continuously as Γ moves.

Γ = (x, y, z, yaw) of one arm. Moving the base by dΓ moves every flange target rigidly as the arm sees it, so
``dq/dΓ = J⁻¹ V`` with V the twist of that motion; gradients are pulled back through ``Jᵀ λ = ∂Φ/∂q``. The source prints
closed-form gradients for the PUMA instead (its appendix A, with misprints); these hold for every arm.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.branches import solve_signed
from duocell.models.kinematics.kinematics import jacobians
from duocell.models.robot.arm import TURN, Interval
from duocell.models.robot.posture import ALL_SIGNS, Signs
from duocell.optimizer.baselines.reach import ReachRows, reach_rows
from duocell.optimizer.reduction.reduced import Paths, ReducedProblem, evaluate


@dataclass(frozen=True, eq=False, slots=True)
class Followed:
    """The path of one posture from one placement.

    Attributes:
        placement: (4,) x, y, z [m] and yaw [rad].
        joints: (m, 6) rad, continuous along the path and continued from where the path was followed from.
        reach: rows of the reach guard.
    """

    placement: Floats
    joints: Floats
    reach: ReachRows


class PostureFunction:
    """E(Γ) of one arm in one posture."""

    def __init__(self, problem: ReducedProblem, signs: Signs) -> None:
        self.problem, self.signs = problem, signs
        weights = problem.arm.weights
        self._weights = weights if problem.weights is None else problem.weights[:, None] * weights

    def begin(self, placement: Floats) -> Followed | None:
        """The path at ``placement`` (4,) with the windings that cost least inside the limits; None out of reach."""
        paths = paths_at(self.problem, placement)
        index = ALL_SIGNS.index(self.signs)
        if paths.missing[index, 0] > 0.0:
            return None
        joints = paths.joints[:, index, 0].T
        return Followed(placement, joints, self._reach(placement, joints))

    def follow(self, placement: Floats, near: Followed) -> Followed | None:
        """The path at ``placement`` (4,), continued from ``near``; None out of reach or too far to tell the
        windings.
        """
        joints, missing = self._branch(placement)
        if missing.any():
            return None
        joints[:, 0] -= self.problem.sigma * placement[3]
        for segment in self.problem.segments:
            path = joints[segment]
            steps = np.diff(path, axis=0)
            path[1:] -= TURN * np.cumsum(np.round(steps / TURN), axis=0)
            # What the yaw does to joint 1 is known, so only the rest has to be small.
            turned = path - near.joints[segment]
            turned[:, 0] += self.problem.sigma * (placement[3] - near.placement[3])
            windings = np.round(np.mean(turned, axis=0) / TURN)
            if np.max(np.abs(turned - TURN * windings)) > np.pi:
                return None
            path -= TURN * windings
        return Followed(placement, joints, self._reach(placement, joints))

    def objective(self, path: Followed) -> float:
        """E of the arm (8.21)."""
        error = path.joints - self.problem.arm.reference
        return float(np.sum(self._weights * error * error))

    def objective_slope(self, path: Followed) -> Floats:
        """(m, 6) ∂E/∂q."""
        slope: Floats = 2.0 * self._weights * (path.joints - self.problem.arm.reference)
        return slope

    def pull_back(self, path: Followed, slope: Floats) -> Floats | None:
        """(4,) dΦ/dΓ of a function of the joints with ``slope`` (m, 6) = ∂Φ/∂q; None at an exact singularity."""
        cos, sin = np.cos(path.placement[3]), np.sin(path.placement[3])
        base = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]])  # base axes in the world
        jacobian = jacobians(self.problem.arm.robot, path.joints, np.eye(4))  # (m, 6, 6), base axes
        try:
            force = np.linalg.solve(np.swapaxes(jacobian, 1, 2), slope[:, :, None])[:, :, 0]
        except np.linalg.LinAlgError:
            return None
        flange = (self.problem.positions - path.placement[:3]) @ base  # (m, 3) in base axes
        position = -base @ np.sum(force[:, :3], axis=0)
        moment = flange[:, 0] * force[:, 1] - flange[:, 1] * force[:, 0] + force[:, 5]
        gradient = np.array([*position, -np.sum(moment)])
        return gradient if np.all(np.isfinite(gradient)) else None

    def reach_at(self, position: Floats) -> ReachRows:
        """The reach rows at a base position (3,), whether or not the inverse kinematics exist there."""
        return self._reach(np.array([*position, 0.0]), self._branch(np.array([*position, 0.0]))[0])

    def _branch(self, placement: Floats) -> tuple[Floats, Floats]:
        """(joints (m, 6) at yaw 0 modulo 2π, missing (m,))."""
        problem = self.problem
        relative = (problem.positions - placement[:3])[None]
        branch = solve_signed(problem.form, problem.rotations, relative, np.array([self.signs]))
        return np.ascontiguousarray(branch.joints[:, 0, 0].T), branch.missing[0, 0]

    def _reach(self, placement: Floats, joints: Floats) -> ReachRows:
        problem = self.problem
        relative = problem.positions - placement[:3]
        return reach_rows(problem.form, problem.rotations, relative, joints, self.signs)


def paths_at(problem: ReducedProblem, placement: Floats) -> Paths:
    """All postures from one placement (4,), the yaw included: arrays of `evaluate` with N = 1."""
    yaw = float(placement[3])
    base = replace(problem.arm.base, yaw=Interval(yaw, yaw))
    fixed = replace(problem, arm=replace(problem.arm, base=base))
    return evaluate(fixed, placement[None, :3])
