"""What one arm can do from many base places among obstacles.

That is `bench.searches.own_stands`, the floor, and balls inside of its bodies. Balls only tell what surely collides:
what they pass is looked at again by whoever asks.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from bench.judges.dense_mounting import carriers, face_depth
from bench.judges.dense_rules import floor_gap
from bench.judges.dense_shapes import coal_shape
from bench.judges.inner_balls import Balls, point_distances
from bench.searches.own_stands import own_stands, own_task
from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.catalogue.links import link_bodies
from duocell.models.cell.cell import Cell
from duocell.models.collision.grasp_zone import outside_zones
from duocell.models.geometry.shapes import Body
from duocell.models.kinematics.link_frames import link_frames

BRANCHES, LOOKED_AT = 3, 5
"""Branches of a place that are looked at, cheapest first, and poses at which balls are placed."""
DEEP = 10.0
"""Cost of a metre of collision, in units of `bench.searches.own_stands.OwnTask.scale`."""


@dataclass(frozen=True, eq=False)
class Looks:
    """The cheapest branches (B) of S places.

    Attributes:
        value: (B, S) E, with what is wrong made dear. usable: (B, S) True where nothing is known to be wrong.
        yaw: (B, S) rad. joints: (B, S, m, 6) rad. centres: (B, S, p, n, 3) m, of balls at some poses.
    """

    value: Floats
    usable: Bools
    yaw: Floats
    joints: Floats
    centres: Floats


class ObstructedArm:
    """One arm of a cell.

    Attributes:
        radii: (n,) m, of its balls. scale: a cost that is large.
    """

    def __init__(self, cell: Cell, index: int) -> None:
        """Read what the arm brings."""
        self.cell, self.index, self.arm = cell, index, cell.arms[index]
        self.task = own_task(cell, index)
        self.scale = self.task.scale
        around, brings = cell.surroundings, cell.surroundings.of(self.arm.name)
        links = link_bodies(self.arm.robot) if brings.links is None else brings.links
        flange = self.arm.robot.flange_placement
        bodies = [*(link.body for link in links), *(Body(t.name, flange @ t.pose, t.shape) for t in brings.tool)]
        frames = [*(link.link for link in links), *(self.arm.dof for _ in brings.tool)]
        if brings.pedestal is not None:
            bodies, frames = [brings.pedestal.body, *bodies], [0, *frames]
        self.balls = Balls(bodies, frames)
        self.radii = self.balls.radii
        self.poses = np.unique(np.linspace(0, len(cell.task) - 1, LOOKED_AT).round().astype(int))
        self.depth = face_depth(cell, self.arm)
        self.solids = [(coal_shape(obstacle.shape), obstacle.pose) for obstacle in around.obstacles]
        self.pieces: tuple[Body, ...] = ()
        if around.part is not None and around.clearances.arm_part is not None:
            grasps = np.array([each.grasp[:3, 3] for each in cell.arms])
            self.pieces = outside_zones(around.part.bodies, grasps, around.part.grasp_zone)

    def least(self, places: Floats, yaws: Floats | None) -> Floats:
        """(S,) as `look`'s best value, if nothing were in the way."""
        found = own_stands(self.task, places, yaws)
        value: Floats = np.min(found.objective + 10.0 * found.wrong, axis=0)
        return value

    def look(self, places: Floats, yaws: Floats | None) -> Looks:
        """Places (S, 3) m; yaws (S,) rad if they are given."""
        found = own_stands(self.task, places, yaws)
        value = found.objective + 10.0 * found.wrong
        order = np.argsort(np.where(found.usable, 0.0, 1e9) + value, axis=0)[:BRANCHES]
        value, yaw = np.take_along_axis(value, order, axis=0), np.take_along_axis(found.yaw, order, axis=0)
        usable = np.take_along_axis(found.usable, order, axis=0)
        joints = np.take_along_axis(found.joints, order[..., None, None], axis=0)
        shape = (*value.shape, len(self.poses), len(self.radii), 3)
        centres = np.zeros(shape)
        branch, spot = np.nonzero(usable)
        if len(spot):
            here = self._centres(places[spot], yaw[branch, spot], joints[branch, spot])
            violation = self._violation(places[spot], yaw[branch, spot], here)
            centres[branch, spot] = here
            value[branch, spot] += DEEP * self.scale * violation
            usable[branch, spot] &= violation <= 0.0
        return Looks(value, usable, yaw, joints, centres)

    def _centres(self, places: Floats, yaw: Floats, joints: Floats) -> Floats:
        bases = self.arm.base_in_world(places, yaw)
        made = [self.balls.placed(bases[:, None] @ link_frames(self.arm.robot, joints[:, p])) for p in self.poses]
        return np.stack(made, axis=1)

    def _violation(self, places: Floats, yaw: Floats, centres: Floats) -> Floats:
        """(K,) m, violations of balls and the floor: 0 where none is known."""
        around = self.cell.surroundings
        stands = np.column_stack([places, yaw])
        violation = np.zeros(len(stands))
        if around.clearances.arm_obstacle is not None:
            violation = np.maximum(violation, self._obstructed(stands, centres, around.clearances.arm_obstacle))
        mine = np.flatnonzero(self.balls.frames < self.arm.dof)
        for k, pose in enumerate(self.cell.task.poses[self.poses] if self.pieces else ()):
            inside = (centres[:, k, mine] - pose[:3, 3]) @ pose[:3, :3]
            for piece in self.pieces:
                gaps = np.min(point_distances(piece, inside.copy()) - self.radii[mine], axis=1)
                violation = np.maximum(violation, float(around.clearances.arm_part or 0.0) - gaps)
        if around.floor is not None:
            for row in np.flatnonzero(violation <= 0.0):
                violation[row] = max(-floor_gap(self.cell, self.index, stands[row]), 0.0)
        return violation

    def _obstructed(self, stands: Floats, centres: Floats, required: float) -> Floats:
        bases = self.arm.base_in_world(stands[:, :3], stands[:, 3])
        carried = [carriers(base, self.depth, self.solids) for base in bases]
        base: Ints = np.flatnonzero(self.balls.frames <= 1)
        violation = np.zeros(len(stands))
        for number, obstacle in enumerate(self.cell.surroundings.obstacles):
            gaps = np.min(point_distances(obstacle, centres.copy()) - self.radii, axis=1)
            carries = np.flatnonzero([number in those for those in carried])
            gaps[np.ix_(carries, base)] = np.inf
            violation = np.maximum(violation, required - np.min(gaps, axis=1, initial=np.inf))
        return violation
