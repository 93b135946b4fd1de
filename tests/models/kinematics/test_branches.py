"""The vectorised closed forms against ssik, Pinocchio, the source's own formulas and their own claims."""

from __future__ import annotations

from functools import cache
from math import pi

import casadi as ca
import numpy as np
import pytest
import ssik
from hypothesis import assume, given
from hypothesis import strategies as st

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_angle
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.dh import DhRow, robot_from_dh
from duocell.models.kinematics.branches import posture_of, posture_terms, signs_of, solve_branches, solve_signed
from duocell.models.kinematics.inverse import REACHED
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.robot.posture import ALL_SIGNS, Signs
from duocell.models.robot.robot import Robot
from tests.support.angles import same_set, wrapped
from tests.support.given.arms import form_of, random_joints
from tests.support.given.classes import CLOSED
from tests.support.oracles import puma

SIGNS = np.array(ALL_SIGNS)
ROUNDED = {"hh020", "fanuc_m710ic"}
"""Arms whose data are rounded: their axes meet only to about 1e-7 m."""


def tolerance(name: str) -> float:
    return 1e-6 if name in ROUNDED else 1e-9


def solved(robot: Robot, poses: Floats) -> tuple[Floats, Floats, Floats]:
    """Joints (8, m, 6), missing (8, m), FK of every branch (8, m, 4, 4)."""
    found = solve_branches(form_of(robot), poses[:, :3, :3], poses[:, :3, 3])
    joints = np.moveaxis(found.joints, 0, -1)
    return joints, found.missing, flange_poses(robot, joints.reshape(-1, 6)).reshape(8, -1, 4, 4)


@cache
def poses_of(name: str) -> Floats:
    """Flange poses in the base frame: reachable ones, and others turned and moved out of or into the workspace."""
    robot, rng = catalogue.robot(name), np.random.default_rng(11)
    poses = flange_poses(robot, rng.uniform(-pi, pi, (24, 6)))
    poses[12:, :3, 3] *= rng.uniform(0.0, 1.6, (12, 1))
    return poses


@pytest.mark.parametrize("name", CLOSED)
def test_branches_close_and_have_the_sign_they_are_filed_under(name: str) -> None:
    robot, poses = catalogue.robot(name), poses_of(name)
    joints, missing, reached = solved(robot, poses)
    there = missing < REACHED
    assert np.abs(reached - poses)[there].max() < tolerance(name)
    assert there[:, :12].any(axis=0).all()
    signs = signs_of(form_of(robot), joints)
    assert np.array_equal(signs[there], np.broadcast_to(SIGNS[:, None], signs.shape)[there])


@pytest.mark.parametrize("name", [name for name in CLOSED if name != "puma560"])
def test_branches_are_those_of_ssik(name: str) -> None:
    """Number and values, for reachable and unreachable poses; so a deficit is reported exactly where ssik has none."""
    robot = catalogue.robot(name)
    assert robot.ssik_name is not None
    theirs = ssik.Manipulator.from_prebuilt(robot.ssik_name)
    joints, missing, _ = solved(robot, poses_of(name))
    for j, pose in enumerate(poses_of(name)):
        expected = np.array([s.q for s in theirs.solve(pose, respect_limits=False, allow_rescue=False)]).reshape(-1, 6)
        ours = joints[missing[:, j] < REACHED, j]
        assert same_set(ours, expected, 1e-5), f"pose {j}: {len(ours)} branches, ssik has {len(expected)}"


def test_ssik_leaves_35_arms_to_the_closed_forms() -> None:
    assert len(CLOSED) == 36  # with the source's own PUMA


