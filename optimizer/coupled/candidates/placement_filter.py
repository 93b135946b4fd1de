"""Tests of placements of one arm against everything but the other arms: floor, obstacles, part, the arm itself."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.cell.surroundings import PairClass
from duocell.models.kinematics.link_frames import link_frames
from duocell.optimizer.coupled.candidates.contacts import SomePairs
from duocell.optimizer.coupled.candidates.placements import Placements, well_conditioned
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.reduction.reduced import ReducedProblem
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.scene import Scene, world_yaw

FORGIVEN = 0.02
"""m; a violation of no more than this may be repaired by a refinement."""
AT_ONCE = 2_000
"""Configurations looked at in one go: what fits into a cache."""


class PlacementFilter:
    """What one arm violates by itself, whatever the others do."""

    def __init__(self, scene: Scene, index: int, problem: ReducedProblem, closely: bool = False) -> None:
        """Get ready.

        Args:
            scene: of the cell. index: of the arm. problem: its reduced problem, on the poses of the scene's task.
            closely: follow every placement that violates little between the poses too.
        """
        self._closely = closely
        self._scene, self._index, self._problem = scene, index, problem
        self._pairs: SomePairs | None = None
        if scene.model is not None:
            own = pairs_of_arm(scene, index)
            self._pairs = SomePairs.of(scene.model, scene.required, own) if np.any(own) else None
        self._order = telling_order(len(scene.cell.task))

    def violations(self, placements: Placements) -> Floats:
        """(N,) m, the largest shortfall of each placement; where it is beyond `FORGIVEN`, at least that.

        What only Coal can measure counts as kept.
        """
        violations: Floats = np.maximum(self.floor_violations(placements), 0.0)
        violations[~well_conditioned(self._problem, placements)] = np.inf
        if self._pairs is not None:
            left = np.flatnonzero(violations <= FORGIVEN)
            violations[left] = np.maximum(
                violations[left], self._contact_violations(self._pairs, placements.take(left))
            )
        if self._closely:
            for row in np.flatnonzero(violations <= FORGIVEN).tolist():
                check_stop()
                if not check_arm_path(self._scene.cell, self._problem.arm, placements.point(row)).free:
                    violations[row] = np.inf
        return violations

    def floor_violations(self, placements: Placements) -> Floats:
        """(N,) m, by how much the footprints are where they must not be."""
        floor = self._scene.cell.surroundings.floor
        if floor is None or not len(placements):
            return np.zeros(len(placements))
        turned = world_yaw(self._problem.arm, placements.yaws)
        return -floor.signed_distance(placements.positions[:, :2], self._scene.footprints[self._index], turned)

    def _contact_violations(self, pairs: SomePairs, placements: Placements) -> Floats:
        """(N,) m, likewise for distances; poses are looked at one after the other until too much is missing."""
        arm, task = self._problem.arm, self._scene.cell.task
        bases = arm.base_in_world(placements.positions, placements.yaws)
        worst: Floats = np.zeros(len(placements))
        of_mounts: Floats = np.zeros((len(placements), len(pairs.pairs)))
        mounts = pairs.bodies.mounts
        done = 0
        while done < len(self._order):
            check_stop()
            left = np.flatnonzero(worst <= FORGIVEN)
            if not len(left):
                break
            poses = self._order[done : done + (1 if done < 3 else max(3, AT_ONCE // len(left)))]
            done += len(poses)
            for at in range(0, len(left), AT_ONCE):
                some = left[at : at + AT_ONCE]
                violations = pairs.violations(
                    self._frames(pairs, bases[some], placements.joints[some][:, poses], task.poses[poses]),
                    np.tile(task.segment_of[poses], len(some)),
                ).reshape(len(some), len(poses), -1)
                most = violations.max(axis=1)
                of_mounts[some] = np.maximum(of_mounts[some], most * mounts)
                worst[some] = np.maximum(worst[some], np.max(most * ~mounts, axis=1, initial=0.0))
        self._add_mounts(pairs, bases, of_mounts, worst)
        return worst

    def _frames(self, pairs: SomePairs, bases: Floats, joints: Floats, objects: Floats) -> Floats:
        """(N p, F', 4, 4) frames of N placements at p poses."""
        many, poses = joints.shape[:2]
        return arm_frames(self._scene, [self._index], pairs, bases[:, None], [joints], objects).reshape(
            many * poses, -1, 4, 4
        )

    def _add_mounts(self, pairs: SomePairs, bases: Floats, of_mounts: Floats, worst: Floats) -> None:
        """Bring in the violations of base and first link, but for what the arm is mounted on."""
        model = self._scene.model
        short = np.flatnonzero((np.max(of_mounts, axis=1, initial=0.0) > worst) & (worst <= FORGIVEN))
        if model is None or not len(short):
            return
        carried = model.carriers(self._index, bases[short])[:, model.bodies.second[pairs.pairs]]
        worst[short] = np.maximum(worst[short], np.max(of_mounts[short] * ~carried, axis=1, initial=0.0))


def pairs_of_arm(scene: Scene, index: int) -> Bools:
    """(P,) True for the pairs of one arm with itself, obstacles and part."""
    model = scene.model
    if model is None:
        return np.zeros(0, dtype=np.bool_)
    b = model.bodies
    first = np.array([b.owners[i].arm == index for i in b.first], dtype=np.bool_)
    apart = np.array([kind is not PairClass.ARM_ARM for kind in b.kinds], dtype=np.bool_)
    own: Bools = first & apart
    return own


def arm_frames(
    scene: Scene, arms: list[int], pairs: SomePairs, bases: Floats, joints: list[Floats], objects: Floats
) -> Floats:
    """(N, p, F', 4, 4) the frames that some pairs need, for N layouts at p poses.

    Args:
        scene: of the cell. arms: indices. pairs: whose frames are wanted.
        bases: (N, a, 4, 4) in the world. joints: per arm (N, p, n) rad. objects: (p, 4, 4).
    """
    model = scene.model
    if model is None:
        raise AssertionError("pairs without a model")
    many, poses = len(bases), len(objects)
    frames: Floats = np.empty((many, poses, len(pairs.frames), 4, 4))
    fixed = np.flatnonzero(pairs.frames == 0)
    frames[:, :, fixed] = np.eye(4)
    frames[:, :, np.flatnonzero(pairs.frames == 1)] = objects[:, None]
    for a, arm in enumerate(arms):
        first = model.offsets[arm]
        own = np.flatnonzero((pairs.frames >= first) & (pairs.frames < model.offsets[arm + 1]))
        if len(own):
            dof = scene.cell.arms[arm].dof
            links = link_frames(scene.cell.arms[arm].robot, joints[a].reshape(-1, dof))
            links = links[:, pairs.frames[own] - first].reshape(many, poses, len(own), 4, 4)
            frames[:, :, own] = bases[:, a, None, None] @ links
    return frames


def telling_order(poses: int) -> Ints:
    """(m,) the poses in an order in which neighbours come late: first, last, middle, quarters, ..."""
    order, seen = [0, poses - 1], {0, poses - 1}
    parts = 2
    while len(seen) < poses:
        for k in range(1, parts, 2):
            pose = round(k * (poses - 1) / parts)
            if pose not in seen:
                seen.add(pose)
                order.append(pose)
        parts *= 2
    return np.array(order[:poses], dtype=np.int64)
