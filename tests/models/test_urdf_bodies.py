"""Collision geometry of URDF files: where it ends up, and what is wrong with it."""

from __future__ import annotations

from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from models.errors import InvalidRobot
from models.link_frames import link_frames
from models.links import provenance
from models.shapes import Box, Capsule, ConvexHull, Cylinder, Sphere
from models.urdf import robot_from_urdf
from models.urdf_bodies import urdf_link_bodies
from models.urdf_file import build_model, read_document
from tests.support.solids import support

AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
STEPS = ("0 0 0.3", "0.1 0 0.1", "0 0 0.4", "0.1 0 0.05", "0.3 0 0", "0.05 0 0")


LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'


def joint(name: str, kind: str, parent: str, child: str, inside: str) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


def urdf(tmp_path, collisions: dict[str, str]):
    """A six-joint arm on a stand, with a finger behind its flange; ``collisions`` by link."""
    parts = ['<robot name="made"><link name="world"/>']
    names = ["base", *(f"l{i}" for i in range(1, 7)), "tip", "finger"]
    parts += [f'<link name="{name}">{collisions.get(name, "")}</link>' for name in names]
    parts.append(joint("stand", "fixed", "world", "base", '<origin xyz="0 0 0.5" rpy="0 0 0.3"/>'))
    for i, (axis, step) in enumerate(zip(AXES, STEPS, strict=True)):
        inside = f'<origin xyz="{step}" rpy="0.1 0 0.2"/><axis xyz="{axis}"/>{LIMIT}'
        parts.append(joint(f"j{i + 1}", "revolute", names[i], names[i + 1], inside))
    parts.append(joint("end", "fixed", "l6", "tip", '<origin xyz="0.1 0 0"/>'))
    parts.append(joint("slide", "prismatic", "tip", "finger", f'<origin xyz="0 0.03 0"/><axis xyz="0 1 0"/>{LIMIT}'))
    file = tmp_path / "made.urdf"
    file.write_text("".join([*parts, "</robot>"]))
    return file


def collision(geometry: str, origin: str = "") -> str:
    return f"<collision>{origin}<geometry>{geometry}</geometry></collision>"


def load(file, meshes=None):
    robot = robot_from_urdf(file, "base", "tip")
    document = ElementTree.fromstring(file.read_bytes())
    files = meshes or {}

    def source(name):
        if name not in files:
            raise FileNotFoundError(name)
        return files[name]

    model = build_model(read_document(file))
    return robot, model, urdf_link_bodies(document, model, robot, source)


EVERYTHING = {
    "base": collision('<box size="0.2 0.3 0.4"/>', '<origin xyz="0 0 0.1" rpy="0 0 0.5"/>'),
    "l2": collision('<cylinder radius="0.05" length="0.4"/>', '<origin xyz="0 0 0.2"/>')
    + collision('<sphere radius="0.1"/>'),
    "l4": collision('<capsule radius="0.05" length="0.3"/>'),
    "tip": collision('<mesh filename="package://made/tip.stl" scale="0.001 0.001 -0.002"/>'),
    "finger": collision('<box size="0.01 0.01 0.1"/>'),
    "world": "",
}
TIP = {"package://made/tip.stl": trimesh.creation.box((10.0, 20.0, 30.0)).export(file_type="stl")}


def test_bodies_sit_where_pinocchio_puts_their_links(tmp_path):
    robot, model, bodies = load(urdf(tmp_path, EVERYTHING), TIP)
    assert [b.link for b in bodies] == [0, 2, 2, 4, 6, 6]
    assert [type(b.body.shape) for b in bodies] == [Box, Cylinder, Sphere, Capsule, ConvexHull, Box]
    assert provenance(bodies) == "mesh"
    data = model.createData()
    base = model.getFrameId("base")
    q = np.random.default_rng(0).uniform(-2, 2, (3, 6))
    for row, frames in zip(q, link_frames(robot, q), strict=True):
        pin.framesForwardKinematics(model, data, np.append(row, 0.0))
        world = data.oMf[base].homogeneous
        for body in bodies:
            link = data.oMf[model.getFrameId(body.body.name)].homogeneous
            origin = np.linalg.inv(link) @ world @ frames[body.link] @ body.body.pose
            expected = np.eye(4)
            if body.body.name == "base":
                expected[:3, :3], expected[2, 3] = pin.rpy.rpyToMatrix(0.0, 0.0, 0.5), 0.1
            if isinstance(body.body.shape, Cylinder):
                expected[2, 3] = 0.2
            assert np.allclose(origin, expected, atol=1e-12), body.body.name


def test_a_mesh_is_scaled_along_each_axis(tmp_path):
    _, _, bodies = load(urdf(tmp_path, EVERYTHING), TIP)
    hull = next(b.body for b in bodies if isinstance(b.body.shape, ConvexHull))
    assert support(hull.shape, np.eye(4), np.eye(3)) == pytest.approx([0.005, 0.01, 0.03])


@pytest.mark.parametrize(
    ("geometry", "words"),
    [
        ('<mesh filename="gone.stl"/>', "missing"),
        ('<mesh filename="tip.dae"/>', "stl and obj"),
        ('<mesh filename="tip.stl" scale="0 1 1"/>', "scale"),
        ('<mesh filename="tip.stl" scale="1 1"/>', "scale"),
        ('<box size="1 1"/>', "size"),
        ('<box size="1 1 x"/>', "size"),
        ('<sphere radius="-1"/>', "radius"),
        ('<cylinder radius="0.1"/>', "length"),
        ('<cone radius="0.1"/>', "cone"),
        ("", "no geometry"),
    ],
)
def test_faults_name_the_link(tmp_path, geometry, words):
    file = urdf(tmp_path, {"l3": collision(geometry)})
    with pytest.raises(InvalidRobot, match=words) as error:
        load(file, {"tip.stl": TIP["package://made/tip.stl"], "tip.dae": b"<COLLADA/>"})
    assert error.value.pointer == "/links/l3"


def test_links_without_collision_have_no_bodies(tmp_path):
    assert load(urdf(tmp_path, {}))[2] == ()
