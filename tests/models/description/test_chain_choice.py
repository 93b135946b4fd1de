"""Which chain of a file is the arm: files written for the purpose, and trees drawn by hand."""

from __future__ import annotations

from itertools import pairwise
from xml.etree import ElementTree

import pytest

from duocell.models.base.errors import InvalidRobot
from duocell.models.description.chain_choice import ChainChoice, choose_chain
from duocell.models.description.link_tree import LinkTree
from duocell.models.description.urdf_file import read_document
from tests.support.given.acceptance import FOLDER


def tree(*joints: str) -> LinkTree:
    """A tree from lines ``parent > child`` (turning), ``parent - child`` (fixed): joints are called after the child."""
    root = ElementTree.Element("robot")
    links: list[str] = []
    for line in joints:
        parent, sign, child = line.split()
        links += [link for link in (parent, child) if link not in links]
        kind = {">": "revolute", "-": "fixed", "|": "prismatic"}[sign]
        joint = ElementTree.SubElement(root, "joint", name=f"to_{child}", type=kind)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
    root[:0] = [ElementTree.Element("link", name=link) for link in links]
    return LinkTree.of(root)


def arm(base: str = "base_link", count: int = 6, prefix: str = "l") -> list[str]:
    names = [base, *[f"{prefix}{i + 1}" for i in range(count)]]
    return [f"{a} > {b}" for a, b in pairwise(names)]


def of_file(name: str, base_link: str | None = None) -> ChainChoice:
    return choose_chain(LinkTree.of(read_document(FOLDER / "urdf" / name)), base_link)


@pytest.mark.parametrize(
    ("file", "base", "tip"),
    [
        ("01_gripper_finger_taken_as_joint7.urdf", "base_link", "tool0"),
        ("02_camera_frame_taken_as_flange.urdf", "base_link", "tool0"),
        ("03_world_link_below_base.urdf", "base_link", "tool0"),
        ("09_unused_xacro_property.urdf", "base_link", "tool0"),
        ("15_two_arms_on_one_torso_joint.urdf", "left_base_link", "left_tool0"),
    ],
)
def test_files_on_which_the_longest_chain_was_the_wrong_one(file: str, base: str, tip: str) -> None:
    choice = of_file(file)
    assert (choice.base_link, choice.tip, len(choice.joints)) == (base, tip, 6)


def test_a_leaf_may_be_the_base() -> None:
    assert of_file("04_leaf_base_frame_refused.urdf", "base").base_link == "base"


def test_what_was_left_out_and_what_else_could_be_meant_is_told() -> None:
    choice = of_file("01_gripper_finger_taken_as_joint7.urdf")
    assert any("finger_1, finger_2" in text for text in choice.left_out)
    others = {one.tip: len(one.joints) for one in choice.alternatives}
    assert (others["gripper_base"], others["finger_1_link"]) == (6, 7)
    both = of_file("15_two_arms_on_one_torso_joint.urdf")
    other = next(one for one in both.alternatives if one.reason == "another arm of the file")
    assert (other.base_link, other.tip) == ("right_base_link", "right_tool0")
    assert any("torso_j stays at zero" in text for text in both.left_out)


@pytest.mark.parametrize(
    ("joints", "base", "tip"),
    [
        (
            (*arm(), "l6 - ee_link", "l6 - tool0", "tool0 - robotiq_base", "robotiq_base > knuckle"),
            "base_link",
            "tool0",
        ),
        ((*arm(), "l6 - flange", "flange - tool0", "l6 - ft_frame"), "base_link", "tool0"),
        ((*arm(count=7), "l7 - l8", "l8 - hand", "hand - hand_tcp"), "base_link", "l8"),
        ((*arm(), "l6 > gripper_a", "l6 > gripper_b"), "base_link", "l6"),
        ((*arm(), "l6 > any_1", "l6 > any_2"), "base_link", "l6"),
        ((*arm(count=7), "l7 > index", "l7 > middle"), "base_link", "l7"),
        ((*arm(), "l6 - self_collision_link", "l6 - camera_tool0_mount"), "base_link", "l6"),
        (("world - table", "table - base_link", *arm()), "base_link", "l6"),
        (("world | carriage", "carriage - foot", *arm("foot")), "carriage", "l6"),
        (("base_link - base_link_inertia", *arm("base_link_inertia"), "base_link - base"), "base_link", "l6"),
        (("table - a_base", *arm("a_base", prefix="a"), "table - b_base", *arm("b_base", prefix="b")), "a_base", "a6"),
        ((*arm(count=7), "l7 - lbr_link_ee", "l7 - sensor"), "base_link", "lbr_link_ee"),
    ],
)
def test_the_rule(joints: tuple[str, ...], base: str, tip: str) -> None:
    choice = choose_chain(tree(*joints))
    assert (choice.base_link, choice.tip) == (base, tip)


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (arm(count=5), "5 turning joints"),
        ([*arm(count=5), "l5 - gripper", "gripper > left_finger"], "5 turning joints"),
        (arm(count=9), "9 turning joints"),
    ],
)
def test_what_is_no_arm_is_refused(joints: list[str], words: str) -> None:
    with pytest.raises(InvalidRobot, match=words):
        choose_chain(tree(*joints))


def test_links_that_were_named_are_taken() -> None:
    joints = (*arm(), "l6 - tool0", "tool0 > left_finger")
    assert choose_chain(tree(*joints), tip="left_finger").joints[-1] == "to_left_finger"
    assert choose_chain(tree(*joints), "base_link", "l6").tip == "l6"


RAILED = ["world - rail", "rail | base_link", *arm()]


def test_a_linear_axis_belongs_to_the_arm_where_the_base_is_below_it() -> None:
    alone = choose_chain(tree(*RAILED))
    assert alone.joints[0] == "to_l1"
    [offered] = [one for one in alone.alternatives if one.joints[0] == "to_base_link"]
    assert offered.base_link == "rail"
    choice = choose_chain(tree(*RAILED), offered.base_link)
    assert choice.joints == offered.joints
    assert len(choice.joints) == 7
    assert not [one for one in choice.alternatives if one.joints[0] == "to_l1"]


@pytest.mark.parametrize(
    ("joints", "words"),
    [
        (["rail | cross", "cross | base_link", *arm()], "to_base_link .* is prismatic"),
        (["rail > turntable", "turntable | base_link", *arm()], "to_base_link .* is prismatic"),
        (["rail | base_link", *arm(count=7)], "8 joints with its linear axis"),
        (["rail | base_link", *arm(count=4)], "5 joints with its linear axis"),
    ],
)
def test_other_sliding_joints_are_refused(joints: list[str], words: str) -> None:
    last = joints[-1].split()[-1]
    with pytest.raises(InvalidRobot, match=words):
        choose_chain(tree(*joints), "rail", last)
