"""Arms on a linear axis: every kinematics against Pinocchio, which gets the chain as a URDF file."""

from __future__ import annotations

from xml.sax.saxutils import quoteattr

import casadi as ca
import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_from_rpy, transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.batch_kinematics import conditioning_of, forward_and_jacobian
from duocell.models.kinematics.casadi_kinematics import flange_function
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.chain_columns import column_chain
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.kinematics import (
    characteristic_length,
    conditioning,
    flange_poses,
    jacobians,
    reach,
    reach_sphere,
)
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.kinematics.nominal import nominal
from duocell.models.kinematics.numeric_inverse import numeric_branches
from duocell.models.robot.robot import Robot
from duocell.service.figure.figure import arm_points
from tests.support.given.linear_axis import on_linear_axis, without_joint

TOOL = transform(rotation_from_rpy((0.3, -0.2, 1.0)), [0.05, -0.02, 0.12])
TILTED = transform(rotation_from_rpy((0.2, 0.4, -0.3)), [0.1, -0.2, 0.3])
ROBOTS = [
    on_linear_axis("ur10e"),
    on_linear_axis("puma560", travel=(0.0, 12.0), axis=(0.3, -1.0, 0.1), place=TILTED),
    on_linear_axis(without_joint(catalogue.robot("iiwa14"), 2), axis=(0.0, 0.0, 1.0)),
]


def urdf(robot: Robot) -> str:
    """A robot as a URDF file, from its numbers alone."""
    lines = [f"<robot name={quoteattr(robot.name)}>", '<link name="link_0"/>']
    for i, (place, axis) in enumerate(zip(robot.joint_placements, robot.joint_axes, strict=True)):
        xyz, rpy = place[:3, 3], Rotation.from_matrix(place[:3, :3]).as_euler("xyz")
        numbers = [" ".join(f"{float(v)!r}" for v in vector) for vector in (xyz, rpy, axis)]
        lines += [
            f'<link name="link_{i + 1}"/>',
            f'<joint name="joint_{i}" type="{robot.joint_kinds[i]}"><parent link="link_{i}"/>',
            f'<child link="link_{i + 1}"/><origin xyz="{numbers[0]}" rpy="{numbers[1]}"/><axis xyz="{numbers[2]}"/>',
            '<limit lower="-100" upper="100" effort="1" velocity="1"/></joint>',
        ]
    return "\n".join([*lines, "</robot>"])


