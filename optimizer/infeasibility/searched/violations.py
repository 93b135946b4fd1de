"""What a layout breaks of all that a cell asks for, each time with the requirements one of which has to go."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.models.collision.collision_bodies import Owner
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.branches import path_signs
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.kinematics.nominal import posture_form
from duocell.models.kinematics.wrist_singularity import wrist_shortfall
from duocell.models.robot.arm import Arm
from duocell.optimizer.infeasibility.requirements import Kind, Requirement, Selection
from duocell.optimizer.infeasibility.searched.obstructed import part_hits
from duocell.optimizer.infeasibility.searched.partial_path import PartialPath
from duocell.optimizer.monitoring.watch import check_stop
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.samples import Samples, sample_path
from duocell.optimizer.verification.scene import LIMITS, Scene, row_violation, world_yaw
from duocell.optimizer.verification.verify import LIMITS as EXACT

MOST_CONTACTS = 1500
"""Pairs and places that Coal is asked about."""


@dataclass(frozen=True, slots=True)
class Violation:
    """Something that a layout breaks: it would not if any of the requirements or any of the poses were left out.

    Attributes:
        requirements: all of them are needed for it.
        first: pose. last: likewise; None for both where poses do not matter.
    """

    requirements: frozenset[Requirement]
    first: int | None = None
    last: int | None = None

    def within(self, selection: Selection) -> bool:
        """True if a selection asks for all that is broken here."""
        inside = self.first is None or self.last is None or selection.first <= self.first <= self.last <= selection.last
        return inside and self.requirements <= selection.requirements


def violations(cell: Cell, paths: Mapping[int, PartialPath]) -> tuple[Violation, ...]:
    """All that a layout breaks.

    Args:
        cell: the whole cell.
        paths: index of an arm -> where it stands and how it goes along the task, for the arms that are placed.

    Returns:
        Distances are looked at on samples of the path; the rest at the poses.
    """
    missing = (Violation(frozenset({Requirement(Kind.ARM, a)})) for a in range(len(cell.arms)) if a not in paths)
    own = (violation for a, path in paths.items() for violation in _of_arm(cell, a, path))
    found = dict.fromkeys([*missing, *own, *_couplings(cell, paths), *_floor(cell, paths), *_along(cell, paths)])
    return tuple(found)


def part_violations(cell: Cell) -> tuple[Violation, ...]:
    """What the part hits on its way, whatever the arms do."""
    return tuple(
        Violation(frozenset({Requirement(Kind.PART), Requirement(Kind.OBSTACLE, obstacle)}), first, last)
        for obstacle, first, last in part_hits(cell)
    )


def _of_arm(cell: Cell, a: int, path: PartialPath) -> Iterator[Violation]:
    """What an arm breaks by itself."""
    arm, point = cell.arms[a], path.point
    this = Requirement(Kind.ARM, a)
    for pose in path.lost:
        yield Violation(frozenset({this}), pose, pose)
    place, region = point.position, arm.base.bounds[:3]
    off = float(np.max(np.maximum(region[:, 0] - place, place - region[:, 1])))
    if max(off, arm.base.yaw_outside(point.yaw)) > EXACT:
        yield Violation(frozenset({this, Requirement(Kind.REGION, a)}))
    form = posture_form(arm.robot)
    if form is not None and not arm.posture.admits(path_signs(form, point.joints[path.first : path.last + 1])):
        yield Violation(frozenset({this, Requirement(Kind.POSTURE, a)}))
    q = point.joints[path.first : path.last + 1]
    for row, joint in np.argwhere(arm.limit_excess(q) > EXACT):
        pose = path.first + int(row)
        yield Violation(frozenset({this, _limit(arm, a, int(joint))}), pose, pose)
    joined = cell.task.joined[path.first : path.last]
    for row in np.flatnonzero(
        joined & np.any(np.abs(np.diff(q, axis=0)) > cell.step_limits(arm.robot) + EXACT, axis=1)
    ):
        pose = path.first + int(row)
        yield Violation(frozenset({this, Requirement(Kind.STEP)}), pose, pose + 1)
    for row in np.flatnonzero(wrist_shortfall(arm, q.T[..., None])):
        rule = frozenset({this, Requirement(Kind.SINGULARITIES, a)})
        yield Violation(rule, path.first + int(row), path.first + int(row))
    for row in np.flatnonzero(_ill_conditioned(arm, q)):
        pose = path.first + int(row)
        yield Violation(frozenset({this, Requirement(Kind.CONDITIONING, a)}), pose, pose)


def _limit(arm: Arm, a: int, bounded: int) -> Requirement:
    """The requirement behind a limit of `Arm.bounded`."""
    if bounded < arm.dof:
        return Requirement(Kind.LIMITS, a, bounded)
    return Requirement(Kind.LINEAR, a, bounded - arm.dof)


def _ill_conditioned(arm: Arm, joints: np.ndarray) -> np.ndarray:
    """(m,) True where the conditioning asked for is not kept."""
    if arm.min_conditioning is None:
        return np.zeros(len(joints), dtype=np.bool_)
    values = conditioning_of(chain_of(arm.robot), arm.tool, joints, characteristic_length(arm.robot))
    return np.asarray(values < arm.min_conditioning - EXACT)


def _couplings(cell: Cell, paths: Mapping[int, PartialPath]) -> Iterator[Violation]:
    bases = {a: (*path.point.position, path.point.yaw) for a, path in paths.items()}
    for k, coupling in enumerate(cell.couplings):
        if all(arm in bases for arm in coupling.arms):
            rows = coupling.rows([bases.get(a, (0.0,) * 4) for a in range(len(cell.arms))])
            if row_violation(rows) > LIMITS:
                arms = (Requirement(Kind.ARM, arm) for arm in coupling.arms)
                yield Violation(frozenset({Requirement(Kind.COUPLING, k), *arms}))


def _floor(cell: Cell, paths: Mapping[int, PartialPath]) -> Iterator[Violation]:
    floor = cell.surroundings.floor
    if floor is None:
        return
    for a, path in paths.items():
        arm, point = cell.arms[a], path.point
        footprint = cell.surroundings.footprint(arm.name)
        gap = floor.signed_distance(point.position[None, :2], footprint, world_yaw(arm, point.yaw))
        if float(gap[0]) < -LIMITS:
            yield Violation(frozenset({Requirement(Kind.ARM, a), Requirement(Kind.FLOOR)}))


# --- along the path ---------------------------------------------------------------------------------------------------


def _along(cell: Cell, paths: Mapping[int, PartialPath]) -> Iterator[Violation]:
    """Bodies that come too near to each other, and joint limits between the poses."""
    arms = list(paths)
    if not cell.surroundings.clearances.any or not arms:
        return
    first, last = max(path.first for path in paths.values()), min(path.last for path in paths.values())
    part = replace(cell, arms=tuple(cell.arms[a] for a in arms), couplings=()).part(first, last)
    points = [paths[a].between(first, last) for a in arms]
    scene = Scene.of(part, holders=cell.arms)
    samples = sample_path(part, scene.path, scene.bases(points), points)
    if not samples.followed:
        yield Violation(frozenset(Requirement(Kind.ARM, a) for a in arms), first, last)
    for violation in (*_contacts(scene, samples, points, arms), *_limits(part, samples, arms)):
        yield replace(
            violation,
            first=None if violation.first is None else min(violation.first + first, last),
            last=None if violation.last is None else min(violation.last + first, last),
        )


def _poses(samples: Samples, k: int) -> tuple[int, int]:
    """The poses at or between which sample ``k`` is."""
    step, fraction = int(samples.step[k]), float(samples.fraction[k])
    if fraction <= 0.0:
        return step, step
    return (step + 1, step + 1) if fraction >= 1.0 else (step, step + 1)


def _limits(cell: Cell, samples: Samples, arms: Sequence[int]) -> Iterator[Violation]:
    for a, arm, q in zip(arms, cell.arms, samples.joints, strict=True):
        for k, joint in np.argwhere(arm.limit_excess(q) > LIMITS):
            requirements = frozenset({Requirement(Kind.ARM, a), _limit(arm, a, int(joint))})
            yield Violation(requirements, *_poses(samples, int(k)))


def _contacts(
    scene: Scene, samples: Samples, points: Sequence[ArmSolution], arms: Sequence[int]
) -> Iterator[Violation]:
    """Pairs that are too near; each once for every set of requirements and poses."""
    model = scene.model
    if model is None:
        return
    b = model.bodies
    obstacles = {name.name: k for k, name in enumerate(scene.cell.surroundings.obstacles)}
    places = model.configure(scene.bases(points), samples.joints, samples.objects, samples.segments)
    margins = model.bounds(places, scene.movable) - scene.required
    seen: set[Violation] = set()
    for index in np.argsort(margins, axis=None, kind="stable")[:MOST_CONTACTS]:
        k, pair = (int(i) for i in np.unravel_index(index, margins.shape))
        if not margins[k, pair] < -KEPT:
            break
        check_stop()
        owners = (b.owners[b.first[pair]], b.owners[b.second[pair]])
        requirements = {requirement for owner in owners for requirement in _requirement_of(owner, arms)}
        kind = b.kinds[pair]
        if kind is PairClass.ARM_OBSTACLE:
            requirements.add(Requirement(Kind.OBSTACLE, obstacles[b.names[b.second[pair]]]))
        if kind is PairClass.SELF:
            requirements.add(Requirement(Kind.SELF))
        violation = Violation(frozenset(requirements), *_poses(samples, k))
        if violation not in seen and model.contact(places, k, pair).distance < scene.required[pair] - KEPT:
            seen.add(violation)
            yield violation


def _requirement_of(owner: Owner, arms: Sequence[int]) -> Iterator[Requirement]:
    if owner.arm is not None:
        yield Requirement(Kind.ARM, arms[owner.arm])
    if owner.part:
        yield Requirement(Kind.PART)
