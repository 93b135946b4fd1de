"""All stands of one arm on a lattice that do its task, without what surely collides."""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, inf, pi, sin

import numpy as np

from bench.judges.dense_mounting import carriers, face_depth
from bench.judges.dense_rules import floor_gap
from bench.judges.dense_shapes import coal_shape
from bench.judges.inner_balls import Balls, point_distances
from duocell.models.base.arrays import Bools, Floats
from duocell.models.catalogue.links import link_bodies
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Direction, Mirror, Rail
from duocell.models.collision.grasp_zone import outside_zones
from duocell.models.geometry.shapes import Body
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.arm import TURN, Arm
from duocell.optimizer.reduction.reduced import evaluate, reduced_problem

AT_ONCE = 512
"""Base positions evaluated in one go."""
HEIGHTS = 3
"""Levels where a base may choose its height."""
LOOKED_AT = 7
"""Poses at which balls are placed."""


Singles = np.ndarray[tuple[int, ...], np.dtype[np.float32]]


@dataclass(frozen=True, eq=False)
class Lattice:
    """Square lattice: origin (2,) m, direction of its first axis rad, step m."""

    origin: tuple[float, float]
    angle: float
    step: float

    def points(self, arm: Arm) -> Floats:
        """(k, 3) lattice points in the region of an arm, at all its heights."""
        x, y, z = arm.base.x, arm.base.y, arm.base.z
        corners = np.array([[u, v] for u in (x.low, x.high) for v in (y.low, y.high)]) - self.origin
        axes = np.array([[cos(self.angle), sin(self.angle)], [-sin(self.angle), cos(self.angle)]])
        spans = corners @ axes.T / self.step
        low, high = np.floor(spans.min(axis=0)), np.ceil(spans.max(axis=0))
        first, second = (np.arange(low[k], high[k] + 1) for k in range(2))
        grid = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
        flat = np.array(self.origin) + self.step * grid @ axes
        keep = (flat[:, 0] >= x.low) & (flat[:, 0] <= x.high) & (flat[:, 1] >= y.low) & (flat[:, 1] <= y.high)
        levels = np.array([z.low]) if z.fixed else np.linspace(z.low, z.high, HEIGHTS)
        return np.array([[*point, level] for level in levels for point in flat[keep]]).reshape(-1, 3)


def lattice_of(cell: Cell, step: float) -> Lattice:
    """A lattice on which rails, directions and mirrors of the cell fall."""
    for tie in cell.couplings:
        if isinstance(tie, Mirror):
            return Lattice(tie.point, tie.angle, step)
        if isinstance(tie, Rail):
            return Lattice(tie.point or (0.0, 0.0), tie.angle, step)
        if isinstance(tie, Direction):
            return Lattice((0.0, 0.0), tie.angle, step)
    return Lattice((cell.arms[0].base.x.low, cell.arms[0].base.y.low), 0.0, step)


@dataclass(frozen=True, eq=False)
class Stands:
    """Candidates of one arm, best first.

    Attributes:
        stands: (K, 4) x, y, z, yaw. joints: (K, m, 6) rad. objective: (K,) E of the arm.
        yaws: (K, 2) rad, within which the base may turn under the arm without leaving limits or region.
        balls: (p, K, n, 3) float32, centres of balls at some poses. radii: (n,).
        tried: lattice points. working: point and posture pairs that do the task.
    """

    stands: Floats
    joints: Floats
    objective: Floats
    yaws: Floats
    balls: Singles
    radii: Floats
    tried: int
    working: int

    def __len__(self) -> int:
        return len(self.stands)


def stands_of(cell: Cell, index: int, lattice: Lattice) -> Stands:
    """Stands of one arm on the lattice: every posture, the best yaw of each, nothing that surely collides."""
    arm = cell.arms[index]
    problem = reduced_problem(cell, arm)
    if problem is None:
        raise ValueError(f"{arm.robot.name} has no closed form: it is not searched exhaustively")
    points = lattice.points(arm)
    stands, joints, objective = [], [], []
    for start in range(0, len(points), AT_ONCE):
        some = points[start : start + AT_ONCE]
        found = evaluate(problem, some)
        posture, spot = np.nonzero(found.violation == 0.0)
        stands.append(np.column_stack([some[spot], found.yaw[posture, spot]]))
        joints.append(found.joints[:, posture, spot].transpose(1, 2, 0))
        objective.append(found.objective[posture, spot])
    count = len(cell.task)
    every = np.concatenate([*stands, np.empty((0, 4))])
    q = np.concatenate([*joints, np.empty((0, count, arm.dof))])
    cost = np.concatenate([*objective, np.empty(0)])
    working = len(every)
    order = np.argsort(cost, kind="stable")
    every, q, cost = every[order], q[order], cost[order]
    yaws = np.array([_yaws(arm, s[3], path[:, 0], problem.sigma) for s, path in zip(every, q, strict=True)])
    yaws = yaws.reshape(-1, 2)
    if not any(isinstance(tie, Mirror) for tie in cell.couplings):  # which may turn the base
        free = np.array([floor_gap(cell, index, stand) >= 0.0 for stand in every], dtype=np.bool_)
        every, q, cost, yaws = every[free], q[free], cost[free], yaws[free]
    keep, balls, radii = _free(cell, index, every, q)
    return Stands(every[keep], q[keep], cost[keep], yaws[keep], balls[:, keep], radii, len(points), working)


