"""Where between two poses an arm comes nearest to a singular set, against a dense sample of the step."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.trials.coupled_tasks import coupled_task
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse
from duocell.models.cell.singular_margins import margin_terms
from duocell.optimizer.clearance.path_samples import follow
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.dips import NEAR, dips, followed_dips
from duocell.optimizer.verification.scene import Scene
from tests.support.given.witness import signs_at

FINE = np.linspace(0.0, 1.0, 301)


def known_layout() -> tuple[Scene, list[ArmSolution]]:
    """A cell of two arms and the layout that was drawn with it."""
    task = coupled_task(9)
    points = []
    for arm, stand, joints in zip(task.cell.arms, task.known.stands, task.known.joints, strict=True):
        points.append(ArmSolution(stand[:3], float(stand[3]), joints, signs_at(arm.robot, joints[0])))
    return Scene.of(task.cell), points


def margin_along(scene: Scene, index: int, point: ArmSolution, step: int) -> Floats:
    """(301,) the least margin term on a step, the arm followed by Newton's method from place to place."""
    arm, q = scene.cell.arms[index], point.joints[step]
    base = arm.base_in_world(point.position, point.yaw)
    objects = scene.path.at(np.full(len(FINE), step), FINE)
    found = []
    for flange in objects @ scene.cell.grasps(arm)[step] @ inverse(arm.tool):
        joints, good = follow(arm.robot, base, flange[None], q[None], q[None])
        assert good.all()
        q = joints[0]
        found.append(float(np.min(margin_terms(arm, q))))
    return np.array(found)


Case = tuple[Scene, list[ArmSolution], dict[tuple[int, int], Floats]]


@pytest.fixture(scope="module")
def case() -> Case:
    """A scene, its layout, and the margins on every step of every arm."""
    scene, points = known_layout()
    steps = range(len(scene.cell.task) - 1)
    return scene, points, {(a, k): margin_along(scene, a, points[a], k) for a in range(len(points)) for k in steps}


def test_a_dip_is_found_again_from_beside_it(case: Case) -> None:
    scene, points, margins_of = case
    looked_at = 0
    for (index, step), margin in margins_of.items():
        for k in np.flatnonzero((margin[1:-1] < margin[:-2]) & (margin[1:-1] < margin[2:])) + 1:
            beside = float(np.clip(FINE[k] + 0.3 * NEAR, 0.01, 0.99))
            ((found_step, fraction),) = followed_dips(replace(scene, dips=((index, step, beside),)), points)
            around = margin[np.abs(FINE - fraction) <= 4e-3]
            assert found_step == step
            assert np.min(around) <= np.min(margin[np.abs(FINE - beside) <= NEAR]) + 1e-6
            looked_at += 1
    assert looked_at > 0


def test_a_way_that_keeps_its_margins_has_no_dips_to_be_asked_for(case: Case) -> None:
    scene, points, margins_of = case
    for (index, step), margin in margins_of.items():
        assert (min(margin) < 0.0) == bool(dips(scene, index, points[index], step))