@pytest.mark.parametrize("name", CLOSED)
def test_unreachable_poses_keep_their_orientation_and_miss_by_what_is_reported(name: str) -> None:
    """The shoulder's and the triangle's deficits are at right angles and are added: error <= missing <= √2 error."""
    poses = poses_of(name)
    _, missing, reached = solved(catalogue.robot(name), poses)
    error = np.linalg.norm(reached[..., :3, 3] - poses[:, :3, 3], axis=-1)
    turned = rotation_angle(np.swapaxes(poses[:, :3, :3], 1, 2) @ reached[..., :3, :3])
    assert turned.max() < 1e-6
    assert np.all(error <= missing + tolerance(name))
    assert np.all(missing <= np.sqrt(2.0) * error + tolerance(name))


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900", "rx160", "j2s6s300", "z1", "irb120"])
def test_missing_is_continuous(name: str) -> None:
    """On fine straight lines at one orientation, through the inner and outer borders of the workspace."""
    robot, rng = catalogue.robot(name), np.random.default_rng(3)
    form = form_of(robot)
    for pose in poses_of(name)[:3]:
        direction = rng.normal(size=3)
        way = np.linspace(-3.0, 3.0, 40001)[:, None] * direction / np.linalg.norm(direction)
        rotation = np.broadcast_to(pose[:3, :3], (len(way), 3, 3))
        missing = solve_branches(form, rotation, way).missing
        assert (missing == 0.0).any()
        assert (missing > 0.0).any()
        assert np.abs(np.diff(missing, axis=1)).max() < 0.02  # steps of 0.15 mm; next to a root they give 7 mm


@pytest.mark.parametrize("name", CLOSED)
def test_the_chosen_branch_is_the_one_of_all_eight(name: str) -> None:
    robot, poses = catalogue.robot(name), poses_of(name)
    form = form_of(robot)
    every = solve_branches(form, poses[:, :3, :3], poses[:, :3, 3])
    positions = np.broadcast_to(poses[:, :3, 3], (8, len(poses), 3))
    chosen = solve_signed(form, poses[:, :3, :3], positions, SIGNS)
    assert chosen.joints.shape == (6, 1, 8, len(poses))
    assert np.allclose(chosen.joints[:, 0], every.joints, rtol=0.0, atol=1e-13)
    assert np.allclose(chosen.missing[0], every.missing, rtol=0.0, atol=1e-13)