def _yaws(arm: Arm, yaw: float, first: Floats, sigma: int) -> tuple[float, float]:
    """Interval of yaws about ``yaw`` for which joint 1 (its path: (m,) rad), turned back, stays inside its limits."""
    low, high = arm.lower[0] - first.min(), arm.upper[0] - first.max()
    ends = sorted([yaw - sigma * low, yaw - sigma * high])
    if arm.base.yaw_free:
        return ends[0], ends[1]
    shift = TURN * round((yaw - arm.base.yaw.middle) / TURN)
    return max(ends[0], arm.base.yaw.low + shift), min(ends[1], arm.base.yaw.high + shift)


def _free(cell: Cell, index: int, stands: Floats, joints: Floats) -> tuple[Bools, Singles, Floats]:
    """Which stands do not surely collide with obstacles or the part, and the balls of the arm in the world."""
    arm, around = cell.arms[index], cell.surroundings
    brings = around.of(arm.name)
    links = link_bodies(arm.robot) if brings.links is None else brings.links
    flange = arm.robot.flange_placement
    bodies = [*(link.body for link in links), *(Body(t.name, flange @ t.pose, t.shape) for t in brings.tool)]
    frames = [*(link.link for link in links), *(arm.dof for _ in brings.tool)]
    if brings.pedestal is not None:
        bodies, frames = [brings.pedestal.body, *bodies], [0, *frames]
    balls = Balls(bodies, frames)
    poses = np.unique(np.linspace(0, len(cell.task) - 1, LOOKED_AT).round().astype(int))
    bases = arm.base_in_world(stands[:, :3], stands[:, 3])
    keep: Bools = np.ones(len(stands), dtype=np.bool_)
    placed: Singles = np.empty((len(poses), len(stands), len(balls.radii), 3), dtype=np.float32)
    depth = face_depth(cell, arm)
    solids = [(coal_shape(obstacle.shape), obstacle.pose) for obstacle in around.obstacles]
    carried = [carriers(base, depth, solids) for base in bases]
    pieces: tuple[Body, ...] = ()
    if around.part is not None:
        grasps = np.array([each.grasp[:3, 3] for each in cell.arms])
        pieces = outside_zones(around.part.bodies, grasps, around.part.grasp_zone)
    for k, pose in enumerate(poses):
        here = balls.placed(bases[:, None] @ link_frames(arm.robot, joints[:, pose]))
        placed[k] = here
        if around.clearances.arm_obstacle is not None:
            for number, obstacle in enumerate(around.obstacles):
                carries = np.array([number in those for those in carried], dtype=np.bool_)
                gaps = point_distances(obstacle, here) - balls.radii
                gaps[carries[:, None] & (balls.frames <= 1)] = inf
                keep &= np.min(gaps, axis=1, initial=inf) >= around.clearances.arm_obstacle
        if around.clearances.arm_part is not None:
            held = cell.task.poses[pose]
            inside = (here - held[:3, 3]) @ held[:3, :3]
            for piece in pieces:
                gaps = point_distances(piece, inside[:, balls.frames < arm.dof]) - balls.radii[balls.frames < arm.dof]
                keep &= np.min(gaps, axis=1, initial=inf) >= around.clearances.arm_part
    return keep, placed, balls.radii


def turned(arm: Arm, stand: Floats, joints: Floats, yaw: float) -> tuple[Floats, Floats]:
    """The base turned to ``yaw`` under an arm that stays where it is."""
    first = arm.robot.joint_placements[0]
    sense = round(float(first[2, :3] @ arm.robot.joint_axes[0]))
    moved = joints.copy()
    moved[:, 0] -= sense * (yaw - stand[3])
    wrapped = yaw if not arm.base.yaw_free else (yaw + pi) % TURN - pi
    return np.array([*stand[:3], wrapped]), moved
