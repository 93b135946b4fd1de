"""The best path of one arm from many base positions, over samples of what its poses leave open.

Every choice of the parameters at a pose is a flange pose with a closed form of its own. A path takes one choice per
pose; the cheapest is found by dynamic programming over these layers, for all bases and postures at once. Joint 1 is
shifted by the yaw, which is one for the whole path: the layers are gone through without it first, and then again with
the yaw that the path before has led to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import Branches, solve_branches, solve_signed
from duocell.models.kinematics.wrist_singularity import wrist_shortfall
from duocell.models.robot.arm import TURN, Arm
from duocell.optimizer.reduction.reduced import Paths, ReducedProblem, paths_of
from duocell.optimizer.single_arm.open_poses.parameter_samples import ParameterSamples, samples_of

PASSES = 2
"""Times that the layers are gone through with joint 1 in them."""
FAR = 20.0
"""Cost of a metre out of reach, beside that of a radian beyond a limit."""
CHUNK = 48
"""Base positions that are looked at together, to bound memory."""


@dataclass(frozen=True, eq=False, slots=True)
class SampledTask:
    """The poses of one arm with choices for what they leave open.

    Attributes:
        problem: reduced, of the poses (m) at their nominal parameters.
        samples: (m, S) choices. rotations: (m · S, 3, 3) in axes of the mount. positions: (m · S, 3) m, in the world.
        steps: rad that joints may change by from each pose to the next, (m - 1,); infinite where anything goes.
    """

    problem: ReducedProblem
    samples: ParameterSamples
    rotations: Floats
    positions: Floats
    steps: Floats

    @staticmethod
    def of(cell: Cell, arm: Arm, problem: ReducedProblem, poses: Ints, coarse: bool) -> SampledTask:
        """Some of the poses (their indices, ascending) of an arm; ``problem`` is that of all of them."""
        few = problem.only(poses) if len(poses) < len(cell.task) else problem
        segments = cell.task.segment_of[poses]
        joined = segments[1:] == segments[:-1]
        freedom = cell.freedom(arm)
        samples = samples_of(freedom, poses, joined, coarse)
        values = np.broadcast_to(freedom.nominal, (samples.count, *freedom.nominal.shape)).copy()
        values[:, poses] = samples.values.swapaxes(0, 1)
        targets = freedom.targets(values)[:, poses].swapaxes(0, 1).reshape(-1, 4, 4)
        steps = np.where(joined, np.diff(poses) * problem.max_step, np.inf)
        return SampledTask(
            few, samples, arm.mount.T @ targets[:, :3, :3], targets[:, :3, 3], np.where(steps < np.pi, steps, np.inf)
        )


@dataclass(frozen=True, eq=False, slots=True)
class SampledPaths:
    """Best paths per posture and base.

    Attributes:
        paths: as of given poses. chosen: (8, N, m) number of the choice at every pose.
    """

    paths: Paths
    chosen: Ints


def evaluate_sampled(task: SampledTask, positions: Floats, signs: Ints | None = None) -> SampledPaths:
    """The best path of every posture from base positions (N, 3) [m]; with ``signs`` (N, 3) of one posture each."""
    parts = [
        _evaluated(task, positions[at : at + CHUNK], None if signs is None else signs[at : at + CHUNK])
        for at in range(0, len(positions), CHUNK)
    ]
    fields = ("yaw", "objective", "missing", "beyond", "jump", "singular")
    joints = np.concatenate([part.paths.joints for part in parts], axis=2)
    paths = Paths(joints, *(np.concatenate([getattr(part.paths, name) for part in parts], axis=1) for name in fields))
    if signs is None:
        paths.jump[~task.problem.postures] = np.inf
    return SampledPaths(paths, np.concatenate([part.chosen for part in parts], axis=1))


def _evaluated(task: SampledTask, positions: Floats, signs: Ints | None) -> SampledPaths:
    """A few positions at once."""
    problem = task.problem
    seen = task.positions - positions[:, None, :]
    seen = seen if problem.arm.upright else seen @ problem.arm.mount
    if signs is None:
        found = solve_branches(problem.form, task.rotations, seen)
    else:
        found = solve_signed(problem.form, task.rotations, seen, signs)
    layers = _Layers.of(task, found)
    best: SampledPaths | None = None
    shift: Floats | None = None
    for _ in range(PASSES + 1):
        chosen = layers.cheapest(shift)
        taken = layers.taken(chosen)
        paths = paths_of(problem, taken)
        here = SampledPaths(paths, chosen)
        best = here if best is None else _better(problem, best, here)
        shift = paths.joints[0, ..., 0] - layers.joints[0][_at(chosen[..., :1], layers.joints[0])][..., 0]
    if best is None:
        raise AssertionError("the layers were never gone through")
    return best


def _better(problem: ReducedProblem, one: SampledPaths, other: SampledPaths) -> SampledPaths:
    """The better of two paths for every posture and base."""
    wins = problem.score(other.paths.objective, other.paths.violation) < problem.score(
        one.paths.objective, one.paths.violation
    )
    names = ("yaw", "objective", "missing", "beyond", "jump", "singular")
    joints = np.where(wins[..., None], other.paths.joints, one.paths.joints)
    rest = (np.where(wins, getattr(other.paths, name), getattr(one.paths, name)) for name in names)
    return SampledPaths(Paths(joints, *rest), np.where(wins[..., None], other.chosen, one.chosen))


def _at(chosen: Ints, array: Floats) -> tuple[Ints, ...]:
    """Indices into (B, N, m, S) of the choices (B, N, m')."""
    b, n, m = np.ogrid[: chosen.shape[0], : chosen.shape[1], : chosen.shape[2]]
    return b, n, m, chosen


@dataclass(frozen=True, eq=False, slots=True)
class _Layers:
    """Choices of all poses from N bases in B postures.

    Attributes:
        task: the task. joints: (6, B, N, m, S) rad, joint 1 at yaw 0. missing: (B, N, m, S) m.
        costs: (B, N, m, S) of joints 2 to 6, each on its best turn, with what is violated made dear.
    """

    task: SampledTask
    joints: Floats
    missing: Floats
    costs: Floats

    @staticmethod
    def of(task: SampledTask, found: Branches) -> _Layers:
        """The layers of branches (6, B, N, m · S)."""
        problem, arm, shape = task.problem, task.problem.arm, task.samples.values.shape[:2]
        joints = found.joints.reshape(*found.joints.shape[:3], *shape)
        missing = found.missing.reshape(*found.missing.shape[:2], *shape)
        dear = problem.penalty * arm.weight_scale
        costs = FAR * dear * missing
        weights = _weights(problem)
        for i in range(1, arm.dof):
            costs += _cost(joints[i], arm, i, weights, dear)
        if arm.avoid_singularities:
            flat = joints.reshape(6, -1, 1)
            costs += dear * wrist_shortfall(arm, flat).reshape(missing.shape)
        return _Layers(task, joints, missing, costs)

    def cheapest(self, shift: Floats | None) -> Ints:
        """(B, N, m) the choices of the cheapest path; with joint 1 shifted by ``shift`` (B, N) rad, or without it."""
        arm, costs = self.task.problem.arm, self.costs
        dear = self.task.problem.penalty * arm.weight_scale
        if shift is not None:
            costs = costs + _cost(self.joints[0] + shift[..., None, None], arm, 0, _weights(self.task.problem), dear)
        links, steps, m = self.task.samples.links, self.task.steps, costs.shape[2]
        total, back = costs[:, :, 0], []
        for j in range(1, m):
            ways = total[..., :, None]
            if links is not None:
                ways = np.where(links[j - 1], ways, np.inf)
            if np.isfinite(steps[j - 1]):
                ways = ways + 1e3 * dear * np.maximum(self._steps(j) - steps[j - 1], 0.0)
            if ways.shape[-1] == 1:  # from anywhere to anywhere
                best = np.broadcast_to(np.argmin(total, axis=-1)[..., None], total.shape)
                reached = np.broadcast_to(np.min(total, axis=-1)[..., None], total.shape)
            else:
                best = np.argmin(ways, axis=-2)
                reached = np.take_along_axis(ways, best[..., None, :], axis=-2)[..., 0, :]
            back.append(best)
            total = reached + costs[:, :, j]
        path = [np.argmin(total, axis=-1)]
        for best in reversed(back):
            path.append(np.take_along_axis(best, path[-1][..., None], axis=-1)[..., 0])
        return np.stack(path[::-1], axis=-1)

    def _steps(self, j: int) -> Floats:
        """(B, N, S, S) rad, largest joint step from the choices of the pose before to those of pose j."""
        largest = np.zeros((1, 1, 1, 1))
        for joint in self.joints:
            turn = joint[:, :, j, None, :] - joint[:, :, j - 1, :, None]
            turn -= TURN * np.round(turn / TURN)
            largest = np.maximum(largest, np.abs(turn))
        return largest

    def taken(self, chosen: Ints) -> Branches:
        """The branches (6, B, N, m) of choices (B, N, m)."""
        at = _at(chosen, self.missing)
        return Branches(np.stack([joint[at] for joint in self.joints]), self.missing[at])


def _weights(problem: ReducedProblem) -> Floats:
    """(m, 1) what the poses count for."""
    weights = np.ones(len(problem.positions)) if problem.weights is None else problem.weights
    return weights[:, None]


def _cost(values: Floats, arm: Arm, joint: int, weights: Floats, dear: float) -> Floats:
    """(..., m, S) cost of one joint on the turn nearest to its reference that is inside its limits."""
    low, high, reference = arm.lower[joint], arm.upper[joint], arm.reference[joint]
    wound = values + TURN * np.round((reference - values) / TURN)
    if not (np.isfinite(low) and np.isfinite(high)):
        cost: Floats = arm.weights[joint] * weights * (wound - reference) ** 2
        return cost
    wound = wound + TURN * np.ceil(np.maximum(low - wound, 0.0) / TURN)
    wound = wound - TURN * np.ceil(np.maximum(wound - high, 0.0) / TURN)
    outside = np.maximum(low - wound, 0.0) + np.maximum(wound - high, 0.0)
    near: Floats = arm.weights[joint] * weights * (wound - reference) ** 2 + dear * np.minimum(outside, np.pi)
    return near
