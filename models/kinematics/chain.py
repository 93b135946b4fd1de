"""The chain of a robot at its zero position: joint axes as lines in the base frame."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np

from duocell.models.base.arrays import Bools, Floats, set_frozen
from duocell.models.robot.joint import JointMotions
from duocell.models.robot.robot import Robot

PARALLEL = 1e-7
"""Largest |h × g| of axes that count as parallel: catalogue data are rounded to about 1e-7."""

ON_AXIS = 1e-7
"""m; an axis that misses another by less counts as lying on it: files print angles and lengths with nine digits, and
with fewer they still mean it."""


@dataclass(frozen=True, eq=False)
class Chain:
    """Joint axes at q = 0 in the base frame; the flange is ``Π exp(screw_i q_i) · home``.

    Attributes:
        axes: (n, 3) unit directions h_i.
        points: (n, 3) m, a point on each axis (the joint's own origin).
        home: (4, 4) flange at q = 0.
        prismatic: (n,) True for joints that shift; None: none does.
    """

    axes: Floats
    points: Floats
    home: Floats
    prismatic: Bools | None = None

    def __post_init__(self) -> None:
        set_frozen(self, "axes", self.axes, (None, 3))
        set_frozen(self, "points", self.points, (None, 3))
        set_frozen(self, "home", self.home, (4, 4))

    @cached_property
    def motions(self) -> JointMotions:
        """What the joints do, in base axes."""
        none = np.zeros(len(self.axes), dtype=np.bool_)
        return JointMotions(none if self.prismatic is None else self.prismatic, self.axes)

    @property
    def vertical_sign(self) -> int:
        """σ: +1 or -1 if joint 1 turns about the base's z axis up or down, 0 if its axis is another line, or it shifts.

        Where it is not 0, a base yaw only shifts joint 1: ``q1 = q1(yaw = 0) - σ · yaw``.
        """
        if self.motions.prismatic[0]:
            return 0
        off_axis = np.hypot(*self.points[0, :2]) > ON_AXIS or np.hypot(*self.axes[0, :2]) > PARALLEL
        return 0 if off_axis else int(np.sign(self.axes[0, 2]))


@lru_cache(maxsize=256)
def chain_of(robot: Robot) -> Chain:
    """The chain of ``robot`` at its zero position (cached)."""
    axes, points = [], []
    frame = np.eye(4)
    for placement, axis in zip(robot.joint_placements, robot.joint_axes, strict=True):
        frame = frame @ placement
        axes.append(frame[:3, :3] @ axis)
        points.append(frame[:3, 3])
    return Chain(np.array(axes), np.array(points), frame @ robot.flange_placement, robot.prismatic)


def parallel(first: Floats, second: Floats) -> bool:
    """True if two unit directions (3,) are parallel or antiparallel."""
    return float(np.linalg.norm(np.cross(first, second))) < PARALLEL


def meeting_point(lines: list[tuple[Floats, Floats]], tolerance: float) -> Floats | None:
    """The point where lines (point, unit direction) meet, or None if one misses it by more than ``tolerance`` m."""
    projectors = [np.eye(3) - np.outer(h, h) for _, h in lines]
    normal = np.sum(projectors, axis=0)
    if np.linalg.cond(normal) > 1e8:
        return None
    point: Floats = np.linalg.solve(
        normal, np.sum([a @ p for a, (p, _) in zip(projectors, lines, strict=True)], axis=0)
    )
    misses = [float(np.linalg.norm(a @ (point - p))) for a, (p, _) in zip(projectors, lines, strict=True)]
    return point if max(misses) < tolerance else None
