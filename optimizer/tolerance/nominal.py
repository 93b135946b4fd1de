"""A layout made ready to be displaced: where it is looked at, and how its joints follow."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import path_signs
from duocell.models.kinematics.closed_form import closed_form
from duocell.optimizer.clearance.path_samples import flanges_at, follow
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.findings import Clearance
from duocell.optimizer.results.placement import Placement
from duocell.optimizer.sqp.sensitivity import joints_by_base
from duocell.optimizer.verification.scene import Scene


@dataclass(frozen=True, eq=False, slots=True)
class Nominal:
    """A layout as it should be, at C places of its path: the m poses, then where the path comes nearest to something.

    Attributes:
        scene: the cell; its model knows what the arms are bolted to.
        points: one per arm, with the posture that is to be kept. bases: (A, 4, 4) in the world.
        step: (C,) index of the pose before. fraction: (C,) of the way to the next one.
        objects: (C, 4, 4) in the world. flanges: per arm (C, 4, 4) likewise.
        joints: per arm (C, n) rad. follow: per arm (C, n, 4) their derivative by x, y, z and yaw of the base.
        gaps: (C, P) m, lower bounds of the distances; infinite where the bases do not matter.
    """

    scene: Scene
    points: tuple[ArmSolution, ...]
    bases: Floats
    step: Ints
    fraction: Floats
    objects: Floats
    flanges: tuple[Floats, ...]
    joints: tuple[Floats, ...]
    follow: tuple[Floats, ...]
    gaps: Floats

    @property
    def cell(self) -> Cell:
        """The cell."""
        return self.scene.cell

    @property
    def segments(self) -> Ints:
        """(C,) the segment of the task that each place belongs to."""
        return self.cell.task.segment_of[self.step]

    @property
    def poses(self) -> int:
        """m; the first so many places are the poses."""
        return len(self.cell.task)

    @staticmethod
    def of(cell: Cell, placements: Sequence[Placement], clearances: Sequence[Clearance]) -> Nominal:
        """Prepare a layout.

        Args:
            cell: the cell. placements: one per arm, in order.
            clearances: of the layout; they say where between the poses to look.
        """
        points = tuple(_point(cell, index, placement) for index, placement in enumerate(placements))
        scene = Scene.of(cell)
        bases = scene.bases(points)
        if scene.model is not None:
            scene = replace(scene, model=scene.model.bolted(bases))
        between = [(c.pose, c.fraction) for c in clearances if 0.0 < c.fraction < 1.0]
        m = len(cell.task)
        step = np.concatenate([np.arange(m), np.array([pose for pose, _ in between], dtype=np.int64)])
        fraction = np.concatenate([np.zeros(m), [share for _, share in between]])
        objects = np.concatenate([cell.task.poses, scene.path.at(step[m:], fraction[m:])])
        flanges, joints, good = [], [], np.ones(len(step), dtype=np.bool_)
        for arm, base, point in zip(cell.arms, bases, points, strict=True):
            on_the_way = flanges_at(cell, arm, objects[m:], step[m:], fraction[m:])
            flanges.append(np.concatenate([cell.flange_targets(arm), on_the_way]))
            share = fraction[m:, None]
            near = (1.0 - share) * point.joints[step[m:]] + share * point.joints[np.minimum(step[m:] + 1, m - 1)]
            found, arrived = follow(arm.robot, base, flanges[-1][m:], near, near)
            joints.append(np.concatenate([point.joints, found]))
            good[m:] &= arrived
        joints = [q[good] for q in joints]
        gaps = np.zeros((int(np.sum(good)), 0))
        if scene.model is not None:
            here = scene.model.configure(bases, joints, objects[good], cell.task.segment_of[step[good]])
            gaps = scene.model.bounds(here, scene.movable)
        return Nominal(
            scene,
            points,
            bases,
            step[good],
            fraction[good],
            objects[good],
            tuple(flange[good] for flange in flanges),
            tuple(joints),
            tuple(joints_by_base(a.robot, b[:3, :3], q) for a, b, q in zip(cell.arms, bases, joints, strict=True)),
            gaps,
        )


def _point(cell: Cell, index: int, placement: Placement) -> ArmSolution:
    form = closed_form(cell.arms[index].robot)
    signs = None if form is None else path_signs(form, placement.joints)
    return ArmSolution(placement.position, placement.yaw, placement.joints, signs)
