"""Where slivers may hold something better, boxes are looked at after the local solves, once."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np

from bench.random_arms.draw import draw
from bench.trials.acceptance_search import case
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.wrist_singularity import wrist_distance
from duocell.optimizer.coupled.found import CoupledSearch
from duocell.optimizer.coupled.prove import prove
from duocell.optimizer.reduction.box import search_box
from duocell.optimizer.settings import CertificateSettings, Settings
from duocell.optimizer.single_arm.arm_search import ArmSearch
from duocell.optimizer.single_arm.doubt import at_limit, in_doubt
from duocell.optimizer.single_arm.search import search_arm
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.verify import check
from tests.support.present import present


def searched(cell: Cell) -> ArmSearch:
    return search_arm(cell, cell.arms[0], Settings(certificate=None), time.perf_counter() + 600.0)


def test_a_sliver_between_wide_joint_steps_is_found_and_its_boxes_are_not_bounded_twice() -> None:
    """A base 16 mm aside costs 1 % less, beside a singular wrist and at the largest joint step."""
    cell = draw("random", 145)
    found = searched(cell)
    assert found.objective < 55.8625
    assert check(cell, cell.arms[0], present(found.best)).usable
    assert check_arm_path(cell, cell.arms[0], present(found.best)).free
    boxes = present(found.tree).boxes
    proof = prove(cell, [found], CoupledSearch(), CertificateSettings(0.02, 60.0), lambda _, __: None)
    assert proof.proved
    assert proof.boxes <= boxes + 500
    assert present(found.objective) * 0.98 <= present(proof.lower_bound) <= present(found.objective)


def test_bases_about_an_answer_with_a_joint_at_its_limit_are_looked_at() -> None:
    """The local solver ends at 235.63 with joint 1 at its limit; 3 mm aside, on another turn of a joint, less will do.

    At the best base the last pose stretches the elbow, where the way ends.
    """
    cell = case("miss_dwell_34 alone").cell
    found = searched(cell)
    assert found.objective < 1.001 * 230.627582
    assert check_arm_path(cell, cell.arms[0], present(found.best)).free


def test_nothing_is_in_doubt_in_the_midst_of_what_is_allowed() -> None:
    cell = draw("random", 214)
    arm, found = cell.arms[0], searched(cell)
    assert found.tree is None
    problem, box, joints = present(found.problem), search_box(cell, arm), present(found.best).joints
    assert not at_limit(cell, problem, present(found.best))
    assert not in_doubt(cell, problem, box, present(found.best), found.objective)
    close = replace(cell, max_joint_step=float(np.max(np.abs(np.diff(joints, axis=0)))))
    assert at_limit(close, problem, present(found.best))
    assert in_doubt(close, problem, box, present(found.best), found.objective)
    assert not in_doubt(close, problem, box, present(found.best), 0.9 * found.objective)
    assert not in_doubt(close, problem, np.repeat(box[:, :1], 2, axis=1), present(found.best), found.objective)
    singular = joints.copy()
    singular[0, 4] = problem.form.wrist_zero + 0.04
    assert wrist_distance(problem.form.wrist_zero, singular[:1, 4]) < 0.05
    assert in_doubt(cell, problem, box, replace(present(found.best), joints=singular), np.inf)
