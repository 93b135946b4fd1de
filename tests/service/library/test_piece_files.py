"""A mesh is taken apart once, whoever sends it again; files that are damaged or gone cost time and nothing else."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from fastapi.testclient import TestClient

from duocell.models.description.urdf_bodies import MeshWork
from duocell.models.geometry import link_meshes
from duocell.models.geometry.decomposition import decompose
from duocell.models.geometry.meshes import read_triangles
from duocell.models.geometry.piece_cache import PiecesInMemory, key_of
from duocell.service.common.issues import InvalidRequest
from duocell.service.library.piece_files import PieceFiles
from duocell.service.settings import Limits
from duocell.service.uploads import mesh_import
from duocell.service.uploads.mesh_import import mesh_from_file
from duocell.service.uploads.robot_import import RobotFiles, robot_from_files
from tests.service.uploads.test_robot_upload import send
from tests.support.given.own_robot import as_stl, fork, meshes, urdf, zipped

FORK = as_stl(fork())
FILES = RobotFiles("own", "own.urdf", urdf().encode(), zipped(meshes()))


@pytest.fixture
def made(monkeypatch: pytest.MonkeyPatch) -> list[int]:
    """Pieces that were allowed, of every mesh that is taken apart."""
    found: list[int] = []

    def counted(mesh: Any, most: int) -> Any:
        found.append(most)
        return decompose(mesh, most)

    monkeypatch.setattr(link_meshes, "decompose", counted)
    monkeypatch.setattr(mesh_import, "decompose", counted)
    return found


def shapes(robot: Any) -> list[Any]:
    return [getattr(link.body.shape, "points", None) for link in robot.links]


def test_what_is_kept_is_what_was_made(tmp_path: Path) -> None:
    found = decompose(read_triangles(FORK, "stl"), 8)
    PieceFiles(tmp_path).keep("k", found)
    again = PieceFiles(tmp_path).find("k")
    assert again is not None
    assert (again.dent, again.left_out) == (found.dent, found.left_out)
    np.testing.assert_array_equal(again.extent, found.extent)
    assert len(again.pieces) == len(found.pieces)
    for one, other in zip(again.pieces, found.pieces, strict=True):
        np.testing.assert_array_equal(one.points, other.points)


def test_the_same_meshes_in_another_robot_are_not_taken_apart_again(tmp_path: Path, made: list[int]) -> None:
    work = MeshWork(PieceFiles(tmp_path))
    first = robot_from_files(FILES, Limits(), work)
    assert len(made) == 3
    other = replace(FILES, name="other", urdf=FILES.urdf.replace(b'"0 0 0.5"', b'"0 0 0.7"'))
    second = robot_from_files(other, Limits(), MeshWork(PieceFiles(tmp_path)))
    assert len(made) == 3
    assert second.version != first.version
    for one, again in zip(shapes(first), shapes(second), strict=True):
        np.testing.assert_array_equal(one, again)
    scaled = replace(FILES, urdf=FILES.urdf.replace(b'"0.001 0.001 0.001"', b'"0.001 0.001 0.002"'))
    robot_from_files(scaled, Limits(), MeshWork(PieceFiles(tmp_path)))
    assert len(made) == 4  # that one is another shape


def test_a_mesh_that_is_too_long_for_an_arm_is_refused_also_where_its_pieces_are_known(tmp_path: Path) -> None:
    work = MeshWork(PieceFiles(tmp_path))
    robot_from_files(FILES, Limits(), work)
    tiny = FILES.urdf
    for step in (b'"0.1 0 0.05"', b'"0 0 0.5"', b'"0.2 0 0.05"', b'"0.3 0 0"', b'"0.08 0 0"', b'"0 0 0.35"'):
        tiny = tiny.replace(step, b'"0.01 0 0.01"')
    with pytest.raises(InvalidRequest) as here:
        robot_from_files(replace(FILES, urdf=tiny), Limits(), MeshWork(PiecesInMemory()))
    with pytest.raises(InvalidRequest) as known:
        robot_from_files(replace(FILES, urdf=tiny), Limits(), work)
    assert known.value.issues == here.value.issues
    assert "millimetres" in here.value.issues[0].detail


def test_a_mesh_that_is_sent_again_is_not_taken_apart_again(tmp_path: Path, made: list[int]) -> None:
    first = mesh_from_file(FORK, "fork.stl", "one", tmp_path)
    second = mesh_from_file(FORK, "other.stl", "two", tmp_path)
    assert len(made) == 1
    assert second.depth == first.depth
    for one, again in zip(first.pieces, second.pieces, strict=True):
        np.testing.assert_array_equal(one, again)


@pytest.mark.parametrize("text", [b"", b"{", b"[]", b'{"pieces":[[[0,0,0]]],"dent":0,"left_out":0,"extent":[1,1,1]}'])
def test_damaged_files_are_made_again(tmp_path: Path, made: list[int], text: bytes) -> None:
    mesh_from_file(FORK, "fork.stl", "one", tmp_path)
    (file,) = tmp_path.iterdir()
    file.write_bytes(text)
    mesh_from_file(FORK, "fork.stl", "one", tmp_path)
    mesh_from_file(FORK, "fork.stl", "one", tmp_path)
    assert len(made) == 2


def test_a_folder_that_cannot_be_written_costs_time_alone(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("no folder")
    assert mesh_from_file(FORK, "fork.stl", "one", tmp_path / "file").pieces


def test_those_that_were_not_asked_for_longest_go_first(tmp_path: Path) -> None:
    found = decompose(read_triangles(FORK, "stl"), 8)
    files = PieceFiles(tmp_path)
    files.keep("a", found)
    size = (tmp_path / "a.json").stat().st_size
    files = PieceFiles(tmp_path, 4 * size)
    for age, key in enumerate("abcd"):
        files.keep(key, found)
        os.utime(tmp_path / f"{key}.json", (1000.0 + age, 1000.0 + age))
    assert files.find("a") is not None  # and so it is young again
    files.keep("e", found)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["a.json", "d.json", "e.json"]


def test_keys_tell_apart_whatever_changes_the_pieces() -> None:
    keys = [
        key_of(b"x", "stl", [1.0, 1.0, 1.0], 8),
        key_of(b"y", "stl", [1.0, 1.0, 1.0], 8),
        key_of(b"x", "obj", [1.0, 1.0, 1.0], 8),
        key_of(b"x", "stl", [1.0, 1.0, 2.0], 8),
        key_of(b"x", "stl", [1.0, 1.0, 1.0], 4),
    ]
    assert len(set(keys)) == len(keys)
    assert key_of(b"x", "STL", [1, 1, 1], 8) == keys[0]


def test_links_are_told_as_they_are_begun() -> None:
    told: list[tuple[str, int, int]] = []
    robot_from_files(FILES, Limits(), MeshWork(None, lambda *one: told.append(one)))
    assert told == [("base_link", 0, 3), ("upper_arm", 1, 3), ("wrist", 2, 3)]


def test_over_http_pieces_are_kept_in_the_data_directory(
    client_with: Callable[..., TestClient], tmp_path: Path
) -> None:
    client = client_with()
    assert send(client).status_code == 201
    assert len(list((tmp_path / "pieces").glob("*.json"))) == 3
    before = {path.name: path.stat().st_ino for path in (tmp_path / "pieces").iterdir()}
    assert send(client, name=(None, "other")).status_code == 201
    assert {path.name: path.stat().st_ino for path in (tmp_path / "pieces").iterdir()} == before
