"""Changes of what one arm is asked for: where its base may stand, how far its joints turn, its posture."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import degrees, pi, radians

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.robot.arm import Arm, Interval, range_weights
from duocell.models.robot.joint import in_words
from duocell.models.robot.posture import Posture
from duocell.optimizer.infeasibility.changes.remedy import FARTHEST, Remedy
from duocell.optimizer.infeasibility.requirements import Kind, Requirement


def with_arm(cell: Cell, a: int, arm: Arm) -> Cell:
    """The cell with another arm in the place of one."""
    return replace(cell, arms=(*cell.arms[:a], arm, *cell.arms[a + 1 :]))


def wider_region(cell: Cell, requirement: Requirement) -> Remedy:
    """A base region that reaches farther along x and y."""
    a = requirement.index
    arm, base = cell.arms[a], cell.arms[a].base

    def change(amount: float) -> Cell:
        return with_arm(cell, a, replace(arm, base=replace(base, x=_wider(base.x, amount), y=_wider(base.y, amount))))

    def words(amount: float) -> str:
        return f"let {arm.name} stand {1e3 * amount:.0f} mm farther out of its base region"

    return Remedy(change, words, f"/arms/{a}/base", 0.05, FARTHEST, 1e-3, requirement)


def turned_or_raised(cell: Cell, requirement: Requirement) -> Iterator[Remedy]:
    """A base region that reaches farther about, and along, the vertical."""
    a = requirement.index
    arm, base = cell.arms[a], cell.arms[a].base

    def turned(amount: float) -> Cell:
        return with_arm(cell, a, replace(arm, base=replace(base, yaw=_wider(base.yaw, amount))))

    def raised(amount: float) -> Cell:
        return with_arm(cell, a, replace(arm, base=replace(base, z=_wider(base.z, amount))))

    def about(amount: float) -> str:
        return f"let the base of {arm.name} be turned by {degrees(amount):.1f}° more, either way"

    def up(amount: float) -> str:
        return f"let {arm.name} stand up to {1e3 * amount:.0f} mm higher or lower"

    if not base.yaw_free:
        room = pi - 0.5 * (base.yaw.high - base.yaw.low)
        yield Remedy(turned, about, f"/arms/{a}/base/yaw", min(0.05, room), room, radians(0.1), requirement)
    if cell.surroundings.of(arm.name).pedestal is None:
        yield Remedy(raised, up, f"/arms/{a}/base/z", 0.02, 1.0, 1e-3, requirement)


def limits(cell: Cell, requirement: Requirement) -> Remedy:
    """A joint that turns farther."""
    a, joint = requirement.index, requirement.joint
    arm = cell.arms[a]
    name = arm.robot.joint_names[joint]
    shifts = bool(arm.robot.prismatic[joint])
    by_range = np.array_equal(arm.weights, range_weights(arm.lower, arm.upper))  # as the request would get them

    def change(amount: float) -> Cell:
        more = amount * (np.arange(arm.dof) == joint)
        lower, upper = arm.lower - more, arm.upper + more
        weights = range_weights(lower, upper) if by_range else arm.weights
        return with_arm(cell, a, replace(arm, lower=lower, upper=upper, weights=weights))

    def words(amount: float) -> str:
        moves = "go" if shifts else "turn"
        return f"let {name} of {arm.name} {moves} {in_words(amount, arm.bounded_units[joint], 1)} farther, either way"

    fine = 1e-3 if shifts else radians(0.1)
    return Remedy(change, words, f"/arms/{a}/limits/{joint}", 0.05, 2.0 * pi, fine, requirement)


def linear_limit(cell: Cell, requirement: Requirement) -> Remedy:
    """A sum of joints with a wider range."""
    a, row = requirement.index, requirement.joint
    arm, sums = cell.arms[a], cell.arms[a].linear_limits
    if sums is None:
        raise ValueError(f"{arm.name} has no linear limits")

    def change(amount: float) -> Cell:
        more = amount * (np.arange(len(sums)) == row)
        wider = replace(sums, lower=sums.lower - more, upper=sums.upper + more)
        return with_arm(cell, a, replace(arm, linear_limits=wider))

    def words(amount: float) -> str:
        return f"let {sums.names[row]} of {arm.name} be {degrees(amount):.1f}° more or less"

    return Remedy(change, words, f"/arms/{a}/linear_limits/{row}", 0.05, 2.0 * pi, radians(0.1), requirement)


def freed(cell: Cell, requirement: Requirement) -> Remedy:
    """A posture that is not asked for, or singularities that are allowed."""
    a = requirement.index
    arm = cell.arms[a]
    posture = requirement.kind is Kind.POSTURE

    def change(amount: float) -> Cell:
        del amount
        return with_arm(
            cell, a, replace(arm, posture=Posture()) if posture else replace(arm, avoid_singularities=False)
        )

    def words(amount: float) -> str:
        del amount
        if posture:
            return f"leave the posture of {arm.name} free"
        return f'allow singularities of the wrist of {arm.name} ("singularities": "allow")'

    pointer = f"/arms/{a}/{'posture' if posture else 'singularities'}"
    return Remedy(change, words, pointer, 1.0, 1.0, 1.0, requirement)


def _wider(interval: Interval, amount: float) -> Interval:
    return Interval(interval.low - amount, interval.high + amount)
