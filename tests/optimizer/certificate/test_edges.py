"""What is possible in one place only: missed by half of what counts as kept it is not denied, by far more it is."""

from __future__ import annotations

from dataclasses import replace
from typing import Unpack

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import Clearances
from duocell.models.cell.task import Task
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.kinematics.wrist_singularity import wrist_distance
from duocell.models.robot.arm import SINGULAR_WRIST, Arm, Interval
from duocell.models.robot.posture import ALL_SIGNS, Posture, Signs
from duocell.optimizer.certificate.cell_proof import prove_cell
from duocell.optimizer.certificate.certify import certify
from duocell.optimizer.infeasibility.immediate.immediate import immediate_infeasibility
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate, evaluate_signed, reduced_problem
from duocell.optimizer.settings import CertificateSettings
from duocell.optimizer.verification.scene import Scene
from tests.support.given.arms import make_arm, oblique_wrist, region
from tests.support.given.blocked import far_box, one_arm
from tests.support.given.fields import ArmChanges
from tests.support.given.tasks import way_of_joints
from tests.support.given.thesis import CELLS
from tests.support.present import present

KEPT, FAR = 5e-7, 1e-4
"""Of what is asked for: it counts as kept, and it does not."""
ROBOTS = ["puma560", "ur10e", "irb6700", "oblique"]
SEEDS = range(6)
MISSED = pytest.mark.parametrize("missed", [0.0, KEPT, FAR])


def impossible(problem: ReducedProblem) -> bool:
    """Whether a proof says so, within boxes that are more than enough."""
    return certify(problem, None, CertificateSettings(1e-3, 60.0, 4000)).infeasible


def stand(name: str, seed: int, poses: int = 1) -> tuple[ReducedProblem, Floats]:
    """A base that is fixed at the origin and does a task in one posture, and its joints (6, m)."""
    rng = np.random.default_rng([seed, sum(map(ord, name))])
    arm = make_arm(oblique_wrist() if name == "oblique" else name, base=region(0.0, 0.0, 0.0, 0.0))
    return at_joints(arm, way_of_joints(arm, rng, poses, 0.2))


def at_joints(arm: Arm, joints: Floats) -> tuple[ReducedProblem, Floats]:
    arm = replace(arm, avoid_singularities=False)
    cell = Cell(Task(flange_poses(arm.robot, joints)), (arm,), np.pi)
    problem = present(reduced_problem(cell, arm))
    assert problem is not None
    found = evaluate(problem, np.zeros((1, 3))).joints[:, :, 0]
    off = np.abs(found - joints.T[:, None])
    off = np.max(np.minimum(off % (2 * np.pi), -off % (2 * np.pi)), axis=(0, 2))
    signs = ALL_SIGNS[int(np.argmin(off))]
    assert np.min(off) < 1e-6
    own = replace(arm, posture=Posture(*signs))
    problem = present(reduced_problem(Cell(cell.task, (own,), np.pi), own))
    assert problem is not None
    return problem, joints.T


def changed(problem: ReducedProblem, **given: Unpack[ArmChanges]) -> ReducedProblem:
    return replace(problem, arm=replace(problem.arm, **given))


def narrowed(problem: ReducedProblem, joints: Floats, joint: int, missed: float) -> ReducedProblem:
    """With half a turn of room below the largest value of a joint, and less than none above."""
    own, upper = np.arange(6) == joint, np.max(joints[joint]) - missed
    arm = problem.arm
    lower = np.where(own, np.min(joints[joint]) - 1.0, arm.lower)
    return changed(problem, lower=lower, upper=np.where(own, upper, arm.upper))


@MISSED
@pytest.mark.parametrize("name", ROBOTS)
def test_limits(name: str, missed: float) -> None:
    for seed in SEEDS:
        problem, joints = stand(name, seed, poses=4)
        assert impossible(narrowed(problem, joints, seed, missed)) == (missed == FAR)


@pytest.mark.parametrize(("name", "gap"), [("line", 1e-3), ("line", 1e-4), ("arc", 1e-4)])
def test_gaps_close_where_a_limit_is_active(name: str, gap: float) -> None:
    arm = CELLS[name].arms[0]
    problem = present(reduced_problem(CELLS[name], arm))
    found = certify(problem, None, CertificateSettings(1e-3, 60.0)).found
    assert found is not None
    joints = evaluate_signed(problem, found.position[None], np.array([found.signs])).joints[:, 0, 0]
    upper = np.where(np.arange(6) == 2, np.max(joints[2]) - 0.05, arm.upper)
    proof = certify(changed(problem, upper=upper), None, CertificateSettings(gap, 60.0, 6000))
    assert proof.proved
    assert not proof.infeasible


@MISSED
@pytest.mark.parametrize("name", ROBOTS)
def test_steps(name: str, missed: float) -> None:
    for seed in SEEDS:
        problem, joints = stand(name, seed, poses=4)
        step = float(np.max(np.abs(np.diff(joints, axis=1))))
        assert impossible(replace(problem, max_step=step - missed)) == (missed == FAR)


