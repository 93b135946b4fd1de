"""The form in which a cell is searched does not depend on the order in which it was written down."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from bench.draws.images import moved, reversed_arms, reversed_obstacles, reversed_poses
from duocell.models.base.pose import rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Mirror, SameHeight
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import Clearances, Surroundings
from duocell.models.cell.task import Task, line
from duocell.models.geometry.shapes import Body, Box
from duocell.optimizer.coupled.canonical import CanonicalForm
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.optimize import optimize
from duocell.optimizer.settings import Settings
from tests.support.given.arms import make_arm, region
from tests.support.present import present

WEIGHTS = np.array([1.0, 2.0, 1.0, 1.0, 0.5])


def cell(task: Task | None = None) -> Cell:
    """Two tied arms, two obstacles, a floor with two pits; two segments."""
    way = line(transform(np.eye(3), [0.0, 0.0, 0.3]), transform(rotation_z(0.2), [0.3, 0.4, 0.6]), 5)
    arms = tuple(
        make_arm("ur10e", name, region((-1.4, 1.6), (-1.3, 1.7)), grasp=transform(np.eye(3), [x, 0.0, 0.15]))
        for name, x in (("main", -0.5), ("follower", 0.5))
    )
    obstacles = tuple(
        Body(name, transform(np.eye(3), [x, 3.0, 0.0]), Box(np.ones(3))) for name, x in (("b", 1), ("a", 2))
    )
    pits = tuple(np.array([[k, 0], [k + 1, 0], [k + 1, 1.0]]) for k in (6, 5))
    around = Surroundings(obstacles, floor=Floor(None, pits, 0.0), clearances=Clearances(arm_obstacle=0.01))
    ties = SameHeight((0, 1)), Mirror((0, 1), (0.0, 0.0), 0.3)
    return Cell(
        replace(way, starts=(0, 3), names=("one", "two"), weights=WEIGHTS) if task is None else task,
        arms,
        surroundings=around,
        couplings=ties,
    )


IMAGES = {
    "poses": reversed_poses,
    "arms": reversed_arms,
    "obstacles": reversed_obstacles,
    "all": lambda given: reversed_poses(reversed_arms(reversed_obstacles(given))),
}


@pytest.mark.parametrize("image", IMAGES.values(), ids=IMAGES.keys())
def test_images_have_one_form(image: Callable[[Cell], Cell]) -> None:
    one, other = CanonicalForm.of(cell()).cell, CanonicalForm.of(image(cell())).cell
    assert [arm.name for arm in one.arms] == [arm.name for arm in other.arms]
    assert [tie.arms for tie in one.couplings] == [tie.arms for tie in other.couplings]
    assert [body.name for body in one.surroundings.obstacles] == [body.name for body in other.surroundings.obstacles]
    for first, second in zip(
        present(one.surroundings.floor).forbidden, present(other.surroundings.floor).forbidden, strict=True
    ):
        assert np.array_equal(first, second)
    assert np.array_equal(one.task.poses, other.task.poses)
    assert np.array_equal(one.task.weights, other.task.weights)
    assert (one.task.starts, one.task.names) == (other.task.starts, other.task.names)


def test_the_direction_is_the_same_wherever_the_task_is() -> None:
    for task in (cell().task, line(np.eye(4), transform(np.eye(3), [0.5, 0.0, 0.0]), 4)):
        forms = [CanonicalForm.of(moved(cell(task), k, np.array([3.0, -7.0, 1.0]))) for k in range(4)]
        assert len({form.backwards for form in forms}) == 1
        assert {CanonicalForm.of(reversed_poses(cell(task))).backwards} != {form.backwards for form in forms}


@pytest.mark.parametrize("image", IMAGES.values(), ids=IMAGES.keys())
def test_layouts_come_back_as_they_went(image: Callable[[Cell], Cell]) -> None:
    given = image(cell())
    form = CanonicalForm.of(given)
    points = [
        ArmSolution(np.full(3, float(a)), float(a), np.arange(30.0).reshape(5, 6) + a, (1, 1, 1))
        for a in range(len(given.arms))
    ]
    there = form.into(points)
    for arm, point in zip(form.cell.arms, there, strict=True):
        number = [one.name for one in given.arms].index(arm.name)
        assert point.yaw == points[number].yaw
        for pose, joints in zip(form.cell.task.poses, point.joints, strict=True):
            place = [np.array_equal(pose, other) for other in given.task.poses].index(True)
            assert np.array_equal(joints, points[number].joints[place])
    for point, same in zip(points, form.back(there), strict=True):
        assert np.array_equal(point.joints, same.joints)
        assert np.array_equal(point.position, same.position)


def test_a_coupled_cell_written_down_the_other_way_round_has_the_same_answer() -> None:
    given = replace(cell(), surroundings=Surroundings(), couplings=(Mirror((0, 1), (0.1, 0.0), 1.2),))
    settings = Settings(certificate=None, time_limit=300.0)
    first, second = (optimize(one, settings) for one in (given, reversed_poses(reversed_arms(given))))
    assert first.usable
    assert second.objective == pytest.approx(first.objective, rel=1e-9)
    assert {p.arm: p.yaw for p in first.placements} == pytest.approx({p.arm: p.yaw for p in second.placements})