def test_batches_of_bases_are_solved_like_one_base_after_the_other() -> None:
    robot = catalogue.robot("ur5e")
    form, poses = form_of(robot), poses_of("ur5e")
    bases = np.random.default_rng(0).uniform(-0.3, 0.3, (5, 1, 3))
    batch = solve_branches(form, poses[:, :3, :3], poses[:, :3, 3] - bases)
    assert batch.joints.shape == (6, 8, 5, len(poses))
    for i in range(5):
        single = solve_branches(form, poses[:, :3, :3], poses[:, :3, 3] - bases[i])
        assert np.allclose(batch.joints[:, :, i], single.joints, rtol=0.0, atol=1e-12)
        assert np.allclose(batch.missing[:, i], single.missing, rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("signs", ALL_SIGNS)
def test_postures_of_the_puma_are_those_of_the_source(signs: Signs) -> None:
    """(s, e, f) of the source's formulas: left s = +1, down e = +1, flip θ5 < 0."""
    robot = catalogue.robot("puma560")
    poses = flange_poses(robot, np.random.default_rng(5).uniform(-pi, pi, (50, 6)))
    joints, missing, _ = solved(robot, poses)
    k = ALL_SIGNS.index(signs)
    for j, pose in enumerate(poses):
        expected = puma.solve(pose, *signs)
        assert (expected is not None) == (missing[k, j] == 0.0)
        if expected is not None:
            assert np.abs(wrapped(joints[k, j] - expected)).max() < 1e-9
            assert tuple(signs_of(form_of(robot), expected)) == signs
            assert (np.sin(expected[4]) > 0.0) == (signs[2] > 0)


@pytest.mark.parametrize("name", ["puma560", "ur10e", "kr6_r900"])
def test_posture_terms_are_the_same_for_symbols_and_numbers(name: str) -> None:
    form = form_of(catalogue.robot(name))
    q = ca.SX.sym("q", 6)
    function = ca.Function("terms", [q], [*posture_terms(form, [q[i] for i in range(6)], ca.sin, ca.cos)])
    for joints in np.random.default_rng(1).uniform(-4.0, 4.0, (10, 6)):
        symbolic = [float(value) for value in function(joints)]
        assert symbolic == pytest.approx([float(t) for t in posture_terms(form, joints, np.sin, np.cos)], abs=1e-14)


@pytest.mark.parametrize("name", CLOSED)
def test_a_sign_changes_only_through_a_singular_posture(name: str) -> None:
    """Where one of the three quantities vanishes the Jacobian is singular (the definition of their zero sets)."""
    robot, rng = catalogue.robot(name), np.random.default_rng(2)
    form = form_of(robot)
    length = characteristic_length(robot)
    for term in range(3):
        crossings = 0
        for q in random_joints(robot, 30, rng):
            way = q + np.linspace(0.0, 1.0, 200)[:, None] * rng.uniform(-1.5, 1.5, 6)
            signs = np.sign(posture_terms(form, way.T, np.sin, np.cos)[term])
            for i in np.flatnonzero(np.diff(signs))[:1]:
                low, high = way[i], way[i + 1]
                for _ in range(50):
                    middle = 0.5 * (low + high)
                    same = np.sign(posture_terms(form, middle, np.sin, np.cos)[term]) == signs[i]
                    low, high = (middle, high) if same else (low, middle)
                assert conditioning(robot, np.eye(4), low, length)[0] < (1e-5 if name in ROUNDED else 1e-9)
                crossings += 1
        assert crossings > 0


LENGTHS = st.floats(-0.5, 0.5)
ANGLES = st.floats(-3.0, 3.0)
RIGHT = st.sampled_from([pi / 2, -pi / 2])


@st.composite
def closed_arms(draw: st.DrawFn) -> Robot:
    """Random arms of both classes, skew axis 1 and 2 included; their wrists have right angles."""
    first = draw(st.one_of(RIGHT, st.floats(0.4, 2.7)))
    upper, fore = draw(st.floats(0.1, 0.6)), draw(st.floats(0.1, 0.6))
    parallel = draw(st.booleans())
    rows = [
        DhRow(first, draw(LENGTHS), draw(LENGTHS), -3.0, 3.0, draw(ANGLES)),
        DhRow(draw(st.sampled_from([0.0, pi])), upper, draw(LENGTHS), -3.0, 3.0, draw(ANGLES)),
    ]
    if parallel:
        rows += [
            DhRow(draw(st.sampled_from([0.0, pi])), fore, draw(LENGTHS), -3.0, 3.0, draw(ANGLES)),
            DhRow(draw(RIGHT), 0.0, draw(LENGTHS), -3.0, 3.0, draw(ANGLES)),
            DhRow(draw(RIGHT), 0.0, draw(LENGTHS), -3.0, 3.0, draw(ANGLES)),
        ]
    else:
        rows += [
            DhRow(draw(RIGHT), draw(LENGTHS), draw(LENGTHS), -3.0, 3.0, draw(ANGLES)),
            DhRow(draw(RIGHT), 0.0, fore, -3.0, 3.0, draw(ANGLES)),
            DhRow(draw(RIGHT), 0.0, 0.0, -3.0, 3.0, draw(ANGLES)),
        ]
    return robot_from_dh("random", [*rows, DhRow(draw(ANGLES), draw(LENGTHS), draw(LENGTHS), -3.0, 3.0, draw(ANGLES))])


@given(closed_arms(), st.integers(0, 2**32 - 1))
def test_random_arms_of_both_classes_find_the_joints_they_were_posed_with(robot: Robot, seed: int) -> None:
    form = form_of(robot)
    assert form is not None
    q = np.random.default_rng(seed).uniform(-pi, pi, (3, 6))
    # near a singularity two branches run together and rounding decides
    assume(np.abs(np.array(posture_terms(form, q.T, np.sin, np.cos))).min() > 1e-2)
    poses = flange_poses(robot, q)
    joints, missing, reached = solved(robot, poses)
    there = missing < REACHED
    assert np.abs(reached - poses)[there].max() < 1e-8
    for j, own in enumerate(q):
        k = ALL_SIGNS.index(posture_of(form, own))
        assert missing[k, j] < REACHED
        assert np.abs(wrapped(joints[k, j] - own)).max() < 1e-6
