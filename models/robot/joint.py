"""What a joint does to the links it carries: the one place in which kinds of joints differ.

A revolute joint turns about its axis h by q, a prismatic one shifts along it. Both are

    T(q) = rest + cos q · cosine + sin q · sine + q · linear

with constant 4 x 4 matrices: for a turn ``rest = h hᵀ``, ``cosine = 1 - h hᵀ`` and ``sine = [h]×`` (Rodrigues), for a
shift ``rest = 1`` and ``linear`` with h in its last column. Everything that computes with joints takes its motion from
here: as these terms, as rotations of many values, or as symbols. The three are one formula, each summed in an order of
its own: answers that are tied may change places with the last digit of a frame, so the orders stay.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum
from functools import cached_property
from typing import Any, Literal

import numpy as np

from duocell.models.base.arrays import Bools, Floats, set_frozen


class JointKind(StrEnum):
    """How a joint moves."""

    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"

    @property
    def unit(self) -> Literal["rad", "m"]:
        """Of its values."""
        return "rad" if self is JointKind.REVOLUTE else "m"


@dataclass(frozen=True, eq=False)
class JointMotions:
    """The transforms of n joints as functions of their values, each in the joint's own frame.

    Attributes:
        prismatic: (n,) True for joints that shift.
        axes: (n, 3) unit axes.
    """

    prismatic: Bools
    axes: Floats

    def __post_init__(self) -> None:
        set_frozen(self, "axes", self.axes, (len(self.prismatic), 3))

    @cached_property
    def rest(self) -> Floats:
        """(n, 4, 4) what does not depend on the value."""
        rest = _in_corner(np.where(self.prismatic[:, None, None], np.eye(3), self._outer))
        rest[:, 3, 3] = 1.0
        return rest

    @cached_property
    def cosine(self) -> Floats:
        """(n, 4, 4) what its cosine is multiplied with."""
        return _in_corner(np.where(self.prismatic[:, None, None], 0.0, np.eye(3) - self._outer))

    @cached_property
    def sine(self) -> Floats:
        """(n, 4, 4) what its sine is multiplied with."""
        cross = np.cross(self.axes[:, None, :], np.eye(3)).swapaxes(1, 2)  # columns h × e
        return _in_corner(np.where(self.prismatic[:, None, None], 0.0, cross))

    @cached_property
    def linear(self) -> Floats:
        """(n, 4, 4) what the value itself is multiplied with."""
        linear = np.zeros((len(self.axes), 4, 4))
        linear[:, :3, 3] = np.where(self.prismatic[:, None], self.axes, 0.0)
        return linear

    @cached_property
    def _outer(self) -> Floats:
        outer: Floats = np.einsum("ia,ib->iab", self.axes, self.axes)
        return outer

    @cached_property
    def cross(self) -> Floats:
        """(n, 3, 3) what takes the vector product with each axis, [h]×."""
        x, y, z = self.axes.T
        nothing = np.zeros(len(self.axes))
        cross: Floats = np.array([[nothing, -z, y], [z, nothing, -x], [-y, x, nothing]]).transpose(2, 0, 1)
        return cross

    def rotation(self, joint: int, values: Floats) -> Floats:
        """(K, 3, 3) turn of one revolute joint at values (K,) rad: ``1 + sin q · [h]× + (1 - cos q) · [h]×²``."""
        cross = self.cross[joint]
        sine, cosine = np.sin(values)[:, None, None], np.cos(values)[:, None, None]
        turns: Floats = np.eye(3) + sine * cross + (1.0 - cosine) * (cross @ cross)
        return turns

    def symbolic_rotation(self, joint: int, cosine: Any, sine: Any, constant: Callable[[Floats], Any]) -> Any:
        """The turn of one revolute joint in symbols: ``cos q · 1 + sin q · [h]× + (1 - cos q) · h hᵀ``.

        Args:
            joint: its number.
            cosine: of its value, a symbol. sine: likewise.
            constant: makes a matrix (3, 3) of numbers one of the symbols' library.
        """
        terms = np.eye(3), self.cross[joint], np.outer(self.axes[joint], self.axes[joint])
        identity, cross, outer = (constant(term) for term in terms)
        return cosine * identity + sine * cross + (1 - cosine) * outer


def _in_corner(blocks: Floats) -> Floats:
    """(n, 4, 4) matrices with (n, 3, 3) in their upper left corner and nothing else."""
    matrices = np.zeros((len(blocks), 4, 4))
    matrices[:, :3, :3] = blocks
    return matrices


def move_columns(prismatic: bool, values: Floats, columns: Floats, position: Floats) -> Floats:
    """Move N frames whose z is the axis of one joint, laid out as rows over the frames.

    Args:
        prismatic: whether the joint shifts.
        values: (N,) rad or m.
        columns: (3 columns, 3, N) of the frames' rotations, turned in place.
        position: (3, N) m.

    Returns:
        (3, N) m, the positions after the motion.
    """
    if prismatic:
        shifted: Floats = position + values * columns[2]
        return shifted
    sine, cosine = np.sin(values), np.cos(values)
    turned = cosine * columns[0] + sine * columns[1]
    columns[1] = cosine * columns[1] - sine * columns[0]
    columns[0] = turned
    return position


def moved_by(prismatic: Bools, axes: Floats, levers: Floats) -> Floats:
    """Velocities of points per unit of the joints that move them.

    Args:
        prismatic: (...) True for joints that shift, of a shape that fits the others without their last axis.
        axes: (..., 3) unit axes.
        levers: (..., 3) m, from a point of each axis to the point that it moves.

    Returns:
        (..., 3): m per rad, ``h × r``, for a turn, and h itself for a shift.
    """
    turned: Floats = np.cross(axes, levers)
    return np.where(prismatic[..., None], axes, turned) if np.any(prismatic) else turned


def in_words(amount: float, unit: str, digits: int = 2) -> str:
    """An amount for a person: degrees where it is in rad, else millimetres with a digit less."""
    return f"{np.degrees(amount):.{digits}f}°" if unit == "rad" else f"{1e3 * amount:.{max(digits - 1, 0)}f} mm"
