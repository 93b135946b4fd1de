"""The geometry that a description means: an arm whose axes are parallel, square or meeting where they nearly are.

Files print 1.57 for a right angle and lengths to the micrometre, and calibrated arms are off their drawing by a
milliradian. Such an arm has no closed form, though its drawing has one. The drawing is restored from the chain at zero:
directions are drawn to those of axes before them, to right angles with them and to the base's vertical, and points to
where axes meet. How far the flange of the one is from that of the other is bounded for all joint values at once.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.base.pose import inverse, transform
from duocell.models.kinematics.chain import Chain, chain_of
from duocell.models.kinematics.closed_form import ClosedForm, closed_form
from duocell.models.kinematics.difference import Difference, moved_apart, offsets_of
from duocell.models.kinematics.kinematics import characteristic_length, reach
from duocell.models.robot.robot import Robot

ANGLE = 5e-3
"""rad; axes that are parallel or square but for less are meant to be."""
LENGTH = 2e-3
"""Of the arm's reach; axes that miss each other by less are meant to meet."""

ROUNDING = 1e-12
"""m and rad; chains nearer to each other than this are one."""


@dataclass(frozen=True, eq=False, slots=True)
class Nominal:
    """An arm with a closed form that stands for another one.

    Attributes:
        robot: same joints and limits; it has a closed form, and axis 1 along the base's z axis if the true one nearly
            has.
        apart: how far its hand is from the true one at the same joint values, at most.
    """

    robot: Robot
    apart: Difference

    @property
    def position(self) -> float:
        """m, its flange is never farther than this from the true one at the same joint values."""
        return self.apart.position

    @property
    def angle(self) -> float:
        """rad, likewise turned."""
        return self.apart.angle

    @property
    def negligible(self) -> bool:
        """True if no check can tell the two apart, so that proofs need room for no more than that."""
        return self.apart.negligible

    @property
    def kind(self) -> str:
        """Class of its closed form."""
        form = closed_form(self.robot)
        return "" if form is None else form.kind


@lru_cache(maxsize=256)
def nominal(robot: Robot) -> Nominal | None:
    """The arm that ``robot`` was drawn as, where that has a closed form and the robot itself has none; else None.

    A robot that has one but for the last digits of its file is replaced too: the proof of a joint at its very limit
    knows of no digits.
    """
    if robot.dof != 6 or robot.slides:
        return None
    chain = chain_of(robot)
    usable = closed_form(robot) is not None and chain.vertical_sign != 0
    if usable and robot.ssik_name is not None:
        return None  # the catalogue's figures are what they are
    drawn = _drawn(chain, LENGTH * reach(robot))
    stand_in = _robot_of(robot, drawn)
    form = closed_form(stand_in)
    if form is None or (closed_form(robot) is not None and chain_of(stand_in).vertical_sign == 0):
        return None
    found = Nominal(stand_in, _difference(robot, stand_in, drawn, form))
    if usable and (not found.negligible or max(found.position, found.angle) < ROUNDING):
        return None
    return found


def posture_form(robot: Robot) -> ClosedForm | None:
    """What the words of a posture mean for a robot: its closed form, or that of the arm it was drawn as."""
    meant = nominal(robot) if closed_form(robot) is None else None
    return closed_form(robot if meant is None else meant.robot)


def singular_fifth(robot: Robot) -> float | None:
    """A value of joint 5 [rad] at which the wrist of a robot with postures is singular; None for other robots.

    Half a turn away is another one. There the axes 4, 5 and 6 lie in one plane, and the wrist has lost a direction to
    turn about. Where the wrist is as drawn, 4 and 6 (or 2 and 6) are in line.
    """
    form = closed_form(robot)
    if form is not None:
        return form.wrist_zero
    meant = posture_form(robot)
    return None if meant is None else _in_one_plane(chain_of(robot), meant.wrist_zero)


@lru_cache(maxsize=256)
def _in_one_plane(chain: Chain, near: float) -> float:
    """The value of joint 5 nearest to another one at which axes 4, 5 and 6 lie in one plane [rad]."""
    fourth, fifth, sixth = chain.axes[3:]
    before, behind = (axis - fifth * (axis @ fifth) for axis in (fourth, sixth))
    angle = float(np.arctan2(fifth @ np.cross(behind, before), behind @ before))
    return near + float(np.remainder(angle - near + 0.5 * np.pi, np.pi)) - 0.5 * np.pi


def as_drawn(robot: Robot) -> Robot:
    """The robot with the geometry that was meant, whether that has a closed form or not; on a linear axis as it is."""
    if robot.slides:
        return robot
    return _robot_of(robot, _drawn(chain_of(robot), LENGTH * reach(robot)))