@MISSED
@pytest.mark.parametrize("name", ROBOTS)
def test_corners_of_a_base_region(name: str, missed: float) -> None:
    """A joint is at its limit in a corner and beyond it everywhere else; the corner is moved inwards."""
    for seed in SEEDS:
        problem, joints = stand(name, seed)
        joint = seed % 3
        steps = 1e-6 * np.eye(3)[:2]
        moved = evaluate(problem, np.vstack([np.zeros(3), steps])).joints[joint, ALL_SIGNS.index(signs_of(problem)), :]
        slope = (moved[1:, 0] - moved[0, 0]) / 1e-6
        inwards = np.sign(slope)
        if np.max(np.abs(slope)) < 0.5:
            continue
        corner, opposite = inwards * missed, inwards * (missed + 5e-3)
        x, y = (Interval(float(a), float(b)) for a, b in np.sort([corner, opposite], axis=0).T)
        base = replace(problem.arm.base, x=x, y=y)
        tight = changed(narrowed(problem, joints, joint, 0.0), base=base)
        assert impossible(tight) == (missed == FAR)


def signs_of(problem: ReducedProblem) -> Signs:
    return next(signs for signs in ALL_SIGNS if problem.arm.posture.admits(signs))


@MISSED
@pytest.mark.parametrize("name", ROBOTS)
def test_reach_with_a_stretched_elbow(name: str, missed: float) -> None:
    for seed in SEEDS:
        problem, _ = stand(name, seed)
        posture, way = ALL_SIGNS.index(signs_of(problem)), np.array([np.cos(seed), np.sin(seed), 0.0])
        near, far = 0.0, 5.0
        for _ in range(60):
            middle = 0.5 * (near + far)
            reached = evaluate(problem, middle * way[None]).missing[posture, 0] == 0.0
            near, far = (middle, far) if reached else (near, middle)
        beyond = (near + missed) * way
        x, y = (Interval(float(v), float(v)) for v in beyond[:2])
        arm = problem.arm
        wide = changed(problem, base=replace(arm.base, x=x, y=y), lower=arm.lower - 7.0, upper=arm.upper + 7.0)
        violation = evaluate(wide, beyond[None]).missing[posture, 0]
        if missed == FAR and violation < 2e-5:
            continue  # nearly along the end of reach
        assert impossible(wide) == (missed == FAR)


@MISSED
@pytest.mark.parametrize("name", ["puma560", "ur10e", "irb6700"])
def test_wrists_at_the_end_of_their_singularity(name: str, missed: float) -> None:
    for seed in SEEDS:
        problem, joints = stand(name, seed)
        side = 1.0 if seed % 2 else -1.0
        at = joints.T.copy()
        at[:, 4] = problem.form.wrist_zero + side * (SINGULAR_WRIST - missed)
        problem, joints = at_joints(problem.arm, at)
        distance = np.min(wrist_distance(problem.form.wrist_zero, joints[4]))
        assert distance == pytest.approx(SINGULAR_WRIST - missed, abs=1e-12)
        assert impossible(changed(problem, avoid_singularities=True)) == (missed == FAR)


@MISSED
@pytest.mark.parametrize("name", ROBOTS)
def test_conditioning(name: str, missed: float) -> None:
    for seed in SEEDS:
        problem, joints = stand(name, seed, poses=3)
        arm = problem.arm
        values = conditioning(arm.robot, arm.tool, joints.T, characteristic_length(arm.robot))
        assert impossible(changed(problem, min_conditioning=float(np.min(values)) + missed)) == (missed == FAR)


def fixed_beside_a_box(required: float) -> tuple[Cell, float]:
    """An arm on the floor beside a low box, and by how much the best posture violates the distance asked for."""
    box = Body("box", transform(np.eye(3), [-0.6, -0.5, 0.05]), Box(np.array([0.2, 0.2, 0.1])))
    cell = one_arm(base=region(-0.3, -0.5, 0.0, 0.3), obstacles=(box,))
    cell = replace(cell, surroundings=replace(cell.surroundings, clearances=Clearances(arm_obstacle=required)))
    problem = present(reduced_problem(cell, cell.arms[0]))
    place = np.array([-0.3, -0.5, 0.0])
    paths = evaluate(problem, place[None])
    points = [
        ArmSolution(place, 0.3, paths.joints[:, k, 0].T, ALL_SIGNS[k])
        for k in np.flatnonzero(paths.violation[:, 0] == 0.0)
    ]
    return cell, float(np.min(Scene.of(cell).contact_violations([[point] for point in points])))


@MISSED
def test_clearances_of_a_base(missed: float) -> None:
    asked = 0.3
    cell, violation = fixed_beside_a_box(asked)
    assert 0.0 < violation < asked
    cell, _ = fixed_beside_a_box(asked - violation + missed)
    problems = [problem for arm in cell.arms if (problem := reduced_problem(cell, arm)) is not None]
    proof = prove_cell(Scene.of(cell), problems, [], CertificateSettings(1e-3, 60.0, 300))
    assert proof.infeasible == (missed == FAR)


@MISSED
def test_margins_of_a_floor(missed: float) -> None:
    """The base stands in the corner of the allowed floor where it can reach: fixed half a metre from its edges."""
    cell = one_arm(base=region(-0.3, -0.5, 0.0, 0.3), obstacles=(far_box(),))
    allowed = np.array([[-0.8, -1.0], [3.0, -1.0], [3.0, 3.0], [-0.8, 3.0]])
    radius = Scene.of(cell).footprints[0].radius
    cell = replace(cell, surroundings=replace(cell.surroundings, floor=Floor(allowed, (), 0.5 - radius + missed)))
    problems = [problem for arm in cell.arms if (problem := reduced_problem(cell, arm)) is not None]
    proof = prove_cell(Scene.of(cell), problems, [], CertificateSettings(1e-3, 60.0, 300))
    assert proof.infeasible == (missed == FAR)
    assert bool(immediate_infeasibility(cell)) == (missed == FAR)
