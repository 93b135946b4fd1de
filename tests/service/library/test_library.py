"""What users brought, as files: nothing is lost, nothing is half there, and shapes sit where they belong."""

from __future__ import annotations

import json
import os
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
import trimesh
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial import cKDTree

from duocell.models.catalogue.links import LinkBody
from duocell.models.geometry.shapes import Body, HalfSpace
from duocell.models.robot.robot import Robot
from duocell.service.library.document_store import DocumentStore
from duocell.service.library.library import Library
from duocell.service.library.user_mesh import mesh_document
from duocell.service.library.user_robot import UserRobot, as_document, from_document, shape_document, shape_from
from duocell.service.requests.accept import accept
from duocell.service.settings import Limits, Settings
from duocell.service.uploads.mesh_import import mesh_from_file
from duocell.service.uploads.robot_import import RobotFiles, robot_from_files
from duocell.service.workers.solving import solve_request
from tests.support.given import own_robot
from tests.support.given.solids import KINDS, SEED, random_pose, random_shape


@pytest.fixture(scope="module")
def own() -> UserRobot:
    """The robot with its meshes, taken apart once."""
    data = own_robot.zipped(own_robot.meshes())
    return robot_from_files(RobotFiles("own", "own.urdf", own_robot.urdf().encode(), data), Limits())


def same(first: Any, second: Any) -> bool:
    if isinstance(first, np.ndarray):
        return bool(np.array_equal(first, second))
    return bool(first == second)


def test_a_robot_comes_back_to_the_last_digit(own: UserRobot) -> None:
    back = from_document(json.loads(json.dumps(as_document(own))))
    for field in fields(Robot):
        assert same(getattr(own.robot, field.name), getattr(back.robot, field.name)), field.name
    assert own.links is not None
    assert back.links is not None
    for mine, theirs in zip(own.links, back.links, strict=True):
        assert (mine.link, mine.body.name, mine.provenance, mine.source) == (
            theirs.link,
            theirs.body.name,
            theirs.provenance,
            theirs.source,
        )
        assert np.array_equal(mine.body.pose, theirs.body.pose)
        assert shape_document(mine.body.shape) == shape_document(theirs.body.shape)
    assert (back.version, back.meshes) == (own.version, own.meshes)


def test_endless_joints_stay_endless() -> None:
    urdf = own_robot.urdf({}).replace('"revolute"', '"continuous"', 1)
    made = robot_from_files(RobotFiles("own", "own.urdf", urdf.encode()), Limits())
    back = from_document(json.loads(json.dumps(as_document(made), allow_nan=False)))
    assert back.robot.upper[0] == np.inf
    assert back.robot.lower[0] == -np.inf


@given(SEED, st.sampled_from(KINDS))
def test_every_shape_comes_back(seed: int, kind: Any) -> None:
    rng = np.random.default_rng(seed)
    shape = random_shape(kind, rng)
    document = json.loads(json.dumps(shape_document(shape)))
    back = shape_from(document)
    assert type(back) is type(shape)
    assert shape_document(back) == document
    Body("it", random_pose(rng), back)  # it can be put somewhere


def test_a_half_space_comes_back() -> None:
    assert shape_from(shape_document(HalfSpace())) == HalfSpace()


def test_a_library_answers_for_robots_links_and_hulls(tmp_path: Path, own: UserRobot) -> None:
    library = Library(tmp_path)
    assert dict(library.robots()) == {}
    assert library.robot_store.put("own", as_document(own))
    robots = library.robots()
    assert list(robots) == ["own"]
    assert "puma560" not in robots
    assert robots["own"] is Library(tmp_path).robots()["own"]  # compiled kinematics are kept by identity
    assert robots[f"own@{own.version}"] is robots["own"]
    assert f"own@{'0' * 32}" not in robots
    links = library.links("own")
    assert links is not None
    assert len(links) == len(own.links or ())
    assert library.links("puma560") is None


def test_bodies_move_with_the_links_of_the_urdf(own: UserRobot) -> None:
    """The bodies against the meshes themselves, placed by Pinocchio's own reading of the file."""
    from duocell.models.kinematics.link_frames import link_frames

    model = pin.buildModelFromXML(own_robot.urdf())
    data = model.createData()
    q = np.random.default_rng(0).uniform(-2.0, 2.0, 6)
    pin.framesForwardKinematics(model, data, q)
    fork = data.oMf[model.getFrameId("upper_arm")].homogeneous
    corners = own_robot.fork().vertices @ fork[:3, :3].T + fork[:3, 3]
    frames = link_frames(own.robot, q[None])[0]
    hulls = [body for body in own.links or () if body.body.name == "upper_arm"]
    inside = np.array([_depth(body, frames, corners) for body in hulls]).max(axis=0)
    assert inside.min() > -1e-3  # each corner is in or on some piece
    between_the_cheeks = np.array([[0.0, 0.0, 0.4]]) @ fork[:3, :3].T + fork[:3, 3]
    assert max(_depth(body, frames, between_the_cheeks)[0] for body in hulls) < -0.04


def _depth(body: LinkBody, frames: Any, points: Any) -> Any:
    """How deep points of the base frame lie in a hull; negative: outside."""
    place = frames[body.link] @ body.body.pose
    local = (points - place[:3, 3]) @ place[:3, :3]
    planes = body.body.shape.planes  # type: ignore[union-attr]
    return -np.max(local @ planes[:, :3].T + planes[:, 3], axis=1)


OBSTACLE = {"name": "fixture", "pose": {"position": [0.1, 0.0, 1.0], "orientation": {"rpy": [0.0, 0.0, 0.0]}}}


