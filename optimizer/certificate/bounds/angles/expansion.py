r"""Joint values over a box: enclosed, and expanded about its centre to second order.

Each joint is enclosed directly from the geometry of the box and, where its slopes are known, by the mean value
theorem as the value at the centre plus slopes times distance. Both hold, so their intersection does (as long as they
cannot meet twice on the circle; else the second is taken, which stays on the turn of the value at the centre). The
second is the tight one in small boxes away from singular postures; the first needs no smoothness.

By Taylor's theorem the value at centre + d is ``exact + slopes·d`` up to half of the largest second differential, for
which the mean-value bounds of the first differentials over the whole box are enough (docs/method.md, section 7.5).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from duocell.models.base.arrays import Bools, Floats
from duocell.models.robot.arm import TURN
from duocell.optimizer.certificate.bounds.angles.joints import SLACK, Angles, AngleSlopes, Kinematics
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.boxes import Boxes


@dataclass(frozen=True, eq=False, slots=True)
class Enclosed:
    """Joint values over N boxes.

    Attributes:
        boxes: the boxes, along the mount's axes.
        values: (6, N, m) rad, at yaw 0.
        exact: (6, N, m) rad, value at the centre of each box, on the same turn of 2π.
        regular: (6, N, m) True where slopes mean something.
        angles: over the boxes. at_centre: at the centres. slopes: over the boxes.
    """

    boxes: Boxes
    values: Ball
    exact: Floats
    regular: Bools
    angles: Angles
    at_centre: Angles
    slopes: AngleSlopes

    def __getitem__(self, rows: Bools) -> Enclosed:
        return Enclosed(
            self.boxes[rows],
            self.values[:, rows],
            self.exact[:, rows],
            self.regular[:, rows],
            self.angles[rows],
            self.at_centre[rows],
            self.slopes[rows],
        )


def enclose(kinematics: Kinematics, boxes: Boxes, angles: Angles) -> Enclosed:
    """Enclose the joint values over boxes along the mount's axes, given the enclosed angles."""
    dims = kinematics.targets.dims
    points = Boxes(boxes.centre, np.zeros_like(boxes.half), boxes.posture)
    at_centre = kinematics.exact.angles(points)
    direct, exact = kinematics.joint_values(angles), kinematics.joint_values(at_centre).centre
    exact = exact + TURN * np.round((direct.centre - exact) / TURN)
    slopes = kinematics.slopes(boxes, angles)
    regular = kinematics.regular(slopes)
    half = boxes.half[:, :dims] + kinematics.allowance.shift
    reach = np.einsum("iKNm,NK->iNm", kinematics.joint_slopes(slopes).size, half) + kinematics.by_turn(angles, slopes)
    near, both = Ball(exact, reach), direct.meet(Ball(exact, reach))
    # Angles count modulo 2π: only intervals too short to meet again on the other side of the circle may be cut.
    apart = np.abs(exact - direct.centre) + reach + direct.radius < TURN
    centre, radius = (
        np.where(regular, np.where(apart, cut, wide), plain)
        for cut, wide, plain in ((both.centre, near.centre, direct.centre), (both.radius, near.radius, direct.radius))
    )
    return Enclosed(boxes, Ball(centre, radius + SLACK), exact, regular, angles, at_centre, slopes)


@dataclass(frozen=True, eq=False, slots=True)
class Expansion:
    """``q(centre + d) = exact + slopes·d + rest``; slopes (6, K, N, m) rad/m, |rest| <= rest (6, N, m) rad."""

    slopes: Floats
    rest: Floats

    def in_world(self, mount: Floats) -> Expansion:
        """The same with slopes along the world's axes; a step there is ``mountᵀ · step`` along the mount's."""
        return Expansion(np.einsum("wk,ikNm->iwNm", mount[:, : self.slopes.shape[1]], self.slopes), self.rest)


def expand(kinematics: Kinematics, found: Enclosed) -> Expansion:
    """Expand the joint values; only where they are regular does it mean something."""
    beside = kinematics.allowance.shift
    half = found.boxes.half[:, : kinematics.targets.dims] + beside
    exact = kinematics.joint_slopes(kinematics.slopes(found.boxes, found.at_centre)).centre
    rest = 0.5 * kinematics.bending(found.angles, found.slopes, half) + beside * np.sum(np.abs(exact), axis=1)
    return Expansion(exact, rest + kinematics.by_turn(found.angles, found.slopes))
