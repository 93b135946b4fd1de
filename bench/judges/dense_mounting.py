"""What a base is mounted on, read a second time: a ball is lowered from the mounting face until it touches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import coal
import numpy as np

from bench.judges.dense_shapes import coal_shape
from duocell.models.base.arrays import Floats
from duocell.models.catalogue.links import link_bodies
from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm

BELOW, ABOVE = 0.02, 1e-3
"""m below the mounting face within which the carrying surface is met, and m above it where the ball starts."""
BALL, TOUCHING = 1e-9, 1e-7
"""m; radius of the ball, and the distance at which it touches."""
FLUSH = 1e-6
"""m; surfaces that are touched at the same depth carry the arm together."""
FAR = 1e3
"""m below everything."""


def face_depth(cell: Cell, arm: Arm) -> float:
    """m, how far the mounting face is below the base's origin: under the pedestal, or under a base of meshes."""
    brings = cell.surroundings.of(arm.name)
    if brings.pedestal is not None:
        return brings.pedestal.height
    links = link_bodies(arm.robot) if brings.links is None else brings.links
    known = [link.body for link in links if link.link == 0 and link.provenance == "mesh"]
    return -min((lowest(coal_shape(body.shape), body.pose) for body in known), default=0.0)


def is_base(arm: Arm, link: int, shape: Any, pose: Floats, depth: float) -> bool:
    """True for metal of the base: of link 0, or of link 1 and at the mounting face however the first joint turns.

    Args:
        arm: the arm. link: that the metal moves with. shape: Coal's. pose: (4, 4) in the link's frame.
        depth: m, of the mounting face.
    """
    if link != 1:
        return link == 0
    first = arm.robot.joint_placements[0]
    axis = first[:3, :3] @ arm.robot.joint_axes[0]
    return bool(np.hypot(axis[0], axis[1]) < 1e-4 and lowest(shape, first @ pose) + depth < BELOW)


def lowest(shape: Any, pose: Floats) -> float:
    """Smallest z [m] of a Coal geometry."""
    ground = coal.Halfspace(np.array([0.0, 0.0, 1.0]), -FAR)
    return _distance(shape, pose, ground, np.eye(4)) - FAR


def carriers(base: Floats, depth: float, stands: Sequence[tuple[Any, Floats]]) -> set[int]:
    """Numbers of the stands (Coal's geometry, (4, 4) in the world) that carry a base (4, 4)."""
    start = base[:3, 3] - (depth - ABOVE) * base[:3, 2]
    met = {k: way for k, stand in enumerate(stands) if (way := _lowered(start, -base[:3, 2], *stand)) is not None}
    first = min(met.values(), default=0.0)
    return {k for k, way in met.items() if way <= first + FLUSH}


def _lowered(start: Floats, down: Floats, shape: Any, pose: Floats) -> float | None:
    """m that a small ball can go down before it touches a body; None if it starts in it or does not meet it in time."""
    ball, way = coal.Sphere(BALL), 0.0
    for _ in range(10_000):
        place = np.eye(4)
        place[:3, 3] = start + way * down
        gap = _distance(ball, place, shape, pose)
        if gap <= TOUCHING:
            return way if way > 0.0 else None
        way += gap
        if way > ABOVE + BELOW + TOUCHING:
            return None
    return None


def _distance(first: Any, first_pose: Floats, second: Any, second_pose: Floats) -> float:
    placed = (coal.Transform3s(pose[:3, :3], pose[:3, 3]) for pose in (first_pose, second_pose))
    one, other = placed
    return float(coal.distance(first, one, second, other, _REQUEST, coal.DistanceResult()))


def _request() -> Any:
    request = coal.DistanceRequest()
    request.enable_signed_distance = True
    request.gjk_max_iterations = 512
    request.gjk_tolerance = 1e-10
    return request


_REQUEST = _request()
