"""The tree of one arm: bounds below what is possible and above what knows of no obstacles; empty where nothing is."""

from __future__ import annotations

import numpy as np

from bench.draws.cells import real_cell
from duocell.optimizer.certificate.arm_tree import ArmTree
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.reduction.reduced import ReducedProblem, reduced_problem
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.verification.scene import Scene, alone_scene, own_violations
from duocell.optimizer.verification.verify import check
from tests.support.present import present


def _tree(seed: int, index: int) -> tuple[ArmTree, Scene, ReducedProblem]:
    cell = real_cell(seed).cell
    problem = present(reduced_problem(cell, cell.arms[index]))
    scene = Scene.of(cell)
    return ArmTree(scene, index, problem), scene, problem


def test_obstacles_raise_the_bound_up_to_a_layout_that_is_usable() -> None:
    tree, scene, problem = _tree(8, 0)
    while tree.lower < 0.98 * tree.alone_objective and tree.boxes < 4000:
        assert tree.work_off(tree.alone_objective)
    free = certify(problem, None, CertificateSettings(gap=0.01, time_limit=60.0, boxes=4000))
    assert free.objective is not None
    assert tree.lower > 2.0 * free.objective
    assert tree.alone is not None
    assert tree.lower <= tree.alone.objective < 1.03 * tree.lower
    arm, point = problem.arm, tree.alone.point
    assert check(scene.cell, arm, point).usable
    assert own_violations(alone_scene(scene.cell, arm), [point])[0] <= 0.0


def test_an_arm_behind_a_wall_has_no_box_left() -> None:
    tree, _, _ = _tree(93, 0)
    while tree.boxes < 400 and tree.work_off(np.inf, by_size=True):
        pass
    assert tree.empty
    assert np.isinf(tree.lower)
    tree.nodes.settle()
    assert np.all(tree.nodes.code[tree.nodes.roots] > 0)
    kinds = {tree.excluder.causes.all[code].kind for code in tree.nodes.code[tree.nodes.leaves()]}
    assert "obstacle" in kinds
    assert tree.alone is None


def test_a_cause_that_is_left_out_excludes_nothing() -> None:
    tree, _, _ = _tree(93, 0)
    walls = {code for code, cause in enumerate(tree.excluder.causes.all) if cause.kind == "obstacle"}
    tree.levels = dict.fromkeys(walls, -np.inf)
    while tree.boxes < 60:
        tree.work_off(np.inf, by_size=True)
    assert tree.alone is None  # the check still knows the wall
    assert not tree.empty
    assert not set(tree.nodes.code.tolist()) & walls
