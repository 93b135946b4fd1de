"""Arms of the catalogue on a linear axis: chains whose first joint shifts the others."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from duocell.models.base.pose import transform
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.reference import mid_range
from duocell.models.robot.joint import JointKind
from duocell.models.robot.robot import Robot


def on_linear_axis(
    robot: str | Robot,
    travel: tuple[float, float] = (-1.0, 1.5),
    axis: tuple[float, float, float] = (1.0, 0.0, 0.0),
    place: np.ndarray | None = None,
) -> Robot:
    """A robot on a linear axis.

    Args:
        robot: what stands on it. travel: m, limits of the axis.
        axis: direction in the frame ``place`` (4, 4) of the base; where the robot stands at 0.
    """
    carried = catalogue.robot(robot) if isinstance(robot, str) else robot
    start = transform(np.eye(3), [0.1, -0.2, 0.3]) if place is None else place
    direction = np.array(axis) / np.linalg.norm(axis)
    return Robot(
        name=f"{carried.name} on a linear axis",
        joint_names=("linear_axis", *carried.joint_names),
        joint_placements=np.concatenate([start[None], carried.joint_placements]),
        joint_axes=np.vstack([direction, carried.joint_axes]),
        flange_placement=carried.flange_placement,
        lower=np.append(travel[0], carried.lower),
        upper=np.append(travel[1], carried.upper),
        reference=np.append(mid_range(*np.array(travel)[:, None]), carried.reference),
        base_frame="track",
        flange_frame=carried.flange_frame,
        flanges=carried.flanges,
        joint_kinds=(JointKind.PRISMATIC, *carried.joint_kinds),
    )


def without_joint(robot: Robot, joint: int) -> Robot:
    """A robot in which one revolute joint is welded at zero."""
    place = robot.joint_placements.copy()
    place[joint + 1] = place[joint] @ place[joint + 1]
    kept = np.delete(np.arange(robot.dof), joint)
    return replace(
        robot,
        joint_names=tuple(robot.joint_names[i] for i in kept),
        joint_placements=place[kept],
        joint_axes=robot.joint_axes[kept],
        lower=robot.lower[kept],
        upper=robot.upper[kept],
        reference=robot.reference[kept],
        joint_kinds=tuple(robot.joint_kinds[i] for i in kept),
    )
