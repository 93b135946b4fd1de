"""Stands of one arm by the thousand, as arrays: a dense net of bases in every posture, without what surely collides."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from models.arm import TURN
from models.arrays import Bools, Floats, Ints, Singles
from models.link_frames import link_frames
from models.posture import ALL_SIGNS
from optimizer.box import search_box, spread
from optimizer.coupled.inner_balls import ArmBalls
from optimizer.coupled.pool import alone_scene, own_lacks
from optimizer.coupled.scene import Scene, world_yaw
from optimizer.program import ArmPoint
from optimizer.reduced import ReducedProblem, conditioning_shortfall, evaluate
from optimizer.watch import check_stop

POINTS = {0: 1, 1: 300, 2: 4000, 3: 8000}
"""Base positions by number of free coordinates; each has eight postures."""
CHUNK = 512
"""Bases evaluated, or stands placed, in one go."""
LOOKED_AT = 7
"""Poses at which balls are placed."""
FORGIVEN = 0.02
"""m; what lacks no more than this may be repaired by a refinement."""


@dataclass(frozen=True, eq=False, slots=True)
class Stands:
    """Stands of one arm.

    Attributes:
        positions: (N, 3) m. yaws: (N,) rad. joints: (N, m, 6) rad. signs: (N, 3) postures. objective: (N,) E.
        turns: (N, 2) rad, by how much the base may be turned under the arm at least and at most.
        balls: (p, N, n, 3) m, centres of the arm's balls at some poses.
    """

    positions: Floats
    yaws: Floats
    joints: Floats
    signs: Ints
    objective: Floats
    turns: Floats
    balls: Singles

    def __len__(self) -> int:
        return len(self.positions)

    @property
    def bases(self) -> Floats:
        """(4, N) x, y, z and yaw."""
        return np.vstack([self.positions.T, self.yaws])

    def take(self, rows: Ints | Bools) -> Stands:
        """Some of them."""
        return Stands(
            self.positions[rows],
            self.yaws[rows],
            self.joints[rows],
            self.signs[rows],
            self.objective[rows],
            self.turns[rows],
            self.balls[:, rows],
        )

    @staticmethod
    def joined(parts: Sequence[Stands]) -> Stands:
        """All in one."""
        return Stands(
            np.concatenate([part.positions for part in parts]),
            np.concatenate([part.yaws for part in parts]),
            np.concatenate([part.joints for part in parts]),
            np.concatenate([part.signs for part in parts]),
            np.concatenate([part.objective for part in parts]),
            np.concatenate([part.turns for part in parts]),
            np.concatenate([part.balls for part in parts], axis=1),
        )

    def point(self, row: int) -> ArmPoint:
        """One of them."""
        a, b, c = map(int, self.signs[row])
        return ArmPoint(self.positions[row], float(self.yaws[row]), self.joints[row], (a, b, c))

    def turned(self, problem: ReducedProblem, by: Floats) -> Stands:
        """All with their bases turned by (N,) rad, within ``turns``, under arms that stay where they are."""
        arm, joints = problem.arm, self.joints.copy()
        joints[:, :, 0] -= problem.sigma * by[:, None]
        weights = np.ones(joints.shape[1]) if problem.weights is None else problem.weights
        before, after = ((q[:, :, 0] - arm.reference[0]) ** 2 @ weights for q in (self.joints, joints))
        yaws = self.yaws + by
        if arm.base.yaw_free:
            yaws = (yaws + 0.5 * TURN) % TURN - 0.5 * TURN
        cost = self.objective + arm.weights[0] * (after - before)
        return replace(self, yaws=yaws, joints=joints, objective=cost, turns=self.turns - by[:, None])


@dataclass(frozen=True, eq=False, slots=True)
class Sieve:
    """What throws out stands of one arm, whatever the others do.

    Attributes:
        scene: the cell. index: of the arm. problem: its reduced problem. balls: its own.
        poses: at which it is looked at. alone: the scene of the arm. judged: lacks of stands looked at closely.
    """

    scene: Scene
    index: int
    problem: ReducedProblem
    balls: ArmBalls | None
    poses: Ints
    alone: Scene
    judged: dict[tuple[float, ...], float]

    @staticmethod
    def of(scene: Scene, index: int, problem: ReducedProblem) -> Sieve:
        """The sieve of one arm of a cell."""
        poses = np.unique(np.linspace(0, len(scene.cell.task) - 1, LOOKED_AT).round().astype(np.int64))
        balls = None if scene.model is None else ArmBalls.of(scene.model, index, scene.required)
        return Sieve(scene, index, problem, balls, poses, alone_scene(scene.cell, problem.arm), {})

    def net(self, seed: int) -> tuple[Stands, float, int]:
        """What passes, of a net over all bases, best first.

        Returns:
            Stands, about how far [m] neighbouring bases are apart, and how many bases and postures were looked at.
        """
        box = search_box(self.scene.cell, self.problem.arm)
        width = (box[:, 1] - box[:, 0])[box[:, 1] > box[:, 0]]
        positions = spread(box, POINTS[len(width)], seed)
        spacing = float(np.prod(width) / len(positions)) ** (1.0 / len(width)) if len(width) else 0.0
        found = [self.stands(positions[at : at + CHUNK]) for at in range(0, len(positions), CHUNK)]
        every = Stands.joined(found)
        order = np.argsort(every.objective, kind="stable")
        return every.take(order), spacing, len(positions) * int(np.sum(self.problem.postures))

    def stands(self, positions: Floats) -> Stands:
        """What passes, of all postures at (N, 3) m."""
        check_stop()
        paths = evaluate(self.problem, positions)
        k, i = np.nonzero(paths.violation == 0.0)
        joints = paths.joints[:, k, i].transpose(1, 2, 0)
        return self.sifted(positions[i], paths.yaw[k, i], joints, _SIGNS[k], paths.objective[k, i])[0]

    def sifted(
        self, positions: Floats, yaws: Floats, joints: Floats, signs: Ints, objective: Floats
    ) -> tuple[Stands, Ints]:
        """Those of some usable paths that stand on the floor, do not surely collide, and keep their conditioning.

        Returns:
            Stands, and their numbers among those given.
        """
        keep = np.flatnonzero(self.passes(positions, yaws))
        balls, clear = self._placed(positions[keep], yaws[keep], joints[keep])
        keep, balls = keep[clear], balls[:, clear]
        if self.problem.arm.min_conditioning is not None and len(keep):
            good = conditioning_shortfall(self.problem, joints[keep].transpose(2, 0, 1)) <= 0.0
            keep, balls = keep[good], balls[:, good]
        turns = self._turns(joints[keep], yaws[keep])
        return Stands(positions[keep], yaws[keep], joints[keep], signs[keep], objective[keep], turns, balls), keep

    def own_lacks(self, stands: Stands) -> Floats:
        """(N,) m, largest shortfall of floor and distances at the poses, as far as the arm alone is concerned."""
        keys = [tuple(key) for key in np.hstack([stands.positions, stands.yaws[:, None], stands.signs]).tolist()]
        new = list({key: row for row, key in enumerate(keys) if key not in self.judged}.values())
        found = own_lacks(self.alone, [stands.point(row) for row in new])
        self.judged.update({keys[row]: lack for row, lack in zip(new, found, strict=True)})
        return np.array([self.judged[key] for key in keys], dtype=np.float64)

    def passes(self, positions: Floats, yaws: Floats) -> Bools:
        """(N,) False where the floor is missed by more than can be repaired."""
        floor = self.scene.cell.surroundings.floor
        if floor is None or not len(positions):
            return np.ones(len(positions), dtype=np.bool_)
        turned = world_yaw(self.problem.arm, yaws)
        return floor.signed_distance(positions[:, :2], self.scene.footprints[self.index], turned) >= -FORGIVEN

    def _placed(self, positions: Floats, yaws: Floats, joints: Floats) -> tuple[Singles, Bools]:
        """(p, N, n, 3) balls in the world, and (N,) False for stands that surely collide (their balls are not set)."""
        clear: Bools = np.ones(len(positions), dtype=np.bool_)
        if self.balls is None:
            return np.zeros((0, len(positions), 0, 3), dtype=np.float32), clear
        arm, task = self.problem.arm, self.scene.cell.task
        bases = arm.base_in_world(positions, yaws)
        model = self.scene.model
        carriers = np.zeros((len(bases), 0), dtype=np.bool_) if model is None else model.carriers(self.index, bases)
        placed: Singles = np.zeros((len(self.poses), len(positions), len(self.balls.radii), 3), dtype=np.float32)
        for number, pose in enumerate(self.poses):
            left = np.flatnonzero(clear)
            if not len(left):
                break
            links = bases[left, None] @ link_frames(arm.robot, joints[left, pose])
            here = self.balls.placed(links)
            placed[number, left] = here
            lacks = self.balls.lacks(here, carriers[left], task.poses[pose], int(task.job_of[pose]))
            clear[left] = lacks <= FORGIVEN
        return placed, clear

    def _turns(self, joints: Floats, yaws: Floats) -> Floats:
        """(N, 2) rad, how far bases may turn under their arms without leaving limits or region."""
        arm = self.problem.arm
        first = self.problem.sigma * joints[:, :, 0]
        low, high = sorted((self.problem.sigma * arm.lower[0], self.problem.sigma * arm.upper[0]))
        least, most = first.max(axis=1) - high, first.min(axis=1) - low
        if not arm.base.yaw_free:
            least = np.maximum(least, arm.base.yaw.low - yaws)
            most = np.minimum(most, arm.base.yaw.high - yaws)
        return np.stack([np.minimum(least, 0.0), np.maximum(most, 0.0)], axis=-1)


_SIGNS: Ints = np.array(ALL_SIGNS, dtype=np.int64)
