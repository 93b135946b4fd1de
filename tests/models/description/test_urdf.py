"""Robots from URDF files, against D-H tables of the same arm."""

from __future__ import annotations

from math import inf
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
from scipy.spatial.transform import Rotation

from duocell.models.base.arrays import Floats
from duocell.models.base.errors import InvalidRobot
from duocell.models.base.pose import transform
from duocell.models.catalogue import catalogue
from duocell.models.description.urdf import robot_from_urdf
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.robot import Robot


def digits(values: Floats) -> str:
    return " ".join(repr(float(value)) for value in values)


def add_joint(
    root: ElementTree.Element, name: str, kind: str, parent: str, child: str, placement: Floats, axis: str = "0 0 1"
) -> ElementTree.Element:
    joint = ElementTree.SubElement(root, "joint", name=name, type=kind)
    ElementTree.SubElement(joint, "parent", link=parent)
    ElementTree.SubElement(joint, "child", link=child)
    rpy = Rotation.from_matrix(placement[:3, :3]).as_euler("xyz")
    ElementTree.SubElement(joint, "origin", xyz=digits(placement[:3, 3]), rpy=digits(rpy))
    ElementTree.SubElement(joint, "axis", xyz=axis)
    return joint


def urdf_of(robot: Robot) -> ElementTree.Element:
    """The robot on a pedestal, with a side branch and a gripper behind the flange."""
    root = ElementTree.Element("robot", name="written")
    links = ["world", "base", *[f"link_{i + 1}" for i in range(robot.dof)], "tool0", "camera", "finger"]
    for link in links:
        ElementTree.SubElement(root, "link", name=link)
    raised = np.eye(4)
    raised[2, 3] = 0.7
    add_joint(root, "pedestal", "fixed", "world", "base", raised)
    for i, (placement, axis) in enumerate(zip(robot.joint_placements, robot.joint_axes, strict=True)):
        kind = "revolute" if np.isfinite(robot.lower[i]) else "continuous"
        joint = add_joint(root, f"axis_{i + 1}", kind, links[i + 1], links[i + 2], placement, digits(axis))
        if kind == "revolute":
            limits = {"lower": repr(float(robot.lower[i])), "upper": repr(float(robot.upper[i]))}
            ElementTree.SubElement(joint, "limit", limits, effort="1", velocity="1")
    add_joint(root, "flange", "fixed", f"link_{robot.dof}", "tool0", robot.flange_placement)
    add_joint(root, "bracket", "fixed", f"link_{robot.dof}", "camera", np.eye(4))
    slide = add_joint(root, "slide", "prismatic", "tool0", "finger", np.eye(4))
    ElementTree.SubElement(slide, "limit", lower="0", upper="0.1", effort="1", velocity="1")
    return root


def written(folder: Path, root: ElementTree.Element | str) -> Path:
    file = folder / "arm.urdf"
    text = root if isinstance(root, str) else ElementTree.tostring(root, encoding="unicode")
    file.write_text(text, encoding="utf-8")
    return file


@pytest.mark.parametrize("name", ["puma560", "ur10e", "gen3", "yumi_left"])
def test_round_trip_through_a_file_keeps_the_arm(name: str, tmp_path: Path) -> None:
    robot = catalogue.robot(name)
    read = robot_from_urdf(written(tmp_path, urdf_of(robot)), base_link="base", tip="tool0")
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (20, robot.dof))
    assert np.abs(flange_poses(read, q) - flange_poses(robot, q)).max() < 1e-12
    assert read.lower.tolist() == robot.lower.tolist()
    assert read.upper.tolist() == robot.upper.tolist()
    assert (read.name, read.base_frame, read.flange_frame) == ("written", "base", "tool0")
    assert read.joint_names == tuple(f"axis_{i + 1}" for i in range(robot.dof))


def test_default_chain_runs_from_the_robots_own_base_to_its_flange(tmp_path: Path) -> None:
    robot = catalogue.robot("puma560")
    read = robot_from_urdf(written(tmp_path, urdf_of(robot)))
    assert (read.base_frame, read.flange_frame) == ("base", "tool0")  # not world, not the camera
    q = np.array([[0.1, -0.4, 1.0, 0.5, 0.6, -0.7]])
    assert np.abs(flange_poses(read, q) - flange_poses(robot, q)).max() < 1e-12
    assert any("stands at (0, 0, 0.7) m in world" in note for note in read.notes)


def test_a_leaf_fixed_to_the_root_is_a_base_frame(tmp_path: Path) -> None:
    robot, root = catalogue.robot("puma560"), urdf_of(catalogue.robot("puma560"))
    ElementTree.SubElement(root, "link", name="turned")
    half = np.diag([-1.0, -1.0, 1.0, 1.0])
    add_joint(root, "beside", "fixed", "base", "turned", half)
    read = robot_from_urdf(written(tmp_path, root), base_link="turned")
    q = np.array([[0.1, -0.4, 1.0, 0.5, 0.6, -0.7]])
    assert np.abs(half @ flange_poses(read, q) - flange_poses(robot, q)).max() < 1e-12


