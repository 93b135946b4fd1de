"""Many layouts with errors at once: the arms follow the same object poses; what is left of limits and distances?"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.pose import inverse
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import Configurations
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.path_samples import follow
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.tolerance.nominal import Nominal
from duocell.optimizer.verification.verify import LIMITS, SIDE, wrong_sides

FARTHEST = 0.3
"""rad that a joint is expected to move at most: near singularities the first order promises anything."""


@dataclass(frozen=True, eq=False, slots=True)
class ArmPath:
    """One arm's way in N layouts.

    Attributes:
        bases: (N, 4, 4) in the world. joints: (N, C, n) rad.
        arrived: (N, C) False where the arm cannot follow in its posture.
        margin: (N,) rad or m. step: (N,) likewise. conditioning: (N,) what is left of each, negative if too little.
        turning: (N,) rad, the margin of what turns alone.
    """

    bases: Floats
    joints: Floats
    arrived: Bools
    margin: Floats
    step: Floats
    conditioning: Floats
    turning: Floats


class Displaced:
    """N layouts with errors (N, A, 4) in x, y, z [m] and yaw [rad].

    Attributes:
        followed: (N,) True where every arm takes every pose in its posture.
        margin: (N,) rad, smallest margin of a joint that turns, or of a linear limit, at the poses.
        distance: (N,) m, lower bound of what the nearest pair keeps beyond the required distance.
        least_margin: (N,) m or rad, the least that is left of anything.
    """

    def __init__(self, nominal: Nominal, errors: Floats) -> None:
        """Let the arms follow."""
        self.nominal, self.errors = nominal, errors
        self.paths = [_arm_path(nominal, a, errors[:, a]) for a in range(len(nominal.cell.arms))]
        self.followed: Bools = np.all([np.all(path.arrived, axis=1) for path in self.paths], axis=0)
        self.margin: Floats = np.min([path.turning for path in self.paths], axis=0)
        own = [np.minimum(np.minimum(p.margin, p.step), p.conditioning) for p in self.paths]
        self._own: Floats = np.where(self.followed, np.min(own, axis=0), -np.inf)
        self._places, self._gaps = self._distances()
        self._settled: Bools = np.zeros(self._gaps.shape, dtype=np.bool_)
        if nominal.scene.model is not None:
            self._settled[...] = nominal.scene.model.exact_bounds
        self.distance: Floats = np.min(self._gaps - nominal.scene.required, axis=(1, 2), initial=np.inf)
        self.least_margin: Floats = np.minimum(self._own, self.distance)

    def __len__(self) -> int:
        return len(self.errors)

    def broken(self) -> Bools:
        """(N,) True for layouts that cannot do the task any more; bounds that leave a doubt are replaced by Coal."""
        broken: Bools = self._own < -LIMITS
        for i in np.flatnonzero(~broken & (self.least_margin < 0.0)):
            broken[i] = self.nearest(int(i))[0] < 0.0
        return broken

    def nearest(self, i: int) -> tuple[float, int, int]:
        """What a layout keeps beyond the required distances [m], at which place, by which pair; (inf, 0, 0) if none."""
        best = (np.inf, 0, 0)
        required = self.nominal.scene.required
        margins = self._gaps[i] - required
        for index in np.argsort(margins, axis=None, kind="stable"):
            k, pair = (int(x) for x in np.unravel_index(index, margins.shape))
            if not margins[k, pair] < best[0]:
                break
            best = min(best, (self._exact(i, k, pair) - float(required[pair]), k, pair))
        return best

    def closest(self) -> dict[PairClass, float]:
        """Smallest distance [m] of every class whose distances depend on the bases, over the layouts followed."""
        model, places = self.nominal.scene.model, self._places
        if model is None or places is None:
            return {}
        gaps = np.where(self.followed[:, None, None], self._gaps, np.inf).reshape(-1, self._gaps.shape[2])
        found = {kind: model.closest(places, kind, gaps) for kind in model.kinds}
        return {kind: entry[1].distance for kind, entry in found.items() if entry is not None}

    def points(self, i: int) -> tuple[ArmSolution, ...]:
        """A layout, one point per arm."""
        m = self.nominal.poses
        return tuple(
            ArmSolution(point.position + error[:3], point.yaw + float(error[3]), path.joints[i, :m], point.signs)
            for point, error, path in zip(self.nominal.points, self.errors[i], self.paths, strict=True)
        )

    def _distances(self) -> tuple[Configurations | None, Floats]:
        """All places of all layouts, and lower bounds (N, C, P) of the pairs that can come near enough to matter."""
        nominal, model = self.nominal, self.nominal.scene.model
        count, places = len(self.errors), len(nominal.step)
        if model is None:
            return None, np.zeros((count, places, 0))
        bases = np.stack([path.bases for path in self.paths], axis=1)
        joints = [path.joints for path in self.paths]
        here = model.configure_layouts(bases, joints, nominal.objects, nominal.segments)
        here = replace(here, counted=model.counted(nominal.bases))
        gaps = model.bounds(here, self._in_question(here))
        return here, gaps.reshape(count, places, -1)

    def _in_question(self, here: Configurations) -> Bools:
        """(P,) False for pairs that stay farther apart, whatever the error, than is required and than others are.

        No point of a body goes farther than the ends of its capsule, and its radius turned twice.
        """
        nominal, model = self.nominal, self.nominal.scene.model
        if model is None or len(self) == 0:
            return np.zeros(nominal.gaps.shape[1], dtype=np.bool_)
        b = model.bodies
        before = model.configure(nominal.bases, nominal.joints, nominal.objects, nominal.segments)
        shape = (len(self), len(nominal.step), *before.ends.shape[1:])
        shift = np.linalg.norm(here.ends.reshape(shape) - before.ends, axis=-1).max(axis=(0, 1, 3))
        turn = sum(
            np.max(np.sum(np.abs(path.joints - q), axis=2)) + np.max(np.abs(self.errors[:, a, 3]))
            for a, (path, q) in enumerate(zip(self.paths, nominal.joints, strict=True))
        )
        moved = shift + 2.0 * b.radius * min(float(turn), np.pi)
        nearest = np.min(nominal.gaps, axis=0)
        enough = nominal.scene.required.copy()
        for kind in model.kinds:
            own = np.array([other is kind for other in b.kinds])
            exact = model.closest(before, kind, nominal.gaps)
            if exact is not None:
                enough[own] = np.maximum(enough[own], exact[1].distance)
        question: Bools = nearest - moved[b.first] - moved[b.second] <= enough
        return question

    def _exact(self, i: int, k: int, pair: int) -> float:
        """The distance of a pair [m] at a place of a layout, by Coal where its bound is not exact."""
        model, places = self.nominal.scene.model, self._places
        if not self._settled[i, k, pair] and model is not None and places is not None:
            index = i * len(self.nominal.step) + k
            self._gaps[i, k, pair] = model.contact(places, index, pair).distance
            self._settled[i, k, pair] = True
        return float(self._gaps[i, k, pair])


def _arm_path(nominal: Nominal, index: int, errors: Floats) -> ArmPath:
    """One arm in N layouts (N, 4); errors that repeat are followed once."""
    arm, point, m = nominal.cell.arms[index], nominal.points[index], nominal.poses
    different, which = np.unique(errors, axis=0, return_inverse=True)
    bases = arm.base_in_world(point.position + different[:, :3], point.yaw + different[:, 3])
    joints, arrived = _followed(nominal, index, different, bases)
    q = joints[:, :m]
    excess, turns = arm.limit_excess(q), np.array([unit == "rad" for unit in arm.bounded_units])
    margin, turning = -np.max(excess, axis=(1, 2)), -np.max(excess[..., turns], axis=(1, 2))
    steps = np.abs(np.diff(q, axis=1)[:, nominal.cell.task.joined])
    step = np.min(nominal.cell.step_limits(arm.robot) - np.max(steps, axis=1, initial=0.0), axis=1)
    rows = ArmPath(bases, joints, arrived, margin, step, _conditioning(arm, q), turning)
    return _picked(rows, which.reshape(-1))


def _followed(nominal: Nominal, index: int, errors: Floats, bases: Floats) -> tuple[Floats, Bools]:
    """(N, C, n) joints that take the arm from displaced bases (N, 4, 4) to the same flange poses, and where they do."""
    arm, point, before = nominal.cell.arms[index], nominal.points[index], nominal.joints[index]
    count, places = len(errors), len(before)
    flanges = (inverse(bases)[:, None] @ nominal.flanges[index]).reshape(-1, 4, 4)
    moves = np.einsum("cib,nb->nci", nominal.follow[index], errors)
    expected = before + np.clip(moves, -FARTHEST, FARTHEST)
    start = np.broadcast_to(before, expected.shape)
    q, good = follow(arm.robot, np.eye(4), flanges, start.reshape(-1, arm.dof), expected.reshape(-1, arm.dof))
    form = closed_form(arm.robot)
    if form is not None and point.signs is not None:
        good &= wrong_sides(form, point.signs, q) <= SIDE
    return q.reshape(count, places, arm.dof), good.reshape(count, places)


def _conditioning(arm: Arm, joints: Floats) -> Floats:
    """(N,) what paths (N, m, n) keep beyond the conditioning asked for; infinite where none is."""
    if arm.min_conditioning is None:
        return np.full(len(joints), np.inf)
    length = characteristic_length(arm.robot)
    values = conditioning_of(chain_of(arm.robot), arm.tool, joints.reshape(-1, arm.dof), length)
    least_margin: Floats = np.min(values.reshape(joints.shape[:2]), axis=1) - arm.min_conditioning
    return least_margin


def _picked(path: ArmPath, which: Ints) -> ArmPath:
    return ArmPath(
        path.bases[which],
        path.joints[which],
        path.arrived[which],
        path.margin[which],
        path.step[which],
        path.conditioning[which],
        path.turning[which],
    )
