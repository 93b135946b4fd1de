"""What a layout is like, and what its neighbourhood is like to first order."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from duocell.models.cell.surroundings import PairClass
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.cell_rows import add_contacts, add_floor, add_ties
from duocell.optimizer.sqp.dips import followed_dips
from duocell.optimizer.sqp.joint_rows import add_joint_rows
from duocell.optimizer.sqp.linear_rows import LinearRows, RowCollector
from duocell.optimizer.sqp.manifold import Directions, Unknowns, directions
from duocell.optimizer.sqp.samples import sample_path
from duocell.optimizer.verification.scene import Scene


@dataclass(frozen=True, eq=False, slots=True)
class Linearisation:
    """A layout with its figures, and what is near to be violated as linear rows.

    Attributes:
        points: one per arm. objective: E. rows: of all that is near to be violated.
        along: per arm, its directions at the poses.
        followed: False where an arm cannot follow the object between the poses.
    """

    points: tuple[ArmSolution, ...]
    objective: float
    rows: LinearRows
    along: tuple[Directions, ...]
    followed: bool

    @property
    def violation(self) -> float:
        """The largest violation of anything [m or rad]; <= 0 if there is none."""
        return self.rows.violation


def linearise(
    scene: Scene, unknowns: Unknowns, points: Sequence[ArmSolution], margins: Mapping[PairClass, float]
) -> Linearisation:
    """Measure a layout and linearise what is near to be violated.

    Args:
        scene: the cell. unknowns: its layouts'. points: one per arm.
        margins: m, what to ask for beyond the required distance of a class.
    """
    bases = scene.bases(points)
    samples = sample_path(scene.cell, scene.path, bases, points, (*scene.between, *followed_dips(scene, points)))
    along = [
        directions(arm, base[:3, :3], q) for arm, base, q in zip(scene.cell.arms, bases, samples.joints, strict=True)
    ]
    rows = RowCollector(unknowns, samples, along)
    for a, point in enumerate(points):
        add_joint_rows(rows, scene, a, point)
    add_floor(rows, scene, points)
    add_ties(rows, scene, points)
    if scene.model is not None:
        places = scene.model.configure(bases, samples.joints, samples.objects, samples.segments)
        add_contacts(rows, scene, places, bases, margins)
    at_poses = tuple(Directions(of_arm.by_base[samples.poses], of_arm.by_nullspace[samples.poses]) for of_arm in along)
    return Linearisation(tuple(points), scene.objective(points), rows.rows(), at_poses, samples.followed)
