"""Closed-form inverse kinematics, vectorised, for the two common classes of six-joint arms.

- spherical wrist: axes 2 and 3 parallel, axes 4, 5 and 6 through one point;
- three parallel axes: axes 2, 3 and 4 parallel, axes 5 and 6 through one point.

Both are solved in the same geometric order. With n the common direction of the parallel axes and W the point where
the last axes meet, the component of W along n does not depend on joints 2 and 3 (and 4), which gives two values of
joint 1 (shoulder). A planar two-link triangle gives two values of joint 3 (elbow) and one of joint 2. The wrist
orientation gives two values of joint 5 (wrist). Derived from the screw axes, so any zero position and any axis
directions will do; the idea of the decomposition is Pieper's (1968).

Unreachable poses are not dropped: the triangle is stretched to the nearest possible one and the missing length is
returned, so that a search can see how far away it is.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Literal

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.kinematics.chain import Chain, chain_of, meeting_point, parallel
from duocell.models.robot.robot import Robot

MEETING_TOLERANCE = 1e-7
"""m; axes closer than this meet."""
BRANCHES = 8
"""Order of the branches: `duocell.models.robot.posture.ALL_SIGNS`."""


@dataclass(frozen=True, slots=True)
class Planar:
    """The two-link triangle of an arm, in the plane normal to n at q1 = 0.

    Plane coordinates are (forward, up'), forward = n x h1 and up' completing (forward, n, up') like (x, y, z):
    a positive turn about n takes up' to forward.

    Attributes:
        shoulder: (2,) m, axis 2 relative to the origin on axis 1.
        upper: m, axis 2 to axis 3. fore: m, axis 3 to the end of the triangle.
        upper_angle: rad, direction of the upper arm at q = 0, measured from up' towards forward.
        elbow_angle: rad, turn from upper arm to forearm at q = 0 (same sense).
        hand: (2,) m, from the end of the triangle to W at q = 0; zero for spherical wrists.
    """

    shoulder: Floats
    upper: float
    fore: float
    upper_angle: float
    elbow_angle: float
    hand: Floats


@dataclass(frozen=True, eq=False, slots=True)
class ClosedForm:
    """Constants of the closed form of one robot; see the module's text for the symbols.

    Attributes:
        kind: class of the arm.
        axes: (6, 3) screw axes at q = 0.
        origin: (3,) m, point on axis 1 from which everything is measured (the base origin's projection on axis 1).
        n: (3,) unit, common direction of the parallel axes at q1 = 0, oriented so that ``offset >= 0``.
        forward: (3,) unit, n x h1 normalised. up: (3,) unit.
        turns: (6,) sense of the parallel axes about n: +1 or -1 (+1 for the other joints).
        offset: m, component of W along n.
        planar: the triangle.
        wrist_in_flange: (3,) m, W in the flange frame.
        home_rotation: (3, 3) flange orientation at q = 0.
        wrist_zero: rad, the value of joint 5 at which axes 4 and 6 (or n and 6) align; sin(q5 - wrist_zero) has the
            sign of the wrist.
        tilt_cos, tilt_sin: cos and product of sines in ``a·Rot(h5, q5) h6 = tilt_cos + tilt_sin cos(q5 - zero)``.
        flipped_zero: True where ``wrist_zero`` is the antiparallel alignment.
    """

    kind: Literal["spherical-wrist", "three-parallel"]
    axes: Floats
    origin: Floats
    n: Floats
    forward: Floats
    up: Floats
    turns: Floats
    offset: float
    planar: Planar
    wrist_in_flange: Floats
    home_rotation: Floats
    wrist_zero: float
    tilt_cos: float
    tilt_sin: float
    flipped_zero: bool


@lru_cache(maxsize=256)
def closed_form(robot: Robot) -> ClosedForm | None:
    """The closed form of ``robot``, or None if it belongs to neither class."""
    if robot.dof != 6 or robot.slides:
        return None
    chain = chain_of(robot)
    h = chain.axes
    if not parallel(h[1], h[2]) or parallel(h[0], h[1]):
        return None
    lines = [(chain.points[i], h[i]) for i in range(6)]
    if parallel(h[2], h[3]):
        kind: Literal["spherical-wrist", "three-parallel"] = "three-parallel"
        wrist = meeting_point(lines[4:], MEETING_TOLERANCE)
    else:
        kind = "spherical-wrist"
        wrist = meeting_point(lines[3:], MEETING_TOLERANCE)
    if wrist is None or parallel(h[4], h[5]) or (kind == "spherical-wrist" and parallel(h[3], h[4])):
        return None
    return _constants(robot, chain, kind, wrist)


def _constants(
    robot: Robot, chain: Chain, kind: Literal["spherical-wrist", "three-parallel"], wrist: Floats
) -> ClosedForm | None:
    h, p = chain.axes, chain.points
    origin = p[0] - h[0] * float(h[0] @ p[0])
    n, forward, up = _plane(chain, robot, wrist, origin)
    turns = np.ones(6)
    about_n = [1, 2, 3] if kind == "three-parallel" else [1, 2]
    turns[about_n] = np.sign(h[about_n] @ n)

    def flat(vector: Floats) -> Floats:
        return np.array([vector @ forward, vector @ up])

    end = wrist if kind == "spherical-wrist" else p[3]
    upper, fore = flat(p[2] - p[1]), flat(end - p[2])
    if min(np.hypot(*upper), np.hypot(*fore)) < 1e-6:
        return None  # no triangle: the elbow cannot change the reach
    upper_angle, fore_angle = _bearing(upper), _bearing(fore)
    planar = Planar(
        shoulder=flat(p[1] - origin),
        upper=float(np.hypot(*upper)),
        fore=float(np.hypot(*fore)),
        upper_angle=float(upper_angle),
        elbow_angle=float(_wrapped(fore_angle - upper_angle)),
        hand=flat(wrist - end),
    )
    a = h[3] if kind == "spherical-wrist" else n
    zero, tilt_cos, tilt_sin = _alignment(a, h[4], h[5])
    middle = _middle(robot.lower[4], robot.upper[4])
    flipped = abs(_wrapped(zero + np.pi - middle)) < abs(_wrapped(zero - middle)) - 1e-9
    return ClosedForm(
        kind=kind,
        axes=h,
        origin=origin,
        n=n,
        forward=forward,
        up=up,
        turns=turns,
        offset=float(n @ (wrist - origin)),
        planar=planar,
        wrist_in_flange=chain.home[:3, :3].T @ (wrist - chain.home[:3, 3]),
        home_rotation=chain.home[:3, :3],
        wrist_zero=float(_wrapped(zero + np.pi * flipped)),
        tilt_cos=tilt_cos,
        tilt_sin=tilt_sin,
        flipped_zero=bool(flipped),
    )


def _plane(chain: Chain, robot: Robot, wrist: Floats, origin: Floats) -> tuple[Floats, Floats, Floats]:
    """n, forward and up; n is ±h2 with W on its positive side or, if W is in the plane, with W in front of axis 1."""
    h1, n = chain.axes[0], chain.axes[1]
    offset = float(n @ (wrist - origin))
    in_front = float(np.cross(n, h1) @ (_at_middle(chain, robot, wrist) - origin))
    if offset < -1e-9 or (abs(offset) <= 1e-9 and in_front < -1e-9):
        n = -n
    forward = np.cross(n, h1)
    forward /= np.linalg.norm(forward)
    return n, forward, np.cross(forward, n)


def _at_middle(chain: Chain, robot: Robot, point: Floats) -> Floats:
    """Where ``point`` (3,) of link 4 goes when joints 2, 3 and 4 move to the middle of their ranges."""
    for joint in (3, 2, 1):
        middle = np.array([_middle(robot.lower[joint], robot.upper[joint])])
        turned = chain.motions.rotation(joint, middle)[0] @ (point - chain.points[joint])
        point = chain.points[joint] + turned
    return point


def _middle(lower: float, upper: float) -> float:
    return 0.5 * (lower + upper) if np.isfinite(lower) and np.isfinite(upper) else 0.0


def _bearing(vector: Floats) -> float:
    """Angle of (forward, up) from up towards forward: the sense of a positive turn about n."""
    return float(np.arctan2(vector[0], vector[1]))


def _wrapped(angle: float) -> float:
    return float(np.arctan2(np.sin(angle), np.cos(angle)))


def _alignment(a: Floats, h5: Floats, h6: Floats) -> tuple[float, float, float]:
    """(zero, c, s) with ``a · Rot(h5, q) h6 = c + s cos(q - zero)``, s > 0."""
    across_a, across_6 = a - h5 * (h5 @ a), h6 - h5 * (h5 @ h6)
    zero = np.arctan2(h5 @ np.cross(across_6, across_a), across_6 @ across_a)
    return float(zero), float((h5 @ a) * (h5 @ h6)), float(np.linalg.norm(across_a) * np.linalg.norm(across_6))
