"""Clearances of task sequences: every segment is looked at by itself, with the part as its own grasps leave it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.models.cell.task import Task
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.shapes import Body, Sphere
from duocell.optimizer.clearance.clearance import PathClearance, check_clearance
from duocell.optimizer.evaluation.evaluate import evaluate_layout
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.sqp.samples import sample_path
from duocell.optimizer.verification.scene import Scene as CoupledScene
from tests.support.given.arms import only_at, region
from tests.support.given.cells import ALL, Scene, beam_pair
from tests.support.oracles.answers import assert_sound
from tests.support.present import present

SCENE = beam_pair(count=6)
SHIFT = transform(rotation_z(0.1), [0.15, 0.0, 0.0])
"""Along the beam."""
WAY = 0.0, 0.0, -0.36
"""m, downwards in three long steps."""


def in_two_segments(scene: Scene, regripped: bool = False) -> Scene:
    """The same way cut in two; in the second segment the beam may lie in the hands in another place."""
    poses, arms = scene.cell.task.poses.copy(), scene.cell.arms
    if regripped:
        poses[3:] = poses[3:] @ SHIFT
        arms = tuple(replace(arm, grasps=np.array([arm.grasp, inverse(SHIFT) @ arm.grasp])) for arm in arms)
    task = task_sequence([TaskSegment("a", Task(poses[:3])), TaskSegment("b", Task(poses[3:]))])
    return replace(scene, cell=replace(scene.cell, task=task, arms=arms))


def clearance_of(scene: Scene, cell: Cell, joints: list[Floats]) -> PathClearance:
    model = CollisionModel(cell.arms, scene.surroundings)
    return check_clearance(cell, model, ALL, scene.bases, joints)


@pytest.mark.parametrize("regripped", [False, True])
def test_a_task_sequence_keeps_what_its_segments_keep(regripped: bool) -> None:
    scene = in_two_segments(SCENE, regripped)
    both = clearance_of(scene, scene.cell, scene.joints)
    alone = [
        clearance_of(scene, scene.cell.alone(k), [q[segment] for q in scene.joints])
        for k, segment in enumerate(scene.cell.task.segments)
    ]
    assert both.samples == sum(one.samples for one in alone)
    assert not both.breaks
    for found, *own in zip(both.classes, *(one.classes for one in alone), strict=True):
        assert found.distance == pytest.approx(min(one.distance for one in own), abs=1e-9)
        assert found.lower_bound == pytest.approx(min(one.lower_bound for one in own), abs=1e-9)
        nearest = int(np.argmin([one.distance for one in own]))
        start = scene.cell.task.starts[nearest]
        assert found.pose + found.fraction == pytest.approx(start + own[nearest].pose + own[nearest].fraction, abs=1e-9)


def test_what_may_be_touched_moves_with_the_grasp() -> None:
    """Where the hands are in one segment is forbidden in the other."""
    scene = in_two_segments(SCENE, regripped=True)
    model = CollisionModel(scene.cell.arms, scene.surroundings)
    poses = scene.cell.task.poses
    for k, segment in ((0, 0), (4, 1)):
        contacts = [model.contacts(scene.bases, [q[k] for q in scene.joints], poses[k], other) for other in (0, 1)]
        own, others = (contacts[k][PairClass.ARM_PART].distance for k in (segment, 1 - segment))
        assert own > others + 0.01


def test_nothing_is_in_the_way_from_segment_to_segment() -> None:
    poses = beam_pair(count=4, shift=WAY).cell.task.poses
    middle = 0.5 * (poses[2, :3, 3] + poses[3, :3, 3])
    bead = Body("bead", transform(np.eye(3), middle), Sphere(0.01))
    scene = beam_pair(count=4, obstacles=(bead,), shift=WAY)
    whole = clearance_of(scene, scene.cell, scene.joints)
    cut = in_two_segments(scene)
    segments = clearance_of(cut, cut.cell, scene.joints)
    part = [next(found for found in one.classes if found.kind == "part_obstacle") for one in (whole, segments)]
    assert part[0].distance < 0.0 < part[1].distance


def test_samples_leave_out_the_way_from_segment_to_segment() -> None:
    scene = in_two_segments(SCENE, regripped=True)
    cell = replace(scene.cell, surroundings=scene.surroundings)
    points = [ArmSolution(base[:3, 3], np.pi / 2, q) for base, q in zip(scene.bases, scene.joints, strict=True)]
    samples = sample_path(cell, CoupledScene.of(cell).path, scene.bases, points)
    assert samples.followed
    between = (samples.fraction > 0.0) & (samples.fraction < 1.0)
    assert 2 not in samples.step[between]
    assert set(samples.step[between]) == {0, 1, 3, 4}
    assert samples.segments.tolist() == (samples.step + samples.fraction >= 3.0).astype(int).tolist()
    for q, joints in zip(samples.joints, scene.joints, strict=True):
        assert np.array_equal(q[samples.fraction == 0.0], joints[:-1])


def test_a_coupled_task_sequence_is_solved_and_its_layout_scored_alike() -> None:
    """Clean in every segment; the same figures when the layout is given."""
    scene = in_two_segments(SCENE, regripped=True)
    arms = [
        replace(arm, base=region(base[0, 3] + np.array([-0.2, 0.2]), base[1, 3] + np.array([-0.2, 0.2]), base[2, 3]))
        for arm, base in zip(scene.cell.arms, scene.bases, strict=True)
    ]
    cell = replace(scene.cell, arms=tuple(arms), surroundings=replace(scene.surroundings, clearances=ALL))
    layout = optimize(cell)
    assert_sound(cell, layout)
    assert {one.kind for one in layout.clearances} == {"arm_arm", "arm_part", "arm_obstacle", "part_obstacle", "self"}
    assert all(one.distance >= one.required for one in layout.clearances)
    placed = [
        replace(arm, base=only_at(found.position, found.yaw))
        for arm, found in zip(arms, layout.placements, strict=True)
    ]
    given = replace(cell, arms=tuple(placed))
    scored = evaluate_layout(given, [found.joints for found in layout.placements])
    assert scored.outcome is Outcome.FEASIBLE
    assert scored.objective == pytest.approx(layout.objective, rel=1e-9)
    assert [segment.objective for segment in scored.segments] == pytest.approx(
        [segment.objective for segment in layout.segments], rel=1e-9
    )
    for k in (0, 1):
        alone = evaluate_layout(given.alone(k), [found.joints[given.task.segments[k]] for found in layout.placements])
        assert alone.outcome is Outcome.FEASIBLE
        assert alone.objective == pytest.approx(scored.segments[k].objective, rel=1e-9)
    searched = evaluate_layout(given)
    assert present(searched.objective) <= present(layout.objective) * (1.0 + 1e-6)
