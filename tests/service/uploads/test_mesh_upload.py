"""A mesh of a user, from the form to the obstacle; and everything that is refused, leaving nothing behind."""

from __future__ import annotations

import copy
import hashlib
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import trimesh
from fastapi.testclient import TestClient

from duocell.service.app import create_app
from duocell.service.library.library import Library
from duocell.service.settings import Settings
from tests.service.conftest import FakeExecutor
from tests.support.given.acceptance import FOLDER
from tests.support.given.own_robot import as_obj, as_stl, fork

Document = dict[str, Any]

FORK = as_stl(fork())
BOX = trimesh.creation.box((100.0, 200.0, 1500.0))


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    settings = Settings(data_dir=tmp_path_factory.mktemp("data"), max_upload=200_000, workers=1)
    with TestClient(create_app(settings, FakeExecutor()), raise_server_exceptions=False) as client:
        yield client


def send(client: TestClient, file: str, data: bytes, **texts: str) -> Any:
    return client.post("/v1/meshes", files={"mesh": (file, data)}, data=texts)


def with_obstacle(request: Document, **shape: Any) -> Document:
    pose = {"position": [5.0, 5.0, 0.0], "orientation": {"rpy": [0.0, 0.0, 0.0]}}
    obstacle = {"name": "fixture", "pose": pose, "shape": {"type": "mesh", **shape}}
    return copy.deepcopy(request) | {"obstacles": [obstacle]}


def test_a_mesh_is_brought_shown_used_and_deleted(service: TestClient, example: Document) -> None:
    answer = send(service, "fork.stl", FORK, name="fixture")
    assert answer.status_code == 201, answer.text
    mesh = answer.json()
    assert mesh["id"] == hashlib.sha256(FORK).hexdigest()[:32]
    assert answer.headers["location"] == f"/v1/meshes/{mesh['id']}"
    assert service.get(answer.headers["location"]).json() == mesh
    assert service.get("/v1/meshes").json() == {"items": [mesh], "next_cursor": None}
    assert (mesh["name"], mesh["format"], mesh["size"], mesh["triangles"]) == ("fixture", "stl", len(FORK), 28)
    assert mesh["bounding_box"]["lower"] == pytest.approx([-0.05, -0.1, 0.0])
    assert mesh["bounding_box"]["upper"] == pytest.approx([0.05, 0.1, 0.48])
    assert mesh["pieces"] >= 3
    assert 0.0 <= mesh["depth"] < 0.02
    assert mesh["left_out"] == 0

    again = send(service, "other.stl", FORK, name="another name")
    assert (again.status_code, again.json()) == (200, mesh)

    request = with_obstacle(example, id=mesh["id"], scale=1.0)
    assert service.post("/v1/layouts", json=request).status_code == 202
    assert service.delete(answer.headers["location"]).status_code == 204
    assert service.get(answer.headers["location"]).status_code == 404
    assert service.delete(answer.headers["location"]).status_code == 404
    refused = service.post("/v1/layouts", json=request)
    assert refused.status_code == 422
    assert refused.json()["code"] == "unknown-mesh"
    assert refused.json()["errors"][0]["pointer"] == "/obstacles/0/shape/id"

    folder = service.app.state.duocell.settings.data_dir  # type: ignore[attr-defined]
    assert len(Library(folder, deleted=True).hulls(mesh["id"])) == mesh["pieces"]  # for layouts accepted before


def test_a_flat_part_is_left_out_and_counted(service: TestClient) -> None:
    data = (FOLDER / "urdf" / "12_stl_box_and_one_flat_triangle_refused.stl").read_bytes()
    mesh = send(service, "box.stl", data).json()
    assert (mesh["pieces"], mesh["left_out"]) == (1, 1)
    assert mesh["depth"] < 1e-9


def test_a_mesh_in_millimetres_needs_its_scale(service: TestClient, example: Document) -> None:
    answer = send(service, "BOX.OBJ", as_obj(BOX))
    assert answer.status_code == 201, answer.text
    mesh = answer.json()
    assert (mesh["name"], mesh["format"], mesh["pieces"]) == ("BOX.OBJ", "obj", 1)
    assert service.post("/v1/layouts", json=with_obstacle(example, id=mesh["id"], scale=0.001)).status_code == 202
    refused = service.post("/v1/layouts", json=with_obstacle(example, id=mesh["id"], scale=2.0))
    assert refused.status_code == 422
    assert refused.json()["errors"][0]["pointer"] == "/obstacles/0/shape/scale"
    assert "0.001 for millimetres" in refused.json()["detail"]


