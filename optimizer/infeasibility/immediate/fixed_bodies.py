"""Bodies whose places the task alone decides: the part, and the last link and tool of every arm.

They are where they are whatever the bases and postures, so what they come too near to is a proof. Looked at are the
poses and samples of the straight way between poses of one segment.
"""

from __future__ import annotations

import time
from collections.abc import Iterator, Mapping
from math import radians

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.kept import KEPT
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision import CollisionModel, Configurations, Contact
from duocell.optimizer.clearance.path_samples import ObjectPath
from duocell.optimizer.infeasibility.immediate.cause import Infeasibility, millimetres, rounded_down, surely_short
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.reasons.meant_contact import if_meant

SHIFT, TURN = 5e-3, radians(1.0)
"""m and rad of the object between samples of its way, ..."""
MOST = 400
"""... which lie farther apart where there would be more than so many."""
AT_ONCE = 2_000_000
"""Pairs, and bodies, times places that are looked at together: some tens of megabytes."""
NAMED = 3
"""Causes that are told."""
TOUCHING = 5e-5
"""m; what comes so near touches, in words."""


def fixed_body_conflicts(cell: Cell, model: CollisionModel, deadline: float = np.inf) -> tuple[Infeasibility, ...]:
    """Pairs of fixed bodies that are nearer to each other than is asked for, the worst first.

    Args:
        cell: task, arms and clearances. model: of the cell.
        deadline: `time.perf_counter` value after which no further places are looked at.

    Raises:
        Cancelled: whoever watches (`duocell.optimizer.monitoring.watch`) wants an end.
    """
    pairs = _fixed_pairs(cell, model)
    if not np.any(pairs):
        return ()
    step, fraction = _samples(cell)
    m = len(cell.task)
    objects = np.concatenate([cell.task.poses, ObjectPath(cell.task.poses).at(step[m:], fraction[m:])])
    groups = _groups(model, pairs)
    required = [cell.surroundings.clearances.required(model.bodies.kinds[group[0]]) or 0.0 for group in groups]
    worst: dict[int, tuple[int, Contact]] = {}
    some = max(AT_ONCE // (len(pairs) + len(model.bodies.names)), 1)
    for first in range(0, len(objects), some):
        check_stop()
        if time.perf_counter() > deadline:
            break
        part = slice(first, first + some)
        places = _placed(cell, model, objects[part], step[part], pairs)
        for g, k, contact in _short(model, places, groups, required, worst, deadline):
            worst[g] = first + k, contact
    found = [
        _cause(contact, contact.kind, required[g], int(step[k]), float(fraction[k]))
        for g, (k, contact) in sorted(worst.items())
    ]
    found.sort(key=lambda cause: cause.possible if cause.possible is not None else -1.0)
    return tuple(found[:NAMED])


def _short(
    model: CollisionModel,
    places: Configurations,
    groups: list[Ints],
    required: list[float],
    known: Mapping[int, tuple[int, Contact]],
    deadline: float,
) -> Iterator[tuple[int, int, Contact]]:
    """Group, place and contact of what is too near, where it is nearer than what is ``known`` of the group."""
    bounds = model.bounds(places)
    least = np.min(bounds, axis=0)
    for g, group in enumerate(groups):
        limit = min(required[g] - KEPT, known[g][1].distance if g in known else np.inf)
        near = group[least[group] < limit]
        if not len(near):
            continue
        check_stop()
        if time.perf_counter() > deadline:
            return
        hidden = np.where(bounds[:, near] < limit, bounds[:, near], np.inf)
        nearest = model.closest_of(places, near, hidden)
        if nearest is not None and nearest[1].distance < limit and surely_short(nearest[1].distance, required[g]):
            yield g, *nearest


def _fixed_pairs(cell: Cell, model: CollisionModel) -> Bools:
    """(P,) True for pairs of bodies that the task places, or one that it places and an obstacle."""
    b = model.bodies
    given = [owner.part or (owner.arm is not None and owner.link == cell.arms[owner.arm].dof) for owner in b.owners]
    last: Bools = np.array(given, dtype=np.bool_)
    still: Bools = np.array([owner.arm is None and not owner.part for owner in b.owners], dtype=np.bool_)
    first, second = b.first, b.second
    own = np.array([kind is PairClass.SELF for kind in b.kinds], dtype=np.bool_)
    return np.asarray((last[first] & (last | still)[second]) | (still[first] & last[second])) & ~own


def _samples(cell: Cell) -> tuple[Ints, Floats]:
    """Poses, then places between them: index of the pose before (K,), fraction of the way to the next (K,)."""
    path, m = ObjectPath(cell.task.poses), len(cell.task)
    apart = np.maximum(np.linalg.norm(path.shifts, axis=1) / SHIFT, np.linalg.norm(path.turns, axis=1) / TURN)
    apart = np.where(cell.task.joined, apart, 0.0)
    apart *= min(1.0, MOST / max(float(np.sum(apart)), 1.0))
    cuts = np.maximum(np.ceil(apart), 1).astype(np.int64)
    step = np.repeat(np.arange(m - 1), cuts)
    fraction = np.concatenate([np.arange(cut) / cut for cut in cuts]) if m > 1 else np.zeros(0)
    between = fraction > 0.0
    return np.concatenate([np.arange(m), step[between]]), np.concatenate([np.zeros(m), fraction[between]])


def _placed(cell: Cell, model: CollisionModel, objects: Floats, step: Ints, pairs: Bools) -> Configurations:
    """The fixed bodies in the world; frames of other links are not set, their pairs do not count."""
    frames: Floats = np.tile(np.eye(4), (len(objects), model.offsets[-1], 1, 1))
    frames[:, 1] = objects
    for a, arm in enumerate(cell.arms):
        flange = objects @ cell.grasps(arm)[step] @ inverse(arm.tool)
        frames[:, model.offsets[a] + arm.dof] = flange @ inverse(arm.robot.flange_placement)
    return model.arranged(frames, cell.task.segment_of[step], pairs)


def _groups(model: CollisionModel, pairs: Bools) -> list[Ints]:
    """Pairs by class, arms and names of the bodies: one cause each."""
    b = model.bodies
    groups: dict[tuple[object, ...], list[int]] = {}
    for pair in np.flatnonzero(pairs):
        i, j = b.first[pair], b.second[pair]
        groups.setdefault((b.kinds[pair], b.owners[i], b.owners[j], b.names[j]), []).append(int(pair))
    return [np.array(group, dtype=np.int64) for group in groups.values()]


def _cause(contact: Contact, pair_class: PairClass, required: float, pose: int, fraction: float) -> Infeasibility:
    """In words."""
    gap = contact.distance
    first = _called(contact.first, part=contact.first_owner.part)
    how = f"comes within {millimetres(gap)} of" if gap > 0.0 else f"penetrates {millimetres(-gap)} into"
    how = how if abs(gap) >= TOUCHING else "touches"
    where = f"at pose {pose}" if fraction == 0.0 else f"between poses {pose} and {pose + 1}"
    possible = rounded_down(gap) if gap >= 0.0 else None
    less = "" if possible is None else f"ask for {millimetres(possible)} instead of {millimetres(required)}, or "
    away = millimetres(required - gap)
    movable = {
        PairClass.PART_OBSTACLE: f"move the path or {contact.second} {away} away",
        PairClass.ARM_OBSTACLE: f"move the path or {contact.second} {away} away, or change the grasp or the tool",
    }.get(pair_class, f"move the grasps {away} apart, or change a tool")
    detail = (
        f"{first} {how} {contact.second} {where}, wherever the bases stand; {millimetres(required)} are asked for: "
        f"{less}{movable}{if_meant(pair_class)}"
    )
    arms = tuple(o.arm for o in (contact.first_owner, contact.second_owner) if o.arm is not None)
    return Infeasibility(
        kind="collision",
        detail=detail,
        arms=arms,
        poses=(pose,) if fraction == 0.0 else (pose, pose + 1),
        bodies=(contact.first, contact.second),
        pair_class=pair_class,
        required=required,
        possible=possible,
        missing=required - gap,
        pointer=f"/clearance/{pair_class}",
        unit="m",
    )


def _called(name: str, *, part: bool) -> str:
    """A body in a sentence: a part of one shape has its own name twice over."""
    if not part:
        return name
    return "the part" if name == "part" else f"the part ({name})"
