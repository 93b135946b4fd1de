"""The source's own inverse kinematics of its PUMA (digest, section 1), kept apart from the project's derivation."""

from __future__ import annotations

from math import atan2, cos, pi, sin, sqrt

import numpy as np

from duocell.models.base.arrays import Floats

A2, A3, D2, D4, D6 = 0.4318, -0.0203, 0.1491, 0.4331, 0.0563
ALPHAS = (-pi / 2, 0.0, pi / 2, -pi / 2, pi / 2, 0.0)
LINKS = ((0.0, 0.0), (A2, D2), (A3, 0.0), (0.0, D4), (0.0, 0.0), (0.0, D6))


def frame(joint: int, theta: float) -> Floats:
    """A_i = Trans(z, d) Rot(z, θ) Trans(x, a) Rot(x, α), joints counted from 0."""
    (a, d), c, s = LINKS[joint], cos(theta), sin(theta)
    ca, sa = cos(ALPHAS[joint]), sin(ALPHAS[joint])
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def solve(pose: Floats, s: int, e: int, f: int) -> Floats | None:
    """Joint values (6,) of shoulder s (+1 left), elbow e (+1 down) and wrist f (+1: θ5 > 0), or None."""
    wrist = pose[:3, 3] - D6 * pose[:3, 2]
    beside = wrist[0] ** 2 + wrist[1] ** 2 - D2**2
    xi = (wrist @ wrist - A2**2 - A3**2 - D2**2 - D4**2) / (2.0 * A2)
    inside = A3**2 + D4**2 - xi**2
    if beside < 0.0 or inside < 0.0:
        return None
    rho = sqrt(beside)
    first = atan2(s * wrist[1] * rho - D2 * wrist[0], s * wrist[0] * rho + D2 * wrist[1])
    third = atan2(D4, A3) + atan2(-s * e * sqrt(inside), xi)
    ahead = cos(first) * wrist[0] + sin(first) * wrist[1]
    along, across = A2 + A3 * cos(third) + D4 * sin(third), A3 * sin(third) - D4 * cos(third)
    second = atan2(-wrist[2], ahead) - atan2(across, along)
    turned = (frame(0, first) @ frame(1, second) @ frame(2, third))[:3, :3].T @ pose[:3, :3]
    fifth = atan2(f * sqrt(turned[0, 2] ** 2 + turned[1, 2] ** 2), turned[2, 2])
    fourth = atan2(f * turned[1, 2], f * turned[0, 2])
    sixth = atan2(f * turned[2, 1], -f * turned[2, 0])
    return np.array([first, second, third, fourth, fifth, sixth])