def test_limits_that_are_whole_degrees_are_asked_back(tmp_path: Path) -> None:
    root = urdf_of(catalogue.robot("puma560"))
    limit = next(j for j in root.iter("joint") if j.get("name") == "axis_4").find("limit")
    assert limit is not None
    limit.attrib.update(lower="-45", upper="45")
    notes = robot_from_urdf(written(tmp_path, root)).notes
    assert any("did you mean degrees? axis_4: -45 to 45 rad (-0.7854 to 0.7854 rad" in note for note in notes)


def test_continuous_joints_have_no_limits(tmp_path: Path) -> None:
    root = urdf_of(catalogue.robot("puma560"))
    for joint in root.iter("joint"):
        if joint.get("name") in ("axis_1", "axis_6"):
            joint.set("type", "continuous")
    read = robot_from_urdf(written(tmp_path, root), "base", "tool0")
    assert (read.lower[0], read.upper[0], read.lower[5], read.upper[5]) == (-inf, inf, -inf, inf)
    assert read.limited.tolist() == [False, True, True, True, True, False]
    assert np.all(np.isfinite(read.reference))


def test_base_may_be_a_link_in_the_middle(tmp_path: Path) -> None:
    robot = catalogue.robot("iiwa14")
    read = robot_from_urdf(written(tmp_path, urdf_of(robot)), base_link="link_1", tip="tool0")
    assert read.joint_names == tuple(f"axis_{i}" for i in range(2, 8))
    q = np.random.default_rng(1).uniform(-2.0, 2.0, 7)
    turn = np.eye(4)
    turn[:3, :3] = Rotation.from_rotvec(q[0] * robot.joint_axes[0]).as_matrix()
    link_1 = robot.joint_placements[0] @ turn
    assert np.abs(link_1 @ flange_poses(read, q[1:])[0] - flange_poses(robot, q)[0]).max() < 1e-12


def test_meshes_and_masses_do_not_matter(tmp_path: Path) -> None:
    root = urdf_of(catalogue.robot("puma560"))
    link = next(root.iter("link"))
    geometry = ElementTree.SubElement(ElementTree.SubElement(link, "visual"), "geometry")
    ElementTree.SubElement(geometry, "mesh", filename="package://nowhere/base.stl")
    ElementTree.SubElement(ElementTree.SubElement(link, "inertial"), "mass", value="heavy")
    ElementTree.SubElement(root, "gazebo")
    assert robot_from_urdf(written(tmp_path, root), "base", "tool0").dof == 6


def edited(find: str, replacement: str) -> str:
    """The PUMA's file with a text replaced."""
    text = ElementTree.tostring(urdf_of(catalogue.robot("puma560")), encoding="unicode")
    assert find in text
    return text.replace(find, replacement, 1)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("<robot", "no valid XML"),
        ("", "no valid XML"),
        ("<sdf/>", "starts with <sdf>"),
        ('<robot name="empty"/>', "no links"),
        ('<robot xmlns:xacro="http://ros.org/wiki/xacro"><xacro:arm/></robot>', "xacro"),
        (edited('link name="link_3"', 'link name="link_2"'), "link_2"),
        (edited('<child link="link_3"', '<child link="nowhere"'), "joint axis_3 has the child 'nowhere'"),
        (edited('<parent link="link_3" />', ""), "joint axis_4 has the parent None"),
        (edited('<child link="link_3"', '<child link="base"'), "hangs on two joints, pedestal and axis_3"),
        (edited('type="revolute"', 'type="bent"'), "joint axis_1 is of the type 'bent'"),
        (edited('name="axis_2" type="revolute"', 'name="axis_2" type="prismatic"'), "turning joints"),
        (edited('name="axis_2" type="revolute"', 'name="axis_2" type="fixed"'), "5 turning joints"),
    ],
)
def test_files_that_hold_no_arm_are_refused(text: str, words: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match=words):
        robot_from_urdf(written(tmp_path, text), base_link=None, tip=None)


@pytest.mark.parametrize(
    ("base_link", "tip", "words"),
    [
        ("floor", "tool0", "its links are world, base"),
        ("base", "hand", "its links are"),
        ("tool0", "base", "does not hang on"),
        ("base", "link_4", "4 turning joints"),
        ("base", "finger", r"slide .* is prismatic"),
    ],
)
def test_links_that_bound_no_arm_are_refused(base_link: str, tip: str, words: str, tmp_path: Path) -> None:
    file = written(tmp_path, urdf_of(catalogue.robot("puma560")))
    with pytest.raises(InvalidRobot, match=words) as caught:
        robot_from_urdf(file, base_link, tip)
    assert caught.value.pointer in ("/base_link", "/tip")