def _drawn(chain: Chain, near: float) -> Chain:
    """The chain with axes drawn to where they are meant to be; ``near`` [m]: how far points may move."""
    known = [np.array([0.0, 0.0, 1.0])]
    axes = []
    for axis in chain.axes:
        axes.append(_drawn_to(axis, known))
        known.append(axes[-1])
    points = chain.points.copy()
    if float(np.linalg.norm(np.cross(axes[0], known[0]))) == 0.0 and np.hypot(*points[0, :2]) < near:
        points[0, :2] = 0.0
    h = np.array(axes)
    last = 3 if not _parallel(h[2], h[3]) else 4
    middle = _nearest_point(h[last:], points[last:])
    if middle is not None and all(_off(middle, p, a) < near for p, a in zip(points[last:], h[last:], strict=True)):
        points[last:] = middle + h[last:] * np.sum(h[last:] * (points[last:] - middle), axis=1, keepdims=True)
    return Chain(h, points, _home(chain.home, known))


def _home(home: Floats, known: list[Floats]) -> Floats:
    """The flange at zero, turned to the directions known where its file's last digits alone are in the way."""
    z = _drawn_to(home[:3, 2], known)
    x = _drawn_to(home[:3, 0], [*known, z])
    x = x - z * (x @ z)
    x /= np.linalg.norm(x)
    turn = np.column_stack([x, np.cross(z, x), z])
    return transform(turn, home[:3, 3]) if float(np.max(np.abs(turn - home[:3, :3]))) < KEPT else home


def _drawn_to(axis: Floats, known: list[Floats]) -> Floats:
    """A unit direction drawn to one of those known, or to right angles with one or two of them."""
    for other in known:
        if np.linalg.norm(np.cross(axis, other)) < ANGLE:
            return other * np.sign(axis @ other)
    square = [other for other in known if abs(axis @ other) < ANGLE]
    for i, one in enumerate(square):
        for other in square[:i]:
            across = np.cross(one, other)
            if np.linalg.norm(across) > 0.1:
                across = across / np.linalg.norm(across)
                return np.asarray(across * np.sign(across @ axis))
    for one in reversed(square[1:] or square):  # the base's z axis says least
        axis = axis - one * (axis @ one)
        return np.asarray(axis / np.linalg.norm(axis))
    return axis


def _parallel(first: Floats, second: Floats) -> bool:
    return float(np.linalg.norm(np.cross(first, second))) < 1e-12


def _nearest_point(axes: Floats, points: Floats) -> Floats | None:
    """The point with the least squared distances from lines; None if they are parallel."""
    projectors = np.eye(3) - axes[:, :, None] * axes[:, None, :]
    normal = projectors.sum(axis=0)
    if np.linalg.cond(normal) > 1e8:
        return None
    return np.asarray(np.linalg.solve(normal, np.einsum("iab,ib->a", projectors, points)))


def _off(point: Floats, on_line: Floats, axis: Floats) -> float:
    """Distance [m] of a point from a line."""
    return float(np.linalg.norm(np.cross(point - on_line, axis)))


def _robot_of(robot: Robot, chain: Chain) -> Robot:
    """The robot of a chain; its links' frames are turned as those of ``robot`` at zero: bodies are given in them."""
    before, true = np.eye(4), np.eye(4)
    placements, axes = [], []
    for placement, point, axis in zip(robot.joint_placements, chain.points, chain.axes, strict=True):
        true = true @ placement
        frame = transform(true[:3, :3], point)
        placements.append(inverse(before) @ frame)
        axes.append(frame[:3, :3].T @ axis)
        before = frame
    return replace(
        robot,
        joint_placements=np.array(placements),
        joint_axes=np.array(axes),
        flange_placement=inverse(before) @ chain.home,
    )


def _difference(robot: Robot, stand_in: Robot, drawn: Chain, form: ClosedForm) -> Difference:
    """Bounds of how far a robot is from the one that stands for it, with its chain and closed form."""
    true, lengths = chain_of(robot), (characteristic_length(robot), characteristic_length(stand_in))
    position, angle = moved_apart(true, drawn, np.zeros(3))
    wrist, _ = moved_apart(true, drawn, form.wrist_in_flange)
    return Difference(
        position=position,
        wrist=wrist,
        angle=angle,
        fifth=abs(_in_one_plane(true, form.wrist_zero) - form.wrist_zero),
        offsets=offsets_of(true, drawn),
        length=abs(lengths[1] / lengths[0] - 1.0),
    )
