"""Collision geometry of URDF files: where it ends up, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin
import pytest
import trimesh

from duocell.models.base.errors import InvalidRobot
from duocell.models.catalogue.links import LinkBody, link_bodies, provenance
from duocell.models.description.urdf import robot_from_urdf
from duocell.models.description.urdf_bodies import LinkGeometry, MissingMeshes, urdf_link_bodies
from duocell.models.description.urdf_file import build_model, read_document
from duocell.models.geometry.shapes import Box, Capsule, ConvexHull, Cylinder, Sphere
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.robot import Robot
from tests.support.given.acceptance import FOLDER
from tests.support.given.solids import support

AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
STEPS = ("0 0 0.3", "0.1 0 0.1", "0 0 0.4", "0.1 0 0.05", "0.3 0 0", "0.05 0 0")


LIMIT = '<limit lower="-2" upper="2" effort="1" velocity="1"/>'


def joint(name: str, kind: str, parent: str, child: str, inside: str) -> str:
    ends = f'<parent link="{parent}"/><child link="{child}"/>'
    return f'<joint name="{name}" type="{kind}">{ends}{inside}</joint>'


def urdf(tmp_path: Path, collisions: dict[str, str]) -> Path:
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


def source_of(meshes: Mapping[str, bytes]) -> Callable[[str], bytes]:
    """Where the meshes are read from."""

    def source(name: str) -> bytes:
        if name not in meshes:
            raise FileNotFoundError(name)
        return meshes[name]

    return source


def load(file: Path, meshes: dict[str, bytes] | None = None) -> tuple[Robot, pin.Model, tuple[LinkBody, ...]]:
    robot = robot_from_urdf(file, "base", "tip")
    document = ElementTree.fromstring(file.read_bytes())
    model = build_model(read_document(file))
    return robot, model, urdf_link_bodies(document, model, robot, source_of(meshes or {})).bodies


NO_GEOMETRY = b'<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema" version="1.4.1"><asset/></COLLADA>'
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


def test_bodies_sit_where_pinocchio_puts_their_links(tmp_path: Path) -> None:
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


def test_a_mesh_is_scaled_along_each_axis(tmp_path: Path) -> None:
    _, _, bodies = load(urdf(tmp_path, EVERYTHING), TIP)
    hull = next(b.body for b in bodies if isinstance(b.body.shape, ConvexHull))
    assert support(hull.shape, np.eye(4), np.eye(3)) == pytest.approx([0.005, 0.01, 0.03])


@pytest.mark.parametrize(
    ("geometry", "words"),
    [
        ('<mesh filename="gone.stl"/>', "missing"),
        ('<mesh filename="tip.dae"/>', "no triangles"),
        ('<mesh filename="tip.step"/>', "stl, obj, dae"),
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
def test_faults_name_the_link(tmp_path: Path, geometry: str, words: str) -> None:
    file = urdf(tmp_path, {"l3": collision(geometry)})
    with pytest.raises(InvalidRobot, match=words) as error:
        load(file, {"tip.stl": TIP["package://made/tip.stl"], "tip.dae": NO_GEOMETRY, "tip.step": b""})
    assert error.value.pointer == "/links/l3"


def test_links_without_collision_have_no_bodies(tmp_path: Path) -> None:
    assert load(urdf(tmp_path, {}))[2] == ()


def of_link_3(
    tmp_path: Path, mesh: str, data: bytes | None, missing: MissingMeshes = "refuse"
) -> tuple[Robot, LinkGeometry]:
    file = urdf(tmp_path, EVERYTHING | {"l3": collision(mesh)})
    robot, model, document = robot_from_urdf(file, "base", "tip"), build_model(read_document(file)), read_document(file)
    files = TIP | ({} if data is None else {"l3.stl": data, "l3.dae": data})
    return robot, urdf_link_bodies(document, model, robot, source_of(files), missing)


@pytest.mark.parametrize("data", [None, b"no mesh at all" * 20])
def test_a_mesh_that_is_missing_or_broken_is_estimated_where_that_is_asked_for(
    tmp_path: Path, data: bytes | None
) -> None:
    with pytest.raises(InvalidRobot, match="l3"):
        of_link_3(tmp_path, '<mesh filename="l3.stl"/>', data)
    robot, found = of_link_3(tmp_path, '<mesh filename="l3.stl"/>', data, "estimate")
    estimated = [body for body in found.bodies if body.provenance == "estimated"]
    assert {body.link for body in estimated} == {3}
    assert [body.body.shape for body in estimated] == [b.body.shape for b in link_bodies(robot) if b.link == 3]
    assert {b.link for b in found.bodies if b.provenance == "mesh"} == {0, 2, 4, 6}
    assert any("the shape of l3 (l3.stl: " in note for note in found.notes)


def test_a_collada_mesh_stands_where_its_scene_puts_it_in_its_own_unit(tmp_path: Path) -> None:
    box = trimesh.creation.box((100.0, 200.0, 300.0))
    box.apply_translation([50.0, 0.0, 0.0])
    data = box.export(file_type="dae").replace(b"<created>", b'<unit name="mm" meter="0.001"/><created>')
    _, found = of_link_3(tmp_path, '<mesh filename="l3.dae"/>', data)
    (hull,) = [b.body.shape for b in found.bodies if b.link == 3]
    assert isinstance(hull, ConvexHull)
    assert hull.points.min(axis=0) == pytest.approx([0.0, -0.1, -0.15])
    assert hull.points.max(axis=0) == pytest.approx([0.1, 0.1, 0.15])


@pytest.mark.parametrize(
    "data", [b"PK\x03\x04", b"<!DOCTYPE a [<!ENTITY b 'c'>]><COLLADA/>", "<COLLADA/>".encode("utf-16")]
)
def test_a_collada_file_with_a_document_type_is_not_read(tmp_path: Path, data: bytes) -> None:
    with pytest.raises(InvalidRobot, match="document type"):
        of_link_3(tmp_path, '<mesh filename="l3.dae"/>', data)


@pytest.mark.parametrize("missing", ["refuse", "estimate"])
def test_a_mesh_in_millimetres_without_a_scale_is_asked_back(tmp_path: Path, missing: MissingMeshes) -> None:
    data = (FOLDER / "urdf" / "14_stl_in_millimetres_no_scale.stl").read_bytes()
    with pytest.raises(InvalidRobot, match="Did you mean millimetres"):
        of_link_3(tmp_path, '<mesh filename="l3.stl"/>', data, missing)
    of_link_3(tmp_path, '<mesh filename="l3.stl" scale="0.001 0.001 0.001"/>', data)


def test_what_is_left_out_of_a_mesh_is_told(tmp_path: Path) -> None:
    data = (FOLDER / "urdf" / "12_stl_box_and_one_flat_triangle_refused.stl").read_bytes()
    _, found = of_link_3(tmp_path, '<mesh filename="l3.stl"/>', data)
    assert any("left out: l3 (1)" in note for note in found.notes)


def test_many_meshes_share_a_budget_of_pieces(tmp_path: Path) -> None:
    ring = trimesh.creation.torus(0.2, 0.05, major_sections=16, minor_sections=8)
    files = {f"ring{i}.stl": (ring.apply_translation([1e-3, 0, 0]) or ring).export(file_type="stl") for i in range(40)}
    links = ("base", "l1", "l2", "l3")
    geometry = {
        link: "".join(collision(f'<mesh filename="ring{10 * k + i}.stl"/>') for i in range(10))
        for k, link in enumerate(links)
    }
    _, _, bodies = load(urdf(tmp_path, geometry), files)
    assert len(bodies) == 40  # one each: a link of ten meshes has no more pieces for that
    alone = load(urdf(tmp_path, {"l1": collision('<mesh filename="ring0.stl"/>')}), files)[2]
    assert len(alone) == 8