@pytest.mark.parametrize(
    ("attributes", "words"),
    [(None, "no <limit>"), ({"lower": "1", "upper": "1"}, "no range"), ({"effort": "1"}, "no lower and no upper")],
)
def test_revolute_joints_need_a_range(attributes: dict[str, str] | None, words: str, tmp_path: Path) -> None:
    root = urdf_of(catalogue.robot("puma560"))
    joint = next(j for j in root.iter("joint") if j.get("name") == "axis_3")
    limit = joint.find("limit")
    assert limit is not None
    joint.remove(limit)
    if attributes is not None:
        ElementTree.SubElement(joint, "limit", {"effort": "1", "velocity": "1", **attributes})
    with pytest.raises(InvalidRobot, match=words) as caught:
        robot_from_urdf(written(tmp_path, root), "base", "tool0")
    assert caught.value.pointer == "/joints/axis_3"


def test_joint_that_mimics_another_is_refused(tmp_path: Path) -> None:
    root = urdf_of(catalogue.robot("puma560"))
    joint = next(j for j in root.iter("joint") if j.get("name") == "axis_5")
    ElementTree.SubElement(joint, "mimic", joint="axis_4")
    with pytest.raises(InvalidRobot, match=r"axis_5 .* \(mimic\)"):
        robot_from_urdf(written(tmp_path, root), "base", "tool0")


def test_joint_without_an_axis_is_refused(tmp_path: Path) -> None:
    root = urdf_of(catalogue.robot("puma560"))
    joint = next(j for j in root.iter("joint") if j.get("name") == "axis_5")
    axis = joint.find("axis")
    assert axis is not None
    axis.set("xyz", "0 0 0")
    with pytest.raises(InvalidRobot, match="axis_5 has no axis"):
        robot_from_urdf(written(tmp_path, root), "base", "tool0")


def test_arm_that_is_singular_everywhere_is_refused(tmp_path: Path) -> None:
    root = urdf_of(catalogue.robot("puma560"))
    for joint in root.iter("joint"):
        origin = joint.find("origin")
        assert origin is not None
        origin.set("rpy", "0 0 0")
    with pytest.raises(InvalidRobot, match="singular"):
        robot_from_urdf(written(tmp_path, root), "base", "tool0")


def test_missing_file_is_named(tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match=r"nothing\.urdf"):
        robot_from_urdf(tmp_path / "nothing.urdf")


def test_singular_mid_range_gets_a_working_reference(tmp_path: Path) -> None:
    read = robot_from_urdf(written(tmp_path, urdf_of(catalogue.robot("puma560"))), "base", "tool0")
    assert abs(read.reference[4]) == pytest.approx(np.radians(50))
    assert "axis_5" in read.reference_source


def on_track(**limit: str) -> ElementTree.Element:
    """The PUMA on a track."""
    root = urdf_of(catalogue.robot("puma560"))
    root.insert(0, ElementTree.Element("link", name="track"))
    pedestal = next(joint for joint in root.iter("joint") if joint.get("name") == "pedestal")
    root.remove(pedestal)
    add_joint(root, "pedestal", "fixed", "world", "track", np.eye(4))
    joint = add_joint(root, "axis_0", "prismatic", "track", "base", transform(np.eye(3), [0.0, 0.1, 0.4]), "1 0 0")
    ElementTree.SubElement(joint, "limit", limit, effort="1", velocity="1")
    return root


def test_linear_axis_under_an_arm(tmp_path: Path) -> None:
    """By Pinocchio on the whole file, and by the arm without the track."""
    file = written(tmp_path, on_track(lower="-0.5", upper="3"))
    robot = robot_from_urdf(file, "track", "tool0")
    assert [kind.value for kind in robot.joint_kinds] == ["prismatic", *6 * ["revolute"]]
    assert (robot.lower[0], robot.upper[0]) == (-0.5, 3.0)
    assert robot.reference[0] == pytest.approx(1.25)
    model = pin.buildModelFromUrdf(str(file))
    data, rng = model.createData(), np.random.default_rng(1)
    for q in rng.uniform(-0.5, 0.5, (5, 7)):
        pin.framesForwardKinematics(model, data, np.append(q, 0.0))  # with the finger of the gripper
        flange = data.oMf[model.getFrameId("tool0")].homogeneous
        assert np.allclose(flange_poses(robot, q)[0], flange, rtol=0.0, atol=1e-12)
    alone = robot_from_urdf(file, "base", "tool0")
    assert alone.dof == 6


@pytest.mark.parametrize(
    ("limit", "words"), [({"lower": "1", "upper": "1"}, r"no range \(1 to 1 m\)"), ({"upper": "900"}, "100 m")]
)
def test_linear_axes_need_a_range_in_metres(limit: dict[str, str], words: str, tmp_path: Path) -> None:
    with pytest.raises(InvalidRobot, match=words) as caught:
        robot_from_urdf(written(tmp_path, on_track(**limit)), "track", "tool0")
    assert caught.value.pointer == "/joints/axis_0"
