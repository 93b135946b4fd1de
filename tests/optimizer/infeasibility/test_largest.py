"""The largest clearance that an arm can keep: kept by what was found, beyond every sample's by what was proved."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.draws.cells import real_cell
from duocell.models.cell.surroundings import PairClass
from duocell.models.robot.posture import ALL_SIGNS
from duocell.optimizer.certificate.alone import AloneCheck
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.largest import largest_clearance
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import evaluate_signed, reduced_problem
from tests.support.present import present

KIND = PairClass.ARM_OBSTACLE


def distance(check: AloneCheck, point: ArmSolution) -> float:
    model, task = present(check.scene.model), check.cell.task
    places = model.configure(check.scene.bases([point]), [point.joints], task.poses, task.segment_of)
    return present(model.closest(places, KIND))[1].distance


def test_what_is_found_is_kept_and_no_sample_keeps_more_than_the_bound() -> None:
    cell = real_cell(87).cell
    around = cell.surroundings
    cell = replace(cell, surroundings=replace(around, clearances=replace(around.clearances, arm_obstacle=0.0)))
    index = 0
    largest = present(largest_clearance(cell, index, KIND, 1e-3, Effort(100.0, np.inf)))
    arm = cell.arms[index]
    check, problem = AloneCheck.of(cell, arm), present(reduced_problem(cell, arm))
    assert check.usable(present(largest.point))
    assert abs(distance(check, present(largest.point)) - present(largest.found)) < 1e-9
    assert present(largest.found) <= present(largest.bound) <= present(largest.found) + 1e-3 + 1e-12
    rng = np.random.default_rng(0)
    near = present(largest.point).position + rng.uniform(-0.05, 0.05, (60, 3)) * (
        np.ptp(arm.base.bounds[:3], axis=1) > 0.0
    )
    for signs in ALL_SIGNS:
        paths = evaluate_signed(problem, near, np.tile(signs, (60, 1)))
        for k in np.flatnonzero(paths.violation[0] <= 1e-9):
            point = ArmSolution(near[k], float(paths.yaw[0, k]), paths.joints[:, 0, k].T, signs)
            if check.usable(point):
                assert distance(check, point) <= largest.bound + 2e-6