def test_layouts_keep_clear_with_the_meshes_that_were_brought(tmp_path: Path, own: UserRobot) -> None:
    """The distance in the result against points sampled on the meshes themselves."""
    library = Library(tmp_path)
    library.robot_store.put("own", as_document(own))
    mesh = mesh_from_file(own_robot.as_stl(own_robot.fork()), "fork.stl", "fork")
    library.mesh_store.put(mesh.id, mesh_document(mesh))
    request = own_robot.REQUEST | {"obstacles": [OBSTACLE | {"shape": {"type": "mesh", "id": mesh.id, "scale": 1.0}}]}
    accepted = accept(json.dumps(request).encode(), Settings(), library)
    result = solve_request(accepted.text, accepted.request_hash, 30.0, library)
    arm, found = result["arms"][0], result["clearances"]["arm_obstacle"]
    assert arm["geometry"] == "mesh"
    assert found["pair"] == ["arm upper_arm", "fixture"]

    model = pin.buildModelFromXML(own_robot.urdf())
    data = model.createData()
    base = pin.SE3(pin.rpy.rpyToMatrix(0.0, 0.0, arm["base"]["yaw"]), np.array(arm["base"]["position"]))
    pin.framesForwardKinematics(model, data, np.array(arm["joints"][found["pose"]]))
    link = (base * data.oMf[model.getFrameId("upper_arm")]).homogeneous
    points, _ = trimesh.sample.sample_surface(own_robot.fork(), 3000, seed=1)
    moved = points @ link[:3, :3].T + link[:3, 3]
    standing = points + OBSTACLE["pose"]["position"]  # type: ignore[index]
    sampled = float(np.min(cKDTree(standing).query(moved)[0]))
    assert found["distance"] < sampled + 1e-3  # the hulls contain the meshes
    assert found["distance"] > sampled - 0.03  # and are not much larger


def test_meshes_are_scaled(tmp_path: Path) -> None:
    box = own_robot.as_stl(trimesh.creation.box((2000.0, 3000.0, 40.0)))
    mesh = mesh_from_file(box, "BOX.STL", "box")
    library = Library(tmp_path)
    library.mesh_store.put(mesh.id, mesh_document(mesh))
    (hull,) = library.hulls(mesh.id, 0.001)
    assert np.ptp(hull.points, axis=0) == pytest.approx([2.0, 3.0, 0.04])
    assert library.hulls(mesh.id, 0.001)[0] is hull


# --- the document store -----------------------------------------------------------------------------------------------


def test_a_name_is_taken_once_and_freed_by_taking_away(tmp_path: Path) -> None:
    store = DocumentStore(tmp_path / "made" / "with the first")
    assert store.names() == []
    assert store.put("a", {"n": 1})
    assert not store.put("a", {"n": 2})
    path = store.path("a")
    assert path is not None
    assert json.loads(path.read_text()) == {"n": 1}
    assert store.take("a", "v1")
    assert not store.take("a", "v1")
    assert store.path("a") is None
    assert store.tombstone("a", "v1") is not None
    assert store.count() == 1
    assert store.put("a", {"n": 2})
    assert store.take("a", "v1")  # the same version again replaces the tombstone
    store.forget(3600.0)
    assert store.tombstone("a", "v1") is not None
    store.forget(0.0)
    assert list((tmp_path / "made" / "with the first").rglob("*.json")) == []


@pytest.mark.parametrize("name", ["", ".", "..", "../a", "a/b", ".a", "a\n", "ä", "a" * 65, "a@b", "-a"])
def test_names_that_are_no_file_names_are_nowhere(tmp_path: Path, name: str) -> None:
    store = DocumentStore(tmp_path)
    assert store.path(name) is None
    assert store.tombstone(name, "v") is None
    assert store.tombstone("a", name) is None
    assert not store.take(name, "v")


def test_what_cannot_be_written_leaves_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space"):
        DocumentStore(tmp_path).put("a", {"n": 1})
    assert list(tmp_path.iterdir()) == []


def test_what_a_crash_left_half_written_is_no_document_and_goes(tmp_path: Path) -> None:
    now = 0.0
    store = DocumentStore(tmp_path, lambda: now)
    store.put("a", {})
    torn, fresh = tmp_path / ".0123", tmp_path / ".4567"
    torn.write_text("{")
    assert store.names() == ["a"]
    store.forget(0.0)
    now = 7200.0
    fresh.write_text("{")  # somebody may be writing it
    store.forget(0.0)
    assert not torn.exists()
    assert fresh.exists()


def test_what_was_taken_away_ages_by_a_clock_that_does_not_jump(tmp_path: Path) -> None:
    now = 0.0
    store = DocumentStore(tmp_path, lambda: now)
    store.put("a", {})
    store.take("a", "v")
    kept = store.tombstone("a", "v")
    assert kept is not None
    os.utime(kept, (time.time() - 1e6,) * 2)  # as after a leap of the wall clock
    store.forget(3600.0)
    assert store.tombstone("a", "v") is not None
    DocumentStore(tmp_path, lambda: 1e9).forget(3600.0)  # another process has not seen it before
    assert store.tombstone("a", "v") is not None
    now = 3601.0
    store.forget(3600.0)
    assert store.tombstone("a", "v") is None


def test_of_many_who_want_a_name_one_gets_it(tmp_path: Path) -> None:
    with ThreadPoolExecutor(8) as pool:
        won = list(pool.map(lambda number: DocumentStore(tmp_path).put("contended", {"by": number}), range(40)))
    assert sum(won) == 1
    path = DocumentStore(tmp_path).path("contended")
    assert path is not None
    assert json.loads(path.read_text()) == {"by": won.index(True)}
    assert [file.name for file in tmp_path.iterdir()] == ["contended.json"]
