"""Meshes: reading, refusing, and hulls that contain them."""

from __future__ import annotations

import numpy as np
import pytest
import trimesh

from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.decomposition import decompose
from duocell.models.geometry.meshes import Mesh, in_metres, read_triangles

CUBE = trimesh.creation.box((1.0, 2.0, 3.0))


def as_stl(mesh: trimesh.Trimesh) -> bytes:
    data = mesh.export(file_type="stl")
    assert isinstance(data, bytes)
    return data


def as_obj(mesh: trimesh.Trimesh) -> bytes:
    text = mesh.export(file_type="obj")
    assert isinstance(text, str)
    return text.encode()


def angle_bracket() -> trimesh.Trimesh:
    """An L of one piece, extruded by hand."""
    corners = np.array([[0, 0], [1, 0], [1, 0.1], [0.1, 0.1], [0.1, 1], [0, 1.0]])
    flat = [[0, 1, 2], [0, 2, 3], [0, 3, 5], [3, 4, 5]]
    vertices = np.vstack([np.column_stack([corners, np.full(6, z)]) for z in (0.0, 0.2)])
    sides = [face for i in range(6) for face in ([i, (i + 1) % 6, i + 6], [(i + 1) % 6, (i + 1) % 6 + 6, i + 6])]
    faces = [face[::-1] for face in flat] + [[v + 6 for v in face] for face in flat] + sides
    return trimesh.Trimesh(vertices, faces, process=False)


@pytest.mark.parametrize(("data", "kind"), [(as_stl(CUBE), "stl"), (as_obj(CUBE), ".OBJ")])
def test_read_in_millimetres(data: bytes, kind: str) -> None:
    mesh = in_metres(read_triangles(data, kind), np.full(3, 1e-3))
    assert len(mesh.vertices) == 8
    assert len(mesh.faces) == 12
    assert np.ptp(mesh.vertices, axis=0) == pytest.approx([0.001, 0.002, 0.003])


def test_text_stl_is_read_too() -> None:
    text = trimesh.exchange.stl.export_stl_ascii(CUBE).encode()
    assert len(read_triangles(text, "stl").vertices) == 8


def test_an_obj_that_names_other_files_reads_none_of_them() -> None:
    data = b"mtllib /etc/passwd\nusemtl x\n" + as_obj(CUBE)
    assert len(read_triangles(data, "obj").vertices) == 8


@pytest.mark.parametrize(
    ("data", "kind", "scale", "pointer"),
    [
        (as_stl(CUBE), "dae", 1.0, "/mesh"),
        (as_stl(CUBE), "step", 1.0, "/mesh"),
        (b"", "stl", 1.0, "/mesh"),
        (b"nonsense" * 40, "stl", 1.0, "/mesh"),
        (b"\x00" * 84, "stl", 1.0, "/mesh"),
        (as_stl(CUBE)[:200], "stl", 1.0, "/mesh"),
        (b"v 0 0 0\nv 1 0 0\n", "obj", 1.0, "/mesh"),
        (b"v 0 0 zero\nf 1 2 9\n", "obj", 1.0, "/mesh"),
        (as_stl(CUBE), "stl", 1e4, "/scale"),
    ],
)
def test_refused_with_a_pointer(data: bytes, kind: str, scale: float, pointer: str) -> None:
    with pytest.raises(InvalidInput) as error:
        in_metres(read_triangles(data, kind), np.full(3, scale))
    assert error.value.pointer == pointer


def test_too_many_triangles(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("duocell.models.geometry.meshes.MOST_TRIANGLES", 11)
    with pytest.raises(InvalidInput, match="12 triangles"):
        read_triangles(as_stl(CUBE), "stl")


def test_each_convex_part_becomes_its_hull() -> None:
    other = CUBE.copy()
    other.apply_translation([5.0, 0.0, 0.0])
    both = trimesh.util.concatenate([CUBE, other])
    assert isinstance(both, trimesh.Trimesh)
    pieces = decompose(read_triangles(as_stl(both), "stl")).pieces
    assert sorted(len(piece.points) for piece in pieces) == [8, 8]
    assert sorted(float(piece.points[:, 0].mean()) for piece in pieces) == pytest.approx([0.0, 5.0])


def test_a_bracket_becomes_hulls_that_contain_it_and_leave_its_corner_free() -> None:
    bracket = angle_bracket()
    assert bracket.is_watertight
    pieces = decompose(Mesh(bracket.vertices, bracket.faces)).pieces
    assert len(pieces) > 1
    shares = np.random.default_rng(0).dirichlet(np.ones(3), 50)
    surface = np.einsum("ks,fsa->fka", shares, bracket.vertices[bracket.faces]).reshape(-1, 3)
    beyond = np.min([np.max(surface @ p.planes[:, :3].T + p.planes[:, 3], axis=1) for p in pieces], axis=0)
    assert beyond.max() < 2e-3
    open_corner = np.array([0.6, 0.6, 0.1])
    assert all(np.max(p.planes[:, :3] @ open_corner + p.planes[:, 3]) > 0.2 for p in pieces)
    again = decompose(Mesh(bracket.vertices, bracket.faces)).pieces
    assert all(np.array_equal(a.points, b.points) for a, b in zip(pieces, again, strict=True))


def test_shallow_dents_of_small_pieces_are_filled() -> None:
    bracket = angle_bracket()
    for scale, pieces in ((0.01, 1), (1.0, 2)):
        found = decompose(Mesh(bracket.vertices * scale, bracket.faces)).pieces
        assert len(found) == pieces
        beyond = [np.max(bracket.vertices * scale @ p.planes[:, :3].T + p.planes[:, 3], axis=1) for p in found]
        assert np.min(beyond, axis=0).max() < 1e-3


def sheet(x: float) -> Mesh:
    return Mesh(np.array([[x, 0, 0], [x + 1, 0, 0], [x, 1, 0], [x + 1, 1, 0]]), np.array([[0, 1, 2], [1, 3, 2]]))


def both(first: Mesh, second: Mesh) -> Mesh:
    count = len(first.vertices)
    return Mesh(np.vstack([first.vertices, second.vertices]), np.vstack([first.faces, second.faces + count]))


def test_a_solid_whose_triangles_do_not_hang_together_is_one_all_the_same() -> None:
    soup = Mesh(CUBE.triangles.reshape(-1, 3), np.arange(36).reshape(-1, 3))
    (piece,) = decompose(soup).pieces
    assert np.ptp(piece.points, axis=0) == pytest.approx([1.0, 2.0, 3.0])


def test_a_sheet_inside_of_a_solid_does_not_count_and_one_that_sticks_out_does() -> None:
    cube = Mesh(CUBE.vertices, CUBE.faces)
    inside = Mesh(sheet(0.0).vertices * 0.3, sheet(0.0).faces)
    (piece,) = decompose(both(cube, inside)).pieces
    assert np.ptp(piece.points, axis=0) == pytest.approx([1.0, 2.0, 3.0])
    outside = decompose(both(cube, sheet(4.0)))
    assert (len(outside.pieces), outside.left_out) == (1, 1)