def values(robot: Robot, count: int = 12) -> Floats:
    """Joint values (count, n) all over the travel and the turns."""
    q = np.random.default_rng(2).uniform(-np.pi, np.pi, (count, robot.dof))
    q[:, 0] = np.linspace(robot.lower[0], robot.upper[0], count)
    return q


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_all_kinematics_agree_with_pinocchio_on_the_file(robot: Robot) -> None:
    model = pin.buildModelFromXML(urdf(robot))
    data, q = model.createData(), values(robot)
    rotations, positions, batch = forward_and_jacobian(chain_of(robot), q)
    columns, place, by_columns = column_chain(robot).forward_and_jacobian(q.T.copy())
    frames, symbols, flanges = link_frames(robot, q), flange_function(robot), flange_poses(robot, q)
    drawn = arm_points(robot, q, TOOL)
    of_tool = jacobians(robot, q, TOOL)
    for k, row in enumerate(q):
        pin.computeJointJacobians(model, data, row)
        last = model.njoints - 1
        links = np.array([data.oMi[i].homogeneous for i in range(1, last + 1)])
        flange = links[-1] @ robot.flange_placement
        spatial = pin.getJointJacobian(model, data, last, pin.ReferenceFrame.LOCAL_WORLD_ALIGNED)

        def at(point: Floats, links: Floats = links, spatial: Floats = spatial) -> Floats:
            jacobian: Floats = spatial.copy()
            jacobian[:3] += np.cross(spatial[3:], point - links[-1][:3, 3], axisa=0, axisc=0)
            return jacobian

        assert np.allclose(frames[k, 1:], links, rtol=0.0, atol=1e-12)
        assert np.allclose(drawn[k, 1:-2], links[:, :3, 3], rtol=0.0, atol=1e-12)
        assert np.allclose(drawn[k, -2:], [flange[:3, 3], (flange @ TOOL)[:3, 3]], rtol=0.0, atol=1e-12)
        by_symbols = [np.array(ca.DM(part)) for part in symbols(row)]
        for turn, point in (
            (flanges[k, :3, :3], flanges[k, :3, 3]),
            (rotations[k], positions[k]),
            (columns[:, :, k].T, place[:, k]),
            (by_symbols[0], by_symbols[1].ravel()),
        ):
            assert np.allclose(turn, flange[:3, :3], rtol=0.0, atol=1e-12)
            assert np.allclose(point, flange[:3, 3], rtol=0.0, atol=1e-12)
        assert np.allclose(batch[k], at(flange[:3, 3]), rtol=0.0, atol=1e-12)
        assert np.allclose(by_columns[:, :, k].T, at(flange[:3, 3]), rtol=0.0, atol=1e-12)
        assert np.allclose(of_tool[k], at((flange @ TOOL)[:3, 3]), rtol=0.0, atol=1e-12)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_the_flange_never_leaves_its_reach(robot: Robot) -> None:
    rng = np.random.default_rng(3)
    q = rng.uniform(-np.pi, np.pi, (3000, robot.dof))
    q[:, 0] = rng.choice([robot.lower[0], robot.upper[0], np.mean([robot.lower[0], robot.upper[0]])], len(q))
    flange = flange_poses(robot, q)[:, :3, 3]
    far = float(np.max(np.linalg.norm(flange, axis=1)))
    assert 0.7 * reach(robot) < far <= reach(robot) + 1e-12
    longer = robot.upper[0] + 3.0
    assert reach(robot, (robot.lower[0], longer)) > reach(robot) or -robot.lower[0] > longer
    centre, radius = reach_sphere(robot)
    carriage = link_frames(robot, q)[:, 1]
    middle = np.einsum("kab,b->ka", carriage[:, :3, :3], centre) + carriage[:, :3, 3]
    assert np.max(np.linalg.norm(flange - middle, axis=1)) <= radius + 1e-12


def test_lengths_and_conditioning_are_those_of_the_arm_where_the_axis_adds_nothing() -> None:
    robot, q = ROBOTS[0], values(ROBOTS[0])
    carried = robot.carried
    assert carried is not None
    length = characteristic_length(robot)
    assert length == pytest.approx(characteristic_length(carried), rel=1e-12)
    found = conditioning(robot, TOOL, q, length)
    assert np.allclose(found, conditioning_of(chain_of(robot), TOOL, q, length), rtol=1e-9)
    # one more column: no singular value gets smaller
    scaled = jacobians(carried, q[:, 1:], TOOL)
    scaled[:, :3] /= length
    column = np.zeros((len(q), 6, 1))
    column[:, :3, 0] = chain_of(robot).axes[0]
    sigma = np.linalg.svd(np.concatenate([column, scaled], axis=2), compute_uv=False)
    assert np.allclose(found, sigma[:, -1] / sigma[:, 0], rtol=1e-9)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_no_turn_is_taken_for_a_shift(robot: Robot) -> None:
    assert chain_of(robot).vertical_sign == 0
    assert closed_form(robot) is None
    assert nominal(robot) is None


def test_numeric_branches_reach_and_do_not_wrap_the_travel() -> None:
    robot = on_linear_axis("ur10e", travel=(8.0, 9.0))
    target = flange_poses(robot, np.append(8.5, robot.reference[1:]))[0]
    found = numeric_branches(robot, target)
    assert len(found) > 20
    assert np.max(found[:, 0]) > np.pi
    assert np.allclose(flange_poses(robot, found), target, rtol=0.0, atol=1e-9)
