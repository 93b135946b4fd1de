"""Bounds where the wrist of three parallel axes is in its singularity or near it: sound, and no longer empty."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.draws.singular_draw import members_near_curves, singular_boxes, singular_places, singular_problem
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.arm import Arm, BaseRegion, Interval
from duocell.optimizer.certificate.bounds.angles.pitch import pitch_cells
from duocell.optimizer.certificate.bounds.ball import Ball
from duocell.optimizer.certificate.bounds.box_bounds import BoxBounder
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.bounds.windings import nearest_windings
from duocell.optimizer.reduction.reduced import evaluate_signed, reduced_problem
from tests.support.given.arms import form_of
from tests.support.present import present

TRIALS, BOXES, SAMPLES = 5, 100, 16


@pytest.mark.parametrize("allow", [False, True], ids=["avoided", "allowed"])
@pytest.mark.parametrize(("name", "segments"), [("ur10e", 1), ("nova5", 1), ("ur5e", 2)])
def test_no_usable_path_near_a_singularity_scores_below_the_bound(name: str, segments: int, allow: bool) -> None:
    rng = np.random.default_rng([sum(map(ord, name)), segments, allow])
    usable, better = 0, 0.0
    for _ in range(TRIALS):
        problem = singular_problem(name, rng, allow, segments)
        boxes = singular_boxes(problem, rng, BOXES)
        lower = BoxBounder.of(problem).bounds(boxes, np.inf).lower
        best = np.full(BOXES, np.inf)
        for number in range(SAMPLES):
            paths = evaluate_signed(problem, members_near_curves(problem, boxes, rng, number % 2 == 0), boxes.signs)
            best = np.minimum(best, np.where(paths.violation[0] == 0.0, paths.objective[0], np.inf))
        assert np.all(lower <= best * (1.0 + 1e-9) + 1e-9)
        reached = np.isfinite(best)
        usable += int(np.sum(reached))
        better += float(np.sum(lower[reached] > 0.7 * best[reached]))
    assert usable > 30
    assert better > 0.4 * usable


@pytest.mark.parametrize("allow", [False, True], ids=["avoided", "allowed"])
def test_joints_of_places_in_a_box_are_in_one_of_its_parts(allow: bool) -> None:
    rng = np.random.default_rng(6)
    checked = 0
    for _ in range(6):
        problem = singular_problem("ur10e", rng, allow)
        kinematics = BoxBounder.of(problem).kinematics
        boxes = singular_boxes(problem, rng, 40)
        angles = kinematics.angles(kinematics.targets.local(boxes))
        pose = rng.integers(len(problem.positions), size=len(boxes))
        rule = 9e-4 if not allow else 0.0
        cells = pitch_cells(kinematics, boxes, angles, (np.arange(len(boxes)), pose), rule)
        paths = evaluate_signed(problem, members_near_curves(problem, boxes, rng, True), boxes.signs)
        joints = paths.joints[:, 0, np.arange(len(boxes)), pose][[1, 2, 3, 5]]
        good = (paths.missing[0] == 0.0) & (paths.singular[0] == 0.0)
        off = joints[..., None] - cells.values.centre
        off = np.abs(off - 2.0 * np.pi * np.round(off / (2.0 * np.pi)))
        inside = np.all(off <= cells.values.radius + 1e-7, axis=0) & cells.alive
        assert np.all(np.any(inside, axis=1)[good])
        checked += int(np.sum(good))
    assert checked > 20


def test_a_box_inside_the_singularity_holds_nothing_where_it_is_avoided() -> None:
    rng = np.random.default_rng(8)
    excluded = 0
    for _ in range(4):
        problem = singular_problem("ur10e", rng, False)
        places = singular_places(problem, rng, 200, farthest=-4.0)
        boxes = Boxes(places, np.full((200, 3), 1e-6), rng.integers(8, size=200))
        strict = BoxBounder.of(problem).bounds(boxes, np.inf).lower
        loose = replace(problem, arm=replace(problem.arm, avoid_singularities=True))
        singular = evaluate_signed(loose, places, boxes.signs).singular[0] > 5e-4
        reach = evaluate_signed(problem, places, boxes.signs).missing[0] == 0.0
        assert np.all(np.isinf(strict[singular & reach]))
        excluded += int(np.sum(singular & reach))
    assert excluded > 20


@pytest.mark.parametrize("name", ["puma560", "kr6_r900"])
def test_a_spherical_wrist_that_must_be_singular_is_excluded_where_it_is_avoided(name: str) -> None:
    rng, chain = np.random.default_rng(9), robot(name)
    side, form = Interval(-0.5, 0.5), form_of(chain)
    base = BaseRegion(side, side, side)
    for off in (0.0, 3e-4, -3e-4, 1.5e-3):
        joints = rng.uniform(np.maximum(chain.lower, -2.0), np.minimum(chain.upper, 2.0))
        joints[4] = form.wrist_zero + off
        pose = link_frames(chain, joints[None])[0, 6] @ chain.flange_placement
        arm = Arm(name, chain, np.eye(4), np.eye(4), base, chain.lower, chain.upper, joints, np.ones(6))
        bounds = []
        for avoid in (True, False):
            kept = replace(arm, avoid_singularities=avoid)
            problem = present(reduced_problem(Cell(Task(pose[None]), (kept,)), kept))
            boxes = Boxes(np.zeros((8, 3)), np.full((8, 3), 1e-7), np.arange(8))
            bounds.append(BoxBounder.of(problem).bounds(boxes, np.inf).lower)
        here = np.argmin(bounds[1])  # the posture that the pose was made with
        assert bounds[1][here] < 1e-3
        assert np.isinf(bounds[0][here]) == (abs(off) < 1e-3)


def test_the_nearest_lift_is_that_of_trying_them_all() -> None:
    rng = np.random.default_rng(2)
    for _ in range(200):
        lower = float(rng.uniform(-9.0, 3.0))
        upper, reference = lower + float(rng.uniform(0.1, 14.0)), float(rng.uniform(-7.0, 7.0))
        centre, radius = rng.uniform(-20.0, 20.0, 30), rng.choice([0.0, 0.2, 2.0], 30)
        found = nearest_windings(Ball(centre, radius), lower, upper, reference)
        values = centre[:, None] + radius[:, None] * np.linspace(-1.0, 1.0, 401)
        turns = values[..., None] + 2.0 * np.pi * np.arange(-8, 9)
        cost = np.where((turns >= lower) & (turns <= upper), (turns - reference) ** 2, np.inf).min(axis=(1, 2))
        assert np.all(found <= cost + 1e-9)
        exact = radius == 0.0
        np.testing.assert_allclose(found[exact], cost[exact], atol=1e-9)
