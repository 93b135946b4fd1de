"""What a layout with errors breaks, in words."""

from __future__ import annotations

import numpy as np

from duocell.optimizer.clearance.clearance import PathClearance
from duocell.optimizer.tolerance.displaced import Displaced
from duocell.optimizer.verification.scene import LIMITS


def first_break(displaced: Displaced, i: int) -> str:
    """What layout ``i`` breaks at its poses, a clause; empty if nothing."""
    if not displaced.followed[i]:
        return _lost(displaced, i)
    gap_margin, place, pair = displaced.nearest(i)
    own = [min(path.margin[i], path.step[i], path.conditioning[i]) for path in displaced.paths]
    a = int(np.argmin(own))
    if min(own[a], gap_margin) >= 0.0:
        return ""
    return _own(displaced, i, a) if own[a] < gap_margin else _contact(displaced, place, pair)


def break_between(path: PathClearance) -> str:
    """What a path breaks at or between its poses, a clause; empty if nothing."""
    for lost in path.breaks:
        return f"{lost.arm} cannot follow the part after pose {lost.pose}"
    for found in path.classes:
        if not found.clear:
            pair = f"{found.contact.first} and {found.contact.second}"
            return f"{pair} come nearer than {found.required * 1e3:g} mm after pose {found.pose}"
    return "a joint leaves its limits between two poses" if path.limit_excess > LIMITS else ""


def _lost(displaced: Displaced, i: int) -> str:
    for arm, path in zip(displaced.nominal.cell.arms, displaced.paths, strict=True):
        if not np.all(path.arrived[i]):
            place = int(np.argmin(path.arrived[i]))
            return f"{arm.name} cannot follow in its posture at pose {displaced.nominal.step[place]}"
    raise ValueError("every arm follows")


def _own(displaced: Displaced, i: int, a: int) -> str:
    """What one arm breaks on its own."""
    nominal, arm, path = displaced.nominal, displaced.nominal.cell.arms[a], displaced.paths[a]
    q = path.joints[i, : nominal.poses]
    margins = -arm.limit_excess(q)
    if path.margin[i] <= min(path.step[i], path.conditioning[i]):
        pose, joint = (int(x) for x in np.unravel_index(np.argmin(margins), margins.shape))
        return f"{arm.name} / {arm.bounded_names[joint]} reaches its limit at pose {pose}"
    if path.step[i] <= path.conditioning[i]:
        steps = np.abs(np.diff(q, axis=0)) * nominal.cell.task.joined[:, None]
        pose, joint = (int(x) for x in np.unravel_index(np.argmax(steps), steps.shape))
        return f"{arm.name} / {arm.robot.joint_names[joint]} makes too long a step to pose {pose + 1}"
    return f"{arm.name} falls short of its min_conditioning"


def _contact(displaced: Displaced, place: int, pair: int) -> str:
    nominal, model = displaced.nominal, displaced.nominal.scene.model
    if model is None:
        raise ValueError("without bodies nothing can touch")
    b = model.bodies
    where = "at" if place < nominal.poses else "after"
    names = f"{b.names[b.first[pair]]} and {b.names[b.second[pair]]}"
    required = float(nominal.scene.required[pair])
    return f"{names} come nearer than {required * 1e3:g} mm {where} pose {nominal.step[place]}"
