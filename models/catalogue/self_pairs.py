"""Which bodies of one arm may hit each other.

Bodies of the same or of neighbouring links always touch. Others that overlap at a good part of all postures, or at the
reference, overlap because capsules are fatter than the arm: an arm that hit itself so easily would be of no use.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.base.sampling import even_points
from duocell.models.geometry.bounding import Bounding, exact_box_distances, segment_distances
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.robot import Robot

SAMPLES = 128
OFTEN = 0.2
"""Share of the sampled postures at which a pair may overlap and still count."""


def self_pairs(
    robot: Robot, links: Sequence[int], bodies: Sequence[Body], bounds: Sequence[Bounding], lower: Floats, upper: Floats
) -> list[tuple[int, int]]:
    """Pairs of indices of bodies to keep apart.

    Args:
        robot: the arm.
        links: link of each body; tools belong to the last link, a pedestal to link 0.
        bodies: in their link's frame. bounds: of their shapes.
        lower: (n,) rad, limits in force; joints without end are sampled over one turn. upper: likewise.

    Returns:
        Pairs (i, j), i < j, at least two links apart; the same ones every time.
    """
    candidates = [(i, j) for j in range(len(bodies)) for i in range(j) if abs(links[i] - links[j]) > 1]
    if not candidates:
        return []
    frames = link_frames(robot, _postures(robot, lower, upper))
    poses = np.stack([frames[:, link] @ body.pose for link, body in zip(links, bodies, strict=True)], axis=1)
    ends = np.stack([b.ends for b in bounds]) @ poses[..., :3, :3].swapaxes(-1, -2) + poses[..., None, :3, 3]
    first, second = np.array(candidates).T
    reach = np.array([b.radius for b in bounds])
    overlaps = segment_distances(ends[:, first], ends[:, second]) < reach[first] + reach[second]
    pairs = []
    for (i, j), near in zip(candidates, overlaps.T, strict=True):
        for thin, box in ((i, j), (j, i)):
            if not bounds[box].exact:
                _clear_beside(near, ends[:, thin], bounds[thin].radius, poses[:, box], bounds[box])
        round_ones = bounds[i].exact + bounds[j].exact
        boxes = isinstance(bodies[i].shape, Box) + isinstance(bodies[j].shape, Box)
        if round_ones == 0 or round_ones + boxes < 2:  # else it is known exactly
            _look_closely(near, poses[:, i], poses[:, j], bodies[i], bodies[j])
        if not near[0] and np.mean(near) <= OFTEN:
            pairs.append((i, j))
    return pairs


def _clear_beside(near: Bools, ends: Floats, radius: float, boxes: Floats, bound: Bounding) -> None:
    """Clear ``near`` (K,) where capsules (K, 2, 3) do not reach the bounding box of another body at poses (K, 4, 4)."""
    k = np.flatnonzero(near)
    inside = (ends[k] - boxes[k, None, :3, 3]) @ boxes[k, :3, :3]
    near[k] = exact_box_distances(inside - bound.centre, bound.half) <= radius


def _look_closely(near: Bools, first_poses: Floats, second_poses: Floats, first: Body, second: Body) -> None:
    """Clear ``near`` (K,) where bodies do not touch, until it is known whether their pair counts."""
    touching = 0
    for k in np.flatnonzero(near):
        near[k] = separation(first.shape, first_poses[k], second.shape, second_poses[k]).distance < 0.0
        touching += int(near[k])
        if near[0] or touching > OFTEN * len(near):
            return


def _postures(robot: Robot, lower: Floats, upper: Floats) -> Floats:
    """(K, n) the reference and postures spread evenly over the limits."""
    low = np.where(np.isfinite(lower), lower, -np.pi)
    high = np.where(np.isfinite(upper), upper, np.pi)
    spread = low + (high - low) * even_points(robot.dof, SAMPLES, seed=0)
    return np.vstack([robot.reference, spread])
