"""URDF files as people publish them: arms of the catalogue, written down with the habits of many hands."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np
import pinocchio as pin

from bench.trials.trial import draw_of
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_about, transform
from duocell.models.catalogue import catalogue
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.robot import Robot

HABITS = (
    "plain",
    "rounded",
    "calibrated",
    "fingers",
    "cameras",
    "world",
    "leaf base",
    "missing mesh",
    "millimetres",
    "xacro leftovers",
    "two arms",
    "rail",
    "no bounds",
    "xacro",
)
"""What a file is drawn for; other habits come on top by chance."""
DIGITS = (2, 3, 4, 6, 9)
BOX = b"solid box\nendsolid box\n"


@dataclass(eq=False, slots=True)
class Drawn:
    """A file and what is to become of it.

    Attributes:
        habit: see `HABITS`. arm: name of the arm in the catalogue.
        text: the file. meshes: contents by ``filename``.
        base_link: given by the user, or None. base: the right base link. tip: the right flange.
        joints: names of the right joints.
        refused: a word of the reason for which it is to be refused, or "".
    """

    habit: str
    arm: str
    text: str
    base: str
    tip: str
    joints: tuple[str, ...]
    base_link: str | None = None
    refused: str = ""
    meshes: dict[str, bytes] = field(default_factory=dict)


def arms() -> list[str]:
    """Six-jointed arms of the catalogue whose geometry has a closed form."""
    found = (catalogue.robot(name) for name in catalogue.names())
    return [robot.name for robot in found if robot.dof == 6 and closed_form(robot) and chain_of(robot).vertical_sign]


def draw(seed: int) -> Drawn:
    """The file of a number."""
    rng = draw_of("urdf_files", seed)
    habit = HABITS[seed % len(HABITS)]
    names = arms()
    robot = catalogue.robot(names[int(rng.integers(len(names)))])
    name = robot.name
    if habit == "calibrated":
        robot = _calibrated(robot, rng)
    digits = int(rng.choice(DIGITS)) if habit == "rounded" else 12
    return _Writer(rng, habit, name, digits).file(robot)


def _calibrated(robot: Robot, rng: np.random.Generator) -> Robot:
    """Every joint up to a milliradian and 0.2 mm off."""
    placements = robot.joint_placements.copy()
    for i in range(robot.dof):
        axis = rng.normal(size=3)
        turn = rotation_about(axis / np.linalg.norm(axis), rng.uniform(0.0, 1e-3))
        placements[i] = placements[i] @ transform(turn, rng.uniform(-2e-4, 2e-4, 3))
    return replace(robot, joint_placements=placements)


class _Writer:
    """Writes one file."""

    def __init__(self, rng: np.random.Generator, habit: str, arm: str, digits: int) -> None:
        self.rng, self.habit, self.arm, self.digits = rng, habit, arm, digits
        self.parts: list[str] = []
        self.meshes: dict[str, bytes] = {}

    def file(self, robot: Robot) -> Drawn:
        """The whole file."""
        two = self.habit == "two arms"
        base = self._below("left_base_link" if two else "base_link")
        joints, tip = self._arm(robot, "left_" if two else "", base)
        if two:
            self.parts.append(
                '<link name="right_base_link"/>' + _joint("right_mount", "fixed", "torso", "right_base_link")
            )
            self._arm(robot, "right_", "right_base_link")
        drawn = Drawn(self.habit, self.arm, "", base, tip, joints, meshes=self.meshes)
        if self.habit == "leaf base":
            self.parts.append(
                '<link name="base"/>' + _joint("to_base", "fixed", base, "base", "0 0 0", "0 0 3.14159265358979")
            )
            drawn.base = drawn.base_link = "base"
        drawn.refused = {"no bounds": "no lower", "xacro": "xacro", "millimetres": "millimetres"}.get(self.habit, "")
        drawn.text = f"<?xml version='1.0'?>\n<robot name='made'{self._declared()}>{''.join(self._shuffled())}</robot>"
        return drawn

    def _declared(self) -> str:
        declared = self.rng.random() < 0.5
        return " xmlns:xacro='http://www.ros.org/wiki/xacro'" if declared else ""

    def _shuffled(self) -> list[str]:
        extra = []
        if self.habit == "xacro leftovers":
            extra = ["<xacro:property name='a' value='${1 + 2}'/>", "<!-- <xacro:arm/> -->", "<xacro:arg name='b'/>"]
        if self.habit == "xacro":
            extra = ["<xacro:include filename='$(find made)/arm.xacro'/>"]
        if self.rng.random() < 0.3:
            extra.append("<gazebo><plugin name='$(arg x)' ignition:thing='1'/></gazebo>")
        return [extra[i] for i in self.rng.permutation(len(extra))] + self.parts

    def _below(self, base: str) -> str:
        """What the arm stands on; returns its base link."""
        self.parts.append(f'<link name="{base}"/>')
        if self.habit == "world" or (
            self.habit != "leaf base" and self.rng.random() < 0.2 and self.habit != "two arms"
        ):
            self.parts.append('<link name="world"/>' + _joint("to_world", "fixed", "world", base, "0 0 0.75"))
        elif self.habit == "two arms":
            self.parts.append('<link name="pillar"/><link name="torso"/>')
            self.parts.append(_joint("torso_joint", "revolute", "pillar", "torso", axis="0 0 1", limit=(-2.0, 2.0)))
            self.parts.append(_joint("left_mount", "fixed", "torso", base, "0 0.2 0.5"))
        elif self.habit == "rail":
            self.parts.append('<link name="rail"/>')
            self.parts.append(_joint("slide", "prismatic", "rail", base, axis="1 0 0", limit=(0.0, 2.0)))
        return base

    def _arm(self, robot: Robot, prefix: str, base: str) -> tuple[tuple[str, ...], str]:
        """The joints and the flange of one arm."""
        above, names = base, []
        for i, (placement, axis) in enumerate(zip(robot.joint_placements, robot.joint_axes, strict=True)):
            link, name = f"{prefix}link_{i + 1}", f"{prefix}joint_{i + 1}"
            self.parts.append(f'<link name="{link}">{self._shape(i)}</link>')
            ends = (float(robot.lower[i]), float(robot.upper[i])) if robot.limited[i] else (-3.0, 3.0)
            limit = None if self.habit == "no bounds" and i == 5 else ends
            xyz, rpy = self._origin(placement)
            self.parts.append(_joint(name, "revolute", above, link, xyz, rpy, self._numbers(axis, 12), limit))
            above = link
            names.append(name)
        flange = f"{prefix}{self.rng.choice(['tool0', 'flange', 'ee_link', 'tcp', 'link_ee'])}"
        xyz, rpy = self._origin(robot.flange_placement)
        self.parts.append(f'<link name="{flange}"/>' + _joint(f"{flange}_fixed", "fixed", above, flange, xyz, rpy))
        self._behind(prefix, above, flange)
        return tuple(names), flange

    def _behind(self, prefix: str, last: str, flange: str) -> None:
        """Grippers and cameras."""
        if self.habit == "fingers" or self.rng.random() < 0.15:
            hand = f"{prefix}gripper_base"
            self.parts.append(f'<link name="{hand}"/>' + _joint(f"{hand}_fixed", "fixed", flange, hand))
            kind = "revolute" if self.rng.random() < 0.7 else "prismatic"
            for side in ("a", "b")[: 1 + int(self.rng.integers(2))]:
                finger = f"{prefix}finger_{side}"
                self.parts.append(f'<link name="{finger}_link"/>')
                self.parts.append(_joint(finger, kind, hand, f"{finger}_link", axis="1 0 0", limit=(0.0, 0.8)))
        if self.habit == "cameras" or self.rng.random() < 0.15:
            mount = f"{prefix}camera_mount"
            self.parts.append(f'<link name="{mount}"/><link name="{mount}_optical_frame"/>')
            self.parts.append(_joint(mount, "fixed", last, mount, "0.05 0 0"))
            self.parts.append(_joint(f"{mount}_o", "fixed", mount, f"{mount}_optical_frame", rpy="-1.57 0 -1.57"))

    def _shape(self, link: int) -> str:
        if link != 1 or self.habit not in ("missing mesh", "millimetres"):
            return ""
        name = "package://made/meshes/upper_arm.stl"
        if self.habit == "millimetres":
            import trimesh

            self.meshes[name] = trimesh.creation.box((90.0, 90.0, 20_000.0)).export(file_type="stl")
        return f'<collision><geometry><mesh filename="{name}"/></geometry></collision>'

    def _origin(self, placement: Floats) -> tuple[str, str]:
        rpy = pin.rpy.matrixToRpy(placement[:3, :3])
        return self._numbers(placement[:3, 3], max(self.digits, 5)), self._numbers(rpy, self.digits)

    def _numbers(self, values: Floats, digits: int) -> str:
        return " ".join(f"{value + 0.0:.{digits}f}" if digits < 12 else repr(float(value)) for value in values)


def _joint(
    name: str,
    kind: str,
    parent: str,
    child: str,
    xyz: str = "0 0 0",
    rpy: str = "0 0 0",
    axis: str = "",
    limit: tuple[float, float] | None = None,
) -> str:
    inside = f'<parent link="{parent}"/><child link="{child}"/><origin xyz="{xyz}" rpy="{rpy}"/>'
    if axis:
        inside += f'<axis xyz="{axis}"/>'
    if kind != "fixed":
        bounds = "" if limit is None else f'lower="{limit[0]!r}" upper="{limit[1]!r}" '
        inside += f'<limit {bounds}effort="10" velocity="1"/>'
    return f'<joint name="{name}" type="{kind}">{inside}</joint>'
