"""Robots and meshes belong to the key that brought them; names of two keys do not get into each other's way."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.http.keys import hash_line, new_key
from duocell.service.library.document_stores import DocumentStores, View
from duocell.service.library.library import Library
from duocell.service.workers.solving import solve_request
from tests.service.uploads.test_robot_upload import send as send_robot
from tests.support.given.own_robot import REQUEST, as_stl, fork, urdf

Make = Callable[..., TestClient]
NAMES = ("Press", "press", "gateway")
KEYS = {name: new_key() for name in NAMES}
HASHES = " ".join(hash_line(name, key) for name, key in KEYS.items())
OTHER = urdf({}).replace('"0 0 0.5"', '"0 0 0.7"')


def as_key(client: TestClient, name: str) -> TestClient:
    client.headers["X-API-Key"] = KEYS[name]
    return client


def bring(client: TestClient, text: str = urdf({}), name: str = "own") -> Any:
    return send_robot(client, name=(None, name), urdf=("own.urdf", text), meshes=None)


def bring_mesh(client: TestClient, label: str) -> Any:
    return client.post("/v1/meshes", files={"mesh": ("fork.stl", as_stl(fork()))}, data={"name": label})


def uploaded(client: TestClient) -> list[str]:
    return [item["name"] for item in client.get("/v1/robots").json()["items"] if item["origin"] == "uploaded"]


def test_each_key_sees_uses_and_deletes_its_own_robots(client_with: Make) -> None:
    client = client_with(api_keys=HASHES)
    assert bring(as_key(client, "press")).status_code == 201
    other = as_key(client, "gateway")
    assert uploaded(other) == []
    assert other.get("/v1/robots/own").status_code == 404
    assert other.delete("/v1/robots/own").status_code == 404
    refused = other.post("/v1/layouts", json=REQUEST)
    assert (refused.status_code, refused.json()["code"]) == (422, "unknown-robot")
    mine = as_key(client, "press")
    assert uploaded(mine) == ["own"]
    assert mine.post("/v1/layouts", json=REQUEST).status_code == 202
    assert mine.delete("/v1/robots/own").status_code == 204
    assert uploaded(mine) == []


def test_two_keys_may_give_one_name_to_two_robots(client_with: Make, tmp_path: Path) -> None:
    client = client_with(api_keys=HASHES)
    versions = [
        bring(as_key(client, "press")).json()["version"],
        bring(as_key(client, "gateway"), OTHER).json()["version"],
    ]
    assert versions[0] != versions[1]
    for key, version, shoulder in (("press", versions[0], 0.5), ("gateway", versions[1], 0.7)):
        accepted = as_key(client, key).post("/v1/layouts", json=REQUEST).json()["request"]
        assert accepted["arms"][0]["robot_version"] == version
        workers = Library(tmp_path, deleted=True)  # sees all, and takes the one that was meant
        assert workers.robots()[f"own@{version}"].joint_placements[2][2, 3] == shoulder
    assert as_key(client, "press").delete("/v1/robots/own").status_code == 204
    assert uploaded(as_key(client, "gateway")) == ["own"]
    kept = Library(tmp_path, deleted=True)
    assert kept.robots()[f"own@{versions[0]}"].joint_placements[2][2, 3] == 0.5  # for what was accepted before


def test_a_layout_of_a_robot_that_one_key_owns_is_solved(client_with: Make, tmp_path: Path) -> None:
    client = as_key(client_with(api_keys=HASHES), "press")
    assert bring(client).status_code == 201
    request = json.dumps(client.post("/v1/layouts", json=REQUEST).json()["request"])
    assert solve_request(request, "", 30.0, Library(tmp_path, deleted=True))["outcome"] == "optimal"


def test_each_key_sees_uses_and_deletes_its_own_meshes(client_with: Make, example: dict[str, Any]) -> None:
    client = client_with(api_keys=HASHES)
    mesh = bring_mesh(as_key(client, "press"), "fixture").json()
    pose = {"position": [5.0, 5.0, 0.0], "orientation": {"rpy": [0.0, 0.0, 0.0]}}
    obstacle = {"name": "fixture", "pose": pose, "shape": {"type": "mesh", "id": mesh["id"]}}
    request = copy.deepcopy(example) | {"obstacles": [obstacle]}
    assert client.post("/v1/layouts", json=request).status_code == 202
    other = as_key(client, "gateway")
    assert other.get("/v1/meshes").json()["items"] == []
    assert other.get(mesh["href"]).status_code == other.delete(mesh["href"]).status_code == 404
    assert other.post("/v1/layouts", json=request).json()["code"] == "unknown-mesh"
    again = bring_mesh(other, "gate")
    assert (again.status_code, again.json()["name"], again.json()["id"]) == (201, "gate", mesh["id"])
    assert other.delete(mesh["href"]).status_code == 204
    assert [item["name"] for item in as_key(client, "press").get("/v1/meshes").json()["items"]] == ["fixture"]


def test_what_nobody_owns_is_seen_by_all_and_deleted_by_none(client_with: Make) -> None:
    before = client_with()
    assert bring(before).status_code == 201
    mesh = bring_mesh(before, "fixture").json()
    client = as_key(client_with(api_keys=HASHES), "press")
    assert uploaded(client) == ["own"]
    assert client.get("/v1/robots/own").status_code == 200
    assert [item["id"] for item in client.get("/v1/meshes").json()["items"]] == [mesh["id"]]
    for address in ("/v1/robots/own", mesh["href"]):
        refused = client.delete(address)
        assert (refused.status_code, refused.json()["code"]) == (403, "belongs-to-all")
    taken = bring(client, OTHER, "OWN")
    assert (taken.status_code, taken.json()["code"]) == (409, "robot-exists")


def test_shared_uploads_belong_to_everybody(client_with: Make) -> None:
    alone = client_with(api_keys=HASHES)
    assert bring(as_key(alone, "press")).status_code == 201
    assert bring(as_key(alone, "gateway"), OTHER).status_code == 201
    client = client_with(api_keys=HASHES, shared=True)
    versions = [as_key(client, name).get("/v1/robots/own").json()["version"] for name in ("press", "gateway", "Press")]
    assert versions[0] != versions[1]  # one's own goes first
    assert versions[2] in versions[:2]
    assert bring(as_key(client, "Press"), name="ours").status_code == 201
    assert uploaded(as_key(client, "gateway")) == ["ours", "own"]
    assert bring(client, name="ours").status_code == 409
    assert client.delete("/v1/robots/ours").status_code == 204


def test_each_key_has_places_of_its_own(client_with: Make) -> None:
    client = client_with(api_keys=HASHES, max_kept=1)
    assert bring(as_key(client, "press")).status_code == 201
    assert bring(client, OTHER, "second").json()["code"] == "too-many-kept"
    assert bring(as_key(client, "gateway"), OTHER, "second").status_code == 201


@pytest.mark.parametrize("owner", ["..", ".", "a" * 64, "press"])
def test_folders_of_keys_lie_in_one_folder_and_differ(tmp_path: Path, owner: str) -> None:
    stores = DocumentStores(tmp_path / "robots")
    assert stores.of(owner).put("own", {"format": 1})
    (file,) = tmp_path.rglob("own.json")
    assert file.resolve().parent.parent == (tmp_path / "robots" / ".keys").resolve()
    assert stores.of("").names() == stores.of(owner.upper() + "x").names() == []
    assert stores.of("PRESS").put("own", {}) or owner == "PRESS"
    assert stores.seen_by(View(tmp_path, owner, False)) == [stores.of(owner), stores.of("")]
