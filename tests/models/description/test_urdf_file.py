"""XML that is meant to do harm, or is no URDF: refused at once, in words."""

from __future__ import annotations

import time

import pytest

from duocell.models.base.errors import InvalidRobot
from duocell.models.description.urdf_file import parse_document

LAUGHS = "".join(f'<!ENTITY l{i} "{f"&l{i - 1};" * 10}">' for i in range(1, 12))
BILLION_LAUGHS = f'<?xml version="1.0"?><!DOCTYPE robot [<!ENTITY l0 "lol">{LAUGHS}]><robot name="&l11;"/>'


@pytest.mark.parametrize(
    ("data", "words"),
    [
        (BILLION_LAUGHS.encode(), "document type"),
        (BILLION_LAUGHS.encode("utf-16"), "document type"),
        (b'<!DOCTYPE robot SYSTEM "file:///etc/passwd"><robot name="a"/>', "document type"),
        (b'<!DOCTYPE r [<!ENTITY e SYSTEM "file:///etc/passwd">]><robot name="a">&e;</robot>', "document type"),
        (b"<robot>" + b"<a>" * 1_000_000, "nested"),
        (b"<robot>" + b" " * 4_000_000 + b"</robot>", "4000000"),
        (b'<?xml version="1.0" encoding="klingon"?><robot/>', "encoding"),
        (b'<?xml version="1.0" encoding="undefined"?><robot/>', "undefined"),
        (b"\x00" * 1000, "no valid XML"),
        (b'<robot name="a&#0;b"/>', "no valid XML"),
        (b"solid not a urdf", "no valid XML"),
        ("<robot>" + "".join(f'<link name="l{i}"/>' for i in range(1001)) + "</robot>", "1001 links"),
    ],
)
def test_refused_in_words_and_at_once(data: bytes | str, words: str) -> None:
    started = time.perf_counter()
    with pytest.raises(InvalidRobot, match=words):
        parse_document(data.encode() if isinstance(data, str) else data)
    assert time.perf_counter() - started < 5.0


@pytest.mark.parametrize(
    "inside",
    [
        '<xacro:include filename="$(find arm)/urdf/arm.xacro"/>',
        '<link name="a"/><joint name="j" type="fixed"><origin xyz="0 0 ${1/3}"/></joint>',
        '<link name="$(arg prefix)base"/>',
    ],
)
def test_xacro_is_refused_with_the_command_that_expands_it(inside: str) -> None:
    for prefix in ("http://www.ros.org/wiki/xacro", "elsewhere"):
        with pytest.raises(InvalidRobot, match=r"xacro arm\.urdf\.xacro > arm\.urdf"):
            parse_document(f'<robot name="a" xmlns:xacro="{prefix}">{inside}</robot>'.encode())


def test_an_expanded_xacro_may_keep_the_declaration_of_its_prefix() -> None:
    joint = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
    text = (
        f'<robot name="a" xmlns:xacro="http://www.ros.org/wiki/xacro"><link name="a"/><link name="b"/>{joint}</robot>'
    )
    assert [link.get("name") for link in parse_document(text.encode()).findall("link")] == ["a", "b"]


JOINT = '<joint name="j" type="fixed"><parent link="a"/><child link="b"/>{}</joint>'


@pytest.mark.parametrize(
    "inside",
    [
        '<xacro:property name="x" value="${2 * pi}"/>',
        '<xacro:arg name="prefix" default=""/>',
        '<xacro:macro name="arm" params="a"><link name="${a}"/></xacro:macro>',
        "<!-- <xacro:arm/> ${x} -->",
        '<gazebo><plugin file="$(find arm)/gains.yaml"/></gazebo>',
        '<other:thing other:value="1"/>',
    ],
)
@pytest.mark.parametrize("declared", ['xmlns:xacro="http://www.ros.org/wiki/xacro"', ""])
def test_what_xacro_leaves_behind_changes_nothing(inside: str, declared: str) -> None:
    text = f'<robot name="a" {declared}>{inside}<link name="a"/><link name="b"/>{JOINT.format("")}</robot>'
    root = parse_document(text.encode())
    assert [element.tag for element in root if element.tag in ("link", "joint")] == ["link", "link", "joint"]


@pytest.mark.parametrize(
    ("joints", "pointer"),
    [
        ([("j", "a", "a")], "/joints/j"),
        ([("i", "r", "a"), ("j", "b", "c"), ("k", "c", "b")], "/joints/k"),
        ([("i", "a", "b")], ""),
    ],
)
def test_links_that_form_no_tree_are_refused(joints: list[tuple[str, str, str]], pointer: str) -> None:
    links = "".join(f'<link name="{name}"/>' for name in ("r", "a", "b", "c"))
    parts = [
        f'<joint name="{name}" type="fixed"><parent link="{above}"/><child link="{below}"/></joint>'
        for name, above, below in joints
    ]
    with pytest.raises(InvalidRobot, match="the links form") as caught:
        parse_document(f"<robot>{links}{''.join(parts)}</robot>".encode())
    assert caught.value.pointer in (pointer, "")
