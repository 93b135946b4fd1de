"""Ways of a part through a pose: lines, arcs, corners, smooth curves, few scattered poses, and dwelling on them."""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, transform

DWELL = 200, 500
"""Poses of a dwell."""


def way_of(start: Floats, scale: float, rng: np.random.Generator) -> Floats:
    """A random way from a pose.

    Args:
        start: (4, 4) first pose.
        scale: m, about the size of the arm.
        rng: source of chance.

    Returns:
        (m, 4, 4), 3 to 25 poses.
    """
    count = int(rng.integers(3, 26))
    along = np.linspace(0.0, 1.0, count)
    length = scale * rng.uniform(0.1, 0.6)
    across = _unit(rng)
    forms = {
        "line": along[:, None] * across,
        "arc": _arc(along, across, _unit(rng), rng.uniform(0.5, 4.0)),
        "corner": _corner(along, across, _unit(rng)),
        "smooth": _smooth(along, rng),
        "still": 0.0 * along[:, None] * across,
    }
    kind = str(rng.choice(list(forms), p=[0.3, 0.2, 0.2, 0.25, 0.05]))
    turned = rotation_about(_unit(rng), along * rng.choice([0.0, rng.uniform(0.1, 1.5)]))
    return transform(start[:3, :3] @ turned, start[:3, 3] + length * forms[kind])


def dwelling(poses: Floats, rng: np.random.Generator) -> Floats:
    """The same way with a few hundred poses at, or close about, one of its places."""
    at = int(rng.choice([0, len(poses) // 2, len(poses) - 1]))
    held = np.tile(poses[at], (int(rng.integers(*DWELL)), 1, 1))
    if rng.random() < 0.5:
        held[:, :3, 3] += np.cumsum(rng.normal(0.0, 1e-4, (len(held), 3)), axis=0)
        held[:, :3, 3] += np.linspace(0.0, 1.0, len(held))[:, None] * (poses[at, :3, 3] - held[-1, :3, 3])
    return np.concatenate([poses[:at], held, poses[at + 1 :]])


def _unit(rng: np.random.Generator) -> Floats:
    vector = rng.normal(size=3)
    unit: Floats = vector / np.linalg.norm(vector)
    return unit


def _arc(along: Floats, forward: Floats, normal: Floats, angle: float) -> Floats:
    """(m, 3) on a circle of radius 1 / 2 that leaves the origin in direction ``forward``."""
    side = np.cross(normal, forward)
    side /= np.linalg.norm(side)
    turned = angle * along[:, None]
    way: Floats = 0.5 * (np.sin(turned) * forward + (1.0 - np.cos(turned)) * side)
    return way


def _corner(along: Floats, first: Floats, second: Floats) -> Floats:
    way: Floats = np.minimum(along, 0.5)[:, None] * first + np.maximum(along - 0.5, 0.0)[:, None] * second
    return way


def _smooth(along: Floats, rng: np.random.Generator) -> Floats:
    """(m, 3) a sum of a few sine waves."""
    waves = np.arange(1, 4)
    sizes = rng.normal(0.0, 0.3, (3, 3)) / waves[:, None]
    way: Floats = np.sin(np.pi * along[:, None] * waves) @ sizes
    return way
