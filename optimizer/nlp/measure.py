"""From a point of the program to a placement: what a user reads about one arm."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.catalogue.links import provenance
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import path_signs, posture_terms
from duocell.models.kinematics.closed_form import ClosedForm
from duocell.models.kinematics.kinematics import characteristic_length, conditioning
from duocell.models.kinematics.nominal import posture_form, singular_fifth
from duocell.models.kinematics.wrist_singularity import wrist_distance
from duocell.models.objective.measure import Measure
from duocell.models.objective.registry import MEASURES
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import name_signs
from duocell.models.robot.robot import Robot
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.layout import SegmentShare
from duocell.optimizer.results.measured import Measured, TermShare
from duocell.optimizer.results.placement import Displacement, Placement


def joint_margins(arm: Arm, joints: Floats) -> Floats:
    """(n,) rad or m, smallest distance of each joint (m, n) to its limits; infinite for joints without limits."""
    margins: Floats = np.minimum(np.min(joints, axis=0) - arm.lower, arm.upper - np.max(joints, axis=0))
    return margins


def linear_margins(arm: Arm, joints: Floats) -> tuple[tuple[str, float], ...]:
    """Of every linear limit its name, and rad, the smallest distance of its sum to either end along a path (m, n)."""
    margins = -np.max(arm.limit_excess(joints)[:, arm.dof :], axis=0)
    return tuple(zip(arm.bounded_names[arm.dof :], map(float, margins), strict=True))


def largest_steps(task: Task, joints: Floats) -> Floats:
    """(n,) rad or m, largest change of each joint (m, n) between consecutive poses of a segment."""
    steps: Floats = np.max(np.abs(np.diff(joints, axis=0)[task.joined]), axis=0, initial=0.0)
    return steps


def largest_step(task: Task, robot: Robot, joints: Floats) -> float:
    """rad, largest change of any revolute joint (m, n) between consecutive poses of a segment."""
    return float(np.max(largest_steps(task, joints), where=~robot.prismatic, initial=0.0))


def step_excess(cell: Cell, arm: Arm, joints: Floats) -> float:
    """rad or m, by how much a step of some joint (m, n) is longer than it may be; negative: what is left."""
    return float(np.max(largest_steps(cell.task, joints) - cell.step_limits(arm.robot)))


def objective_of(cell: Cell, arm: Arm, joints: Floats) -> float:
    """What one arm contributes to the objective of a cell, from joint values (m, n) rad."""
    return cell.objective.of_path(arm, joints, cell.task.weights)


def segment_shares(cell: Cell, placements: Sequence[Placement]) -> tuple[SegmentShare, ...]:
    """What each segment of the task contributes; without objective where an arm has no placement."""
    arms = {arm.name: arm for arm in cell.arms}
    complete = len(placements) == len(arms)
    shares = []
    for index, segment in enumerate(cell.task.segments):
        task = cell.task.alone(index)
        costs = [cell.objective.of_path(arms[found.arm], found.joints[segment], task.weights) for found in placements]
        weight = float(np.max(task.weights))
        shares.append(SegmentShare(task.names[0], segment.start, len(task), weight, sum(costs) if complete else None))
    return tuple(shares)


def placed(cell: Cell, arm: Arm, point: ArmSolution) -> Placement:
    """All figures of one arm of a cell at a point."""
    form = posture_form(arm.robot)
    length = characteristic_length(arm.robot)
    margins = joint_margins(arm, point.joints)
    return Placement(
        arm=arm.name,
        position=point.position,
        yaw=arm.base.yaw_in_interval(point.yaw),
        joints=point.joints,
        posture=None if form is None else name_signs(point.signs or path_signs(form, point.joints)),
        objective=objective_of(cell, arm, point.joints),
        joint_margins=margins,
        minimum_margin=float(np.min(margins, where=~arm.robot.prismatic, initial=np.inf)),
        minimum_conditioning=float(np.min(conditioning(arm.robot, arm.tool, point.joints, length))),
        characteristic_length=length,
        singularity_distances={} if form is None else _singularity_distances(arm, form, point.joints),
        mount=arm.mount,
        joint_kinds=arm.robot.joint_kinds,
        avoids_singularities=arm.avoid_singularities,
        linear_margins=linear_margins(arm, point.joints),
        mounting_face=None if arm.robot.mounting_face is None else arm.robot.mounting_face.pose,
        geometry=provenance(cell.surroundings.links(arm)),
        measures=tuple(_measured(measure, arm, point.joints) for measure in MEASURES.values()),
        terms=tuple(
            TermShare(
                term.measure.name,
                term.weight,
                term.measure.cost_unit,
                float(cell.task.weights @ term.measure.costs(arm, point.joints)),
            )
            for term in cell.objective.terms
        ),
        displacement=_displacement(cell, arm, point),
    )


def _displacement(cell: Cell, arm: Arm, point: ArmSolution) -> Displacement | None:
    """What was chosen of what the poses leave open."""
    freedom = cell.freedom(arm)
    if freedom.exact:
        return None
    values = freedom.nominal if point.free is None else point.free
    return Displacement(freedom.names, values, cell.task.poses @ cell.grasps(arm, values))


def _measured(measure: Measure, arm: Arm, joints: Floats) -> Measured:
    values = measure.values(arm, joints)
    return Measured(measure.name, measure.unit, *(float(f(values)) for f in (np.min, np.mean, np.max)))


def _singularity_distances(arm: Arm, form: ClosedForm, joints: Floats) -> dict[str, float]:
    """Smallest distance to each singular set: shoulder [m], elbow and wrist [rad] (0 = singular, π/2 = farthest)."""
    front, elbow, _ = posture_terms(form, joints.T, np.sin, np.cos)
    singular = singular_fifth(arm.robot)
    return {
        "shoulder": float(np.min(np.abs(front))),
        "elbow": float(np.min(np.arcsin(np.minimum(np.abs(elbow), 1.0)))),
        "wrist": float(np.min(wrist_distance(form.wrist_zero if singular is None else singular, joints[:, 4]))),
    }
