"""Hulls in the place of meshes: they contain them, they are few, and what they fill is stated."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from duocell.models.base.errors import InvalidInput
from duocell.models.base.pose import rotation_y, transform
from duocell.models.geometry.decomposition import decompose, sticking_out
from duocell.models.geometry.meshes import Mesh, read_triangles
from tests.support.given.acceptance import FOLDER


def bent_link() -> trimesh.Trimesh:
    """A tube with a cylinder across its end, in one piece: a triangle joins them."""
    tube = trimesh.creation.annulus(0.05, 0.08, 0.5, sections=48)
    across = trimesh.creation.cylinder(0.07, 0.3, sections=48)
    across.apply_transform(transform(rotation_y(np.pi / 2), np.zeros(3)))
    across.apply_translation([0.1, 0.0, 0.3])
    both = trimesh.util.concatenate([tube, across])
    assert isinstance(both, trimesh.Trimesh)
    joined = np.vstack([both.faces, [0, len(tube.vertices), len(tube.vertices) + 1]])
    return trimesh.Trimesh(both.vertices, joined, process=False)


SOLIDS = {
    "bent link": bent_link(),
    "ring": trimesh.creation.torus(0.4, 0.1, major_sections=32, minor_sections=12),
    "ball": trimesh.creation.icosphere(subdivisions=2),
}


@pytest.mark.parametrize("name", SOLIDS)
def test_a_few_hulls_contain_the_mesh_and_say_how_far_they_stick_out(name: str) -> None:
    solid = SOLIDS[name]
    found = decompose(Mesh(solid.vertices, solid.faces))
    assert 1 <= len(found.pieces) <= 8
    shares = np.random.default_rng(0).dirichlet(np.ones(3), 20)
    surface = np.einsum("ks,fsa->fka", shares, solid.vertices[solid.faces]).reshape(-1, 3)
    assert sticking_out(surface, found.pieces) < 1e-9
    again = decompose(Mesh(solid.vertices, solid.faces))
    assert all(np.array_equal(a.points, b.points) for a, b in zip(found.pieces, again.pieces, strict=True))


def test_a_ring_keeps_its_hole_and_the_depth_that_is_filled_is_stated() -> None:
    ring = SOLIDS["ring"]
    found = decompose(Mesh(ring.vertices, ring.faces))
    rng = np.random.default_rng(1)
    ends = [p.points[rng.integers(len(p.points), size=(400, 2))] for p in found.pieces]
    places = np.vstack([0.5 * (pair[:, 0] + pair[:, 1]) for pair in ends])
    off_ring = np.hypot(np.hypot(*places[:, :2].T) - 0.4, places[:, 2]) - 0.1  # distance from a torus, in closed form
    assert 0.01 < np.max(off_ring) < found.dent + 0.01
    assert sticking_out(np.zeros((1, 3)), found.pieces) > 0.15


def test_a_fine_mesh_without_dents_is_one_hull_and_is_said_to_have_none() -> None:
    ball = trimesh.creation.icosphere(subdivisions=4)
    found = decompose(Mesh(ball.vertices, ball.faces))
    assert len(found.pieces) == 1
    assert found.dent < 0.01


def test_fewer_hulls_where_fewer_are_allowed() -> None:
    ring = SOLIDS["ring"]
    few = [decompose(Mesh(ring.vertices, ring.faces), most) for most in (1, 4)]
    assert [len(one.pieces) for one in few] == [1, 4]
    assert few[0].dent > few[1].dent


@pytest.mark.parametrize(
    ("file", "pieces", "left_out"),
    [
        ("11_stl_28_triangles_crashes_decomposition.stl", 1, 0),
        ("12_stl_box_and_one_flat_triangle_refused.stl", 1, 1),
    ],
)
def test_meshes_that_broke_the_decomposition(file: str, pieces: int, left_out: int) -> None:
    mesh = read_triangles((FOLDER / "urdf" / file).read_bytes(), "stl")
    found = decompose(mesh)
    assert len(found.pieces) >= pieces
    assert found.left_out == left_out
    if not left_out:
        assert sticking_out(mesh.vertices, found.pieces) < 1e-9 * max(1.0, float(np.abs(mesh.vertices).max()))


def test_a_sheet_is_no_solid() -> None:
    with pytest.raises(InvalidInput, match="no volume"):
        decompose(Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0.0]]), np.array([[0, 1, 2], [1, 3, 2]])))