SHEET = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]], process=False)

REFUSED: dict[str, tuple[Document, str, str]] = {
    # name: what is sent, the pointer that must be named, a word of the advice
    "nothing": ({"files": {"name": (None, "a")}}, "/mesh", "missing"),
    "another part": ({"files": {"file": ("a.stl", FORK)}}, "/file", "allowed are name, mesh"),
    "text without a format": ({"files": {"mesh": (None, "solid")}}, "/mesh", "stl, obj, dae"),
    "no format": ({"files": {"mesh": ("fork", FORK)}}, "/mesh", "stl, obj, dae"),
    "another format": ({"files": {"mesh": ("fork.step", b"ISO-10303-21;")}}, "/mesh", "stl, obj, dae"),
    "a folder": ({"files": {"mesh": ("../../fork.step", FORK)}}, "/mesh", "stl, obj, dae"),
    "nonsense": ({"files": {"mesh": ("fork.stl", b"nonsense" * 40)}}, "/mesh", "triangles"),
    "nothing in it": ({"files": {"mesh": ("fork.stl", b"")}}, "/mesh", "stl"),
    "cut off": ({"files": {"mesh": ("fork.stl", FORK[:500])}}, "/mesh", "a complete stl file"),
    "no volume": ({"files": {"mesh": ("sheet.stl", as_stl(SHEET))}}, "/mesh", "no volume"),
    "a point": ({"files": {"mesh": ("a.obj", b"v 0 0 0\nv 0 0 0\nv 0 0 0\nf 1 2 3\n")}}, "/mesh", "no volume"),
    "not finite": ({"files": {"mesh": ("a.obj", b"v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")}}, "/mesh", "finite"),
    "an endless name": ({"files": {"mesh": ("a.stl", FORK)}, "data": {"name": "x" * 201}}, "/name", "200"),
    "a name with a line break": ({"files": {"mesh": ("a.stl", FORK)}, "data": {"name": "a\nb"}}, "/name", "printable"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_advice_and_nothing_left(service: TestClient, name: str) -> None:
    sent, pointer, words = REFUSED[name]
    folder: Path = service.app.state.duocell.settings.data_dir  # type: ignore[attr-defined]
    before = sorted(folder.rglob("*"))
    answer = service.post("/v1/meshes", **sent)
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    found = [error["detail"] for error in answer.json()["errors"] if error["pointer"] == pointer]
    assert any(words in detail for detail in found), answer.text
    assert sorted(folder.rglob("*")) == before


def test_too_large_is_413(service: TestClient) -> None:
    answer = send(service, "fork.stl", b"x" * 400_000)
    assert (answer.status_code, answer.json()["code"]) == (413, "upload-too-large")
    assert "DUOCELL_MAX_UPLOAD" in answer.json()["detail"]


def test_too_many_triangles_are_refused(service: TestClient) -> None:
    triangle = b"f 1 2 3\n"
    many = b"v 0 0 0\nv 1 0 0\nv 0 1 0\n" + triangle * 24_000
    assert len(many) < 200_000
    answer = send(service, "many.obj", many)
    assert answer.status_code == 422
    assert "no volume" in answer.json()["detail"]


def test_only_so_many_are_kept(client_with: Callable[..., TestClient]) -> None:
    client = client_with(max_kept=1)
    assert send(client, "box.stl", as_stl(BOX)).status_code == 201
    answer = send(client, "fork.stl", FORK)
    assert (answer.status_code, answer.json()["code"]) == (409, "too-many-kept")


@pytest.mark.parametrize("mesh_id", ["../robots/own", "..", "%2e%2e%2fsecret", "x" * 5000, "0" * 32])
def test_no_identifier_leads_out_of_the_folder(service: TestClient, example: Document, mesh_id: str) -> None:
    assert service.get(f"/v1/meshes/{mesh_id}").status_code in (404, 405)
    assert service.delete(f"/v1/meshes/{mesh_id}").status_code in (404, 405)
    refused = service.post("/v1/layouts", json=with_obstacle(example, id=mesh_id[:60], scale=1.0))
    assert refused.status_code == 422
