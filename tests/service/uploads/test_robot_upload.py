"""A robot of a user, from the form to the layout; and everything that is refused, leaving nothing behind."""

from __future__ import annotations

import copy
import json
import os
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
import trimesh
from fastapi.testclient import TestClient

from duocell.models.catalogue import catalogue
from duocell.service.app import create_app
from duocell.service.library.library import Library
from duocell.service.requests.accept import accept
from duocell.service.settings import Settings
from duocell.service.workers.solving import solve_request
from tests.service.conftest import FakeExecutor
from tests.support.given import own_robot
from tests.support.given.own_robot import BASE, REQUEST, UPPER, WRIST, urdf, zipped

Document = dict[str, Any]


def form(**parts: Any) -> Document:
    """A good upload, with parts replaced, or left out where they are None."""
    whole = {
        "name": (None, "own"),
        "urdf": ("own.urdf", urdf()),
        "meshes": ("meshes.zip", zipped(own_robot.meshes())),
    }
    return {"files": {name: part for name, part in (whole | parts).items() if part is not None}}


def send(client: TestClient, **parts: Any) -> Any:
    return client.post("/v1/robots", **form(**parts))


def files_in(folder: Path) -> list[str]:
    """Everything but the store of the jobs, and pieces of meshes, which belong to nobody."""
    names = (str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())
    return sorted(name for name in names if not name.startswith(("duocell.sqlite3", "pieces/")))


def data_of(client: TestClient) -> Path:
    folder: Path = client.app.state.duocell.settings.data_dir  # type: ignore[attr-defined]
    return folder


def placed(layout: Document) -> Document:
    """The request to evaluate what a layout says."""
    found = layout["result"]["arms"][0]
    base = {**dict(zip("xyz", found["base"]["position"], strict=True)), "yaw": found["base"]["yaw"]}
    return REQUEST | {"arms": [REQUEST["arms"][0] | {"base": base, "joints": found["joints"]}]}


# --- the good way -----------------------------------------------------------------------------------------------------


def test_a_robot_is_brought_shown_used_and_deleted(live: TestClient) -> None:
    answer = send(live)
    assert answer.status_code == 201, answer.text
    assert answer.headers["location"] == "/v1/robots/own"
    robot = answer.json()
    assert robot == live.get("/v1/robots/own").json()
    assert [joint["name"] for joint in robot["joints"]] == [f"turn_{i}" for i in range(1, 7)]
    assert [joint["upper"] for joint in robot["joints"]] == list(own_robot.LIMITS)
    assert (robot["base_frame"], robot["flange_frame"], robot["dof"]) == ("base_link", "tool0", 6)
    assert (robot["origin"], robot["geometry"], robot["title"]) == ("uploaded", "mesh", "own arm")
    assert robot["flange_at_zero"]["position"] == pytest.approx([0.68, 0.0, 0.95])
    pieces = {body["link"]: (body["moves_with"], body["pieces"]) for body in robot["bodies"]}
    assert pieces["base_link"] == (None, 1)
    assert pieces["upper_arm"][0] == "turn_2"
    assert pieces["upper_arm"][1] >= 3  # a fork cannot be less
    assert {mesh["filename"] for mesh in robot["meshes"]} == {BASE, UPPER, WRIST}
    assert any("turn_3, turn_6" in note for note in robot["notes"])
    listed = {item["name"]: item["origin"] for item in live.get("/v1/robots").json()["items"]}
    assert listed["own"] == "uploaded"
    assert [name for name, origin in listed.items() if origin == "catalogue"] == catalogue.names()

    layout = live.post("/v1/layouts", json=REQUEST, headers={"Prefer": "wait=60"}).json()
    assert layout["status"] == "succeeded", layout["error"]
    assert layout["result"]["outcome"] == "optimal"
    assert layout["result"]["verification"]["max_position_error"] < 1e-6
    assert layout["request"]["arms"][0]["robot"] == "own"
    assert layout["request"]["arms"][0]["robot_version"] == robot["version"]

    evaluated = live.post("/v1/layouts/evaluate", json=placed(layout))
    assert evaluated.status_code == 200, evaluated.text
    score = evaluated.json()["result"]
    assert score["outcome"] == "feasible"
    assert score["arms"][0]["geometry"] == "mesh"
    assert score["objective"] == pytest.approx(layout["result"]["objective"], rel=1e-6)

    assert live.delete("/v1/robots/own").status_code == 204
    assert live.get("/v1/robots/own").status_code == 404
    assert live.post("/v1/layouts", json=REQUEST).status_code == 422
    assert "own" not in {item["name"] for item in live.get("/v1/robots").json()["items"]}


@pytest.fixture(scope="module")
def service(tmp_path_factory: pytest.TempPathFactory) -> Iterator[TestClient]:
    """A service with narrow limits for all that is refused."""
    settings = Settings(
        data_dir=tmp_path_factory.mktemp("data") / "nothing" / "yet",
        max_upload=400_000,
        max_entries=10,
        max_unpacked=2_000_000,
        upload_time_limit=10.0,
        workers=1,
    )
    with TestClient(create_app(settings, FakeExecutor()), raise_server_exceptions=False) as client:
        yield client


def test_a_robot_without_collision_geometry_is_estimated(service: TestClient) -> None:
    answer = send(service, name=(None, "bare"), urdf=(None, urdf({})), meshes=None)  # as text: `curl -F 'urdf=<file'`
    assert answer.status_code == 201, answer.text
    assert answer.json()["geometry"] == "estimated"
    assert any("estimated" in note for note in answer.json()["notes"])
    assert service.delete("/v1/robots/bare").status_code == 204


def test_limits_between_joints_come_with_an_upload(service: TestClient) -> None:
    """They are shown, hold for requests that name no others, and are part of the version."""
    row = {"coefficients": [0.0, 1.0, 1.0, 0.0, 0.0, 0.0], "lower": -1.2, "upper": 1.9, "name": "forearm"}
    plain = send(service, name=(None, "plain"), meshes=None, urdf=("own.urdf", urdf({}))).json()
    assert plain["linear_limits"] == []
    for name, rows in (("held", [row]), ("wide", [row | {"upper": 2.0}])):
        sent = {"name": (None, name), "linear_limits": (None, json.dumps(rows))}
        brought = send(service, meshes=None, urdf=("own.urdf", urdf({})), **sent)
        assert brought.status_code == 201, brought.text
        assert brought.json()["linear_limits"] == rows
        assert service.get(f"/v1/robots/{name}").json()["linear_limits"] == rows
    versions = {service.get(f"/v1/robots/{name}").json()["version"] for name in ("plain", "held", "wide")}
    assert len(versions) == 3
    library = Library(data_of(service))
    accepted = accept(json.dumps(_of("held")).encode(), Settings(), library)
    result = solve_request(accepted.text, accepted.request_hash, 60.0, library)
    assert [one["name"] for one in result["arms"][0]["linear_margins"]] == ["forearm"]
    for name in ("plain", "held", "wide"):
        assert service.delete(f"/v1/robots/{name}").status_code == 204


def _of(robot: str) -> Document:
    return REQUEST | {"arms": [REQUEST["arms"][0] | {"robot": robot}]}


@pytest.mark.parametrize(
    ("rows", "pointer"),
    [
        ("[", "/linear_limits"),
        ('[{"coefficients": [0, 1, 1], "lower": 0, "upper": 1}]', "/linear_limits/0/coefficients"),
        ('[{"coefficients": [0, 1, 1, 0, 0, 0], "lower": 2, "upper": 1}]', "/linear_limits/0/lower"),
        ('[{"coefficients": [0, 1, 1, 0, 0, 0], "lower": NaN, "upper": 1}]', "/linear_limits"),
        ('{"a": 1}', "/linear_limits"),
    ],
)
def test_limits_between_joints_that_are_none_are_refused(service: TestClient, rows: str, pointer: str) -> None:
    for missing in ("refuse", "estimate"):
        answer = send(service, linear_limits=(None, rows), missing_meshes=(None, missing))
        assert answer.status_code == 422, answer.text
        assert pointer in [error["pointer"] for error in answer.json()["errors"]]


def test_base_and_tip_may_be_chosen(service: TestClient) -> None:
    parts = {"base_link": (None, "shoulder"), "tip": (None, "hand"), "meshes": None}
    answer = send(service, urdf=("own.urdf", urdf({})), **parts)
    assert answer.status_code == 422
    assert [error["pointer"] for error in answer.json()["errors"]] == ["/tip"]
    assert "turn_2, turn_3" in answer.json()["detail"]
    answer = send(service, urdf=("own.urdf", urdf({})), **parts | {"base_link": (None, "base_link")})
    assert answer.status_code == 201
    assert answer.json()["flange_frame"] == "hand"
    assert service.delete("/v1/robots/own").status_code == 204


def test_a_name_is_given_once(service: TestClient) -> None:
    bare = {"urdf": ("own.urdf", urdf({})), "meshes": None}
    assert send(service, **bare).status_code == 201
    before = files_in(data_of(service))
    for name, code in (("own", "robot-exists"), ("OWN", "robot-exists"), ("UR10e", "catalogue-robot")):
        answer = send(service, name=(None, name), **bare)
        assert answer.status_code == 409
        assert answer.json()["code"] == code
        assert answer.json()["errors"][0]["pointer"] == "/name"
    assert files_in(data_of(service)) == before
    assert service.delete("/v1/robots/own").status_code == 204


def test_only_what_was_brought_can_be_deleted(service: TestClient) -> None:
    for name, status, code in (("puma560", 409, "catalogue-robot"), ("nobody", 404, "robot-not-found")):
        answer = service.delete(f"/v1/robots/{name}")
        assert (answer.status_code, answer.json()["code"]) == (status, code)


# --- what is refused --------------------------------------------------------------------------------------------------


def spoiled(find: str, replacement: str) -> tuple[str, str]:
    """The URDF with a text replaced."""
    assert find in urdf()
    return "own.urdf", urdf().replace(find, replacement, 1)


def archive(**files: bytes | None) -> tuple[str, bytes]:
    """The zip with files replaced by the last name of their path, or left out."""
    names = {name.rsplit("/", 1)[-1].split(".")[0]: name for name in own_robot.meshes()}
    changed = {names[name]: data for name, data in files.items()}
    whole: dict[str, bytes | None] = {**own_robot.meshes(), **changed}
    return "meshes.zip", zipped({name: data for name, data in whole.items() if data is not None})


def bomb() -> tuple[str, bytes]:
    return "meshes.zip", zipped({**own_robot.meshes(), "big.stl": b"\0" * 1_900_000})


def sheet() -> bytes:
    flat = trimesh.Trimesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [[0, 1, 2], [1, 3, 2]], process=False)
    return own_robot.as_stl(flat)


LAUGHS = '<?xml version="1.0"?><!DOCTYPE r [<!ENTITY a "ha"><!ENTITY b "&a;&a;&a;">]><robot name="&b;"/>'

REFUSED: dict[str, tuple[Document, str, str]] = {
    # name: parts of the form, the pointer that must be named, a word of the advice
    "no name": ({"name": None}, "/name", "missing"),
    "an empty name": ({"name": (None, "")}, "/name", "missing"),
    "no urdf": ({"urdf": None}, "/urdf", "missing"),
    "a folder upwards": ({"name": (None, "../own")}, "/name", "letters"),
    "two dots": ({"name": (None, "..")}, "/name", "letters"),
    "a hidden file": ({"name": (None, ".own")}, "/name", "letters"),
    "an absolute name": ({"name": (None, "/etc/passwd")}, "/name", "letters"),
    "a name with a version": ({"name": (None, "own@1")}, "/name", "letters"),
    "a name with a line break": ({"name": (None, "own\n")}, "/name", "letters"),
    "an endless name": ({"name": (None, "x" * 1000)}, "/name", "64"),
    "a name as a file": ({"name": ("own", "own")}, "/name", "without a file name"),
    "an unknown part": (
        {"colour": (None, "red")},
        "/colour",
        "allowed are name, base_link, tip, missing_meshes, linear_limits, urdf, meshes",
    ),
    "no XML": ({"urdf": ("own.urdf", "solid arm")}, "/urdf", "no valid XML"),
    "an empty urdf": ({"urdf": ("own.urdf", "")}, "/urdf", "no valid XML"),
    "laughs": ({"urdf": ("own.urdf", LAUGHS)}, "/urdf", "document type"),
    "another kind of XML": ({"urdf": ("own.urdf", "<sdf/>")}, "/urdf", "<robot>"),
    "xacro": (
        {"urdf": spoiled("<link", '<xacro:arm xmlns:xacro="http://wiki.ros.org/xacro"/><link')},
        "/urdf",
        "xacro ",
    ),
    "an unknown type of joint": ({"urdf": spoiled('"revolute"', '"screw"')}, "/urdf/joints/turn_1", "'screw'"),
    "a sliding joint": ({"urdf": spoiled('"revolute"', '"prismatic"')}, "/tip", "turning joints"),
    "no limits": ({"urdf": spoiled('<limit lower="-2.9"', '<limits lower="-2.9"')}, "/urdf/joints/turn_1", "<limit>"),
    "limits in degrees": ({"urdf": spoiled('upper="2.9"', 'upper="166"')}, "/urdf/joints/turn_1", "radians"),
    "limits that are no number": (
        {"urdf": spoiled('lower="-2.9"', 'lower="nan"')},
        "/urdf/joints/turn_1",
        "lower='nan'",
    ),
    "millimetres": ({"urdf": spoiled('"0 0 0.5"', '"0 0 500"')}, "/urdf/joints/turn_3", "metres"),
    "nowhere": ({"urdf": spoiled('"0 0 0.5"', '"0 0 nan"')}, "/urdf/joints/turn_3", "0 0 nan"),
    "an unknown base": ({"base_link": (None, "floor")}, "/base_link", "'floor'"),
    "an unknown tip": ({"tip": (None, "claw")}, "/tip", "'claw'"),
    "a broken primitive": ({"urdf": spoiled('size="0.2 0.2 0.15"', 'size="0.2"')}, "/urdf/links/shoulder", "3 number"),
    "no zip": ({"meshes": None}, "/meshes", "base_link"),
    "meshes that are no zip": ({"meshes": ("base.stl", b"solid")}, "/meshes", "zip -r"),
    "a missing mesh": ({"meshes": archive(wrist=None)}, "/meshes", "wrist.obj' of link wrist"),
    "a zip bomb": ({"meshes": bomb()}, "/meshes", "factor of 100"),
    "a path upwards": ({"meshes": ("m.zip", zipped({"../../base.stl": b""}))}, "/meshes", "leads out"),
    "an absolute path": ({"meshes": ("m.zip", zipped({"/tmp/base.stl": b""}))}, "/meshes", "leads out"),
    "many entries": ({"meshes": ("m.zip", zipped({f"{i}.stl": b"" for i in range(11)}))}, "/meshes", "11 entries"),
    "a broken mesh": ({"meshes": archive(upper_arm=b"nonsense" * 40)}, "/urdf/links/upper_arm", "no triangles"),
    "a mesh without volume": ({"meshes": archive(upper_arm=sheet())}, "/urdf/links/upper_arm", "no volume"),
    "a mesh of another format": (
        {
            "urdf": ("own.urdf", urdf({"hand": '<mesh filename="hand.step"/>'})),
            "meshes": ("m.zip", zipped({"hand.step": b""})),
        },
        "/urdf/links/hand",
        "stl, obj, dae",
    ),
    "a mesh of the internet": (
        {"urdf": ("own.urdf", urdf({"hand": '<mesh filename="https://host/hand.stl"/>'}))},
        "/meshes",
        "not fetched",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_with_advice_and_nothing_left(service: TestClient, name: str) -> None:
    parts, pointer, words = REFUSED[name]
    before = files_in(data_of(service))
    answer = send(service, **parts)
    assert answer.status_code == 422, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    found = [error["detail"] for error in answer.json()["errors"] if error["pointer"] == pointer]
    assert any(words in detail for detail in found), answer.text
    assert files_in(data_of(service)) == before


def test_all_that_is_wrong_is_told_at_once(service: TestClient) -> None:
    answer = send(service, urdf=spoiled('"revolute"', '"screw"'), meshes=("m.zip", b"no zip"))
    assert [error["pointer"] for error in answer.json()["errors"]] == ["/urdf/joints/turn_1", "/meshes"]
    answer = send(service, meshes=archive(base=None, wrist=None))
    details = [error["detail"] for error in answer.json()["errors"]]
    assert len(details) == 2
    assert BASE in details[0]
    assert WRIST in details[1]


def test_a_part_sent_twice_is_refused(service: TestClient) -> None:
    answer = service.post("/v1/robots", files=[("name", (None, "a")), ("name", (None, "b")), ("urdf", ("u", urdf({})))])
    assert answer.status_code == 422
    assert answer.json()["errors"][0] == {"pointer": "/name", "detail": "'name' was sent more than once. Send it once."}


FORM = "multipart/form-data; boundary=x"


def chunks(amount: int) -> Iterator[bytes]:
    yield b'--x\r\nContent-Disposition: form-data; name="urdf"; filename="u"\r\n\r\n'
    for _ in range(amount):
        yield b"u" * 10_000


@pytest.mark.parametrize(
    ("sent", "status", "code"),
    [
        ({"json": {"name": "own"}}, 415, "not-a-form"),
        ({"data": {"name": "own"}}, 415, "not-a-form"),
        ({"content": b"x"}, 415, "not-a-form"),
        ({"content": b"x", "headers": {"Content-Type": "multipart/form-data"}}, 400, "invalid-form"),
        ({"content": b"x", "headers": {"Content-Type": FORM}}, 400, "invalid-form"),
        ({"content": b"", "headers": {"Content-Type": FORM}}, 422, "invalid-request"),
        ({"content": b"--x\r\n\r\n\r\n--x--", "headers": {"Content-Type": FORM}}, 400, "invalid-form"),
        ({"content": b"--x", "headers": {"Content-Type": FORM + "; charset=undefined"}}, 422, "invalid-request"),
        ({"files": [("urdf", ("u", b"x"))] * 21}, 400, "invalid-form"),
        ({"files": {"urdf": ("own.urdf", b"x" * 600_000)}}, 413, "upload-too-large"),
        ({"content": chunks(100), "headers": {"Content-Type": FORM}}, 413, "upload-too-large"),
    ],
)
def test_bodies_that_are_no_form(service: TestClient, sent: Document, status: int, code: str) -> None:
    answer = service.post("/v1/robots", **sent)
    assert (answer.status_code, answer.json()["code"]) == (status, code), answer.text
    assert answer.headers["content-type"] == "application/problem+json"


# --- what goes wrong around it ----------------------------------------------------------------------------------------


def test_meshes_that_take_too_long_are_refused(client_with: Callable[..., TestClient]) -> None:
    client = client_with(upload_time_limit=0.05)
    answer = send(client)
    assert answer.status_code == 422
    assert answer.json()["code"] == "too-large"
    assert "DUOCELL_UPLOAD_TIME_LIMIT" in answer.json()["detail"]
    assert files_in(data_of(client)) == []


def crash(*arguments: Any) -> None:
    """A reader that breaks down over its input."""
    os.abort()


def test_a_reader_that_breaks_down_takes_nothing_with_it(
    client_with: Callable[..., TestClient], monkeypatch: pytest.MonkeyPatch
) -> None:
    client = client_with()
    with monkeypatch.context() as patch:
        patch.setattr("duocell.service.uploads.uploads.robot_from_upload", crash)
        answer = send(client)
    assert answer.status_code == 422
    assert answer.json()["code"] == "invalid-upload"
    assert files_in(data_of(client)) == []
    assert send(client, urdf=("own.urdf", urdf({})), meshes=None).status_code == 201


def test_only_so_many_are_kept(client_with: Callable[..., TestClient]) -> None:
    client = client_with(max_kept=1)
    bare = {"urdf": ("own.urdf", urdf({})), "meshes": None}
    assert send(client, **bare).status_code == 201
    answer = send(client, name=(None, "another"), **bare)
    assert (answer.status_code, answer.json()["code"]) == (409, "too-many-kept")


def test_a_folder_that_cannot_be_written_is_a_problem(client_with: Callable[..., TestClient], tmp_path: Path) -> None:
    (tmp_path / "file").write_text("in the way")
    client = client_with(data_dir=tmp_path / "file")
    answer = send(client, urdf=("own.urdf", urdf({})), meshes=None)
    assert (answer.status_code, answer.json()["code"]) == (503, "not-writable")
    assert client.get("/v1/robots").status_code == 200


def test_too_many_at_once_are_told_to_come_back(client_with: Callable[..., TestClient]) -> None:
    client = client_with(max_uploads=1)
    with client.app.state.duocell.places.reading.taken("another"):  # type: ignore[attr-defined]
        answer = send(client)
    assert (answer.status_code, answer.json()["code"]) == (429, "uploads-full")
    assert answer.headers["retry-after"]


# --- deleted, replaced, damaged ---------------------------------------------------------------------------------------


def test_an_accepted_layout_keeps_its_robot(client_with: Callable[..., TestClient], tmp_path: Path) -> None:
    client = client_with()
    bare = {"urdf": ("own.urdf", urdf({})), "meshes": None}
    assert send(client, **bare).status_code == 201
    accepted = accept(json.dumps(REQUEST).encode(), Settings(), Library(tmp_path))
    version = json.loads(accepted.text)["arms"][0]["robot_version"]
    assert client.delete("/v1/robots/own").status_code == 204
    other = urdf({}).replace('"0 0 0.5"', '"0 0 0.7"')
    assert send(client, urdf=("own.urdf", other), meshes=None).json()["version"] != version

    kept = Library(tmp_path, deleted=True)
    assert kept.robots()[f"own@{version}"].joint_placements[2][2, 3] == 0.5
    assert kept.robots()["own"].joint_placements[2][2, 3] == 0.7
    result = solve_request(accepted.text, accepted.request_hash, 30.0, kept)
    assert result["outcome"] == "optimal"

    again = copy.deepcopy(REQUEST)
    again["arms"][0]["robot_version"] = version
    answer = client.post("/v1/layouts", json=again)
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["pointer"] == "/arms/0/robot_version"
    assert "another version" in answer.json()["detail"]


def test_deleted_robots_are_forgotten_in_time(client_with: Callable[..., TestClient], tmp_path: Path) -> None:
    client = client_with(keep_deleted=0.0)
    assert send(client, urdf=("own.urdf", urdf({})), meshes=None).status_code == 201
    assert client.delete("/v1/robots/own").status_code == 204
    assert files_in(tmp_path) == []


def test_equal_files_are_an_equal_version(client_with: Callable[..., TestClient]) -> None:
    client = client_with()
    bare = {"urdf": ("own.urdf", urdf({})), "meshes": None}
    first = send(client, **bare).json()["version"]
    assert send(client, name=(None, "twin"), **bare).json()["version"] == first
    changed = urdf({}).replace('lower="-2.9"', 'lower="-2.8"')
    assert send(client, name=(None, "other"), urdf=("own.urdf", changed), meshes=None).json()["version"] != first


def test_a_damaged_file_is_left_out(client_with: Callable[..., TestClient], tmp_path: Path) -> None:
    (tmp_path / "robots").mkdir()
    for name, text in (("torn", "{"), ("other", '{"format": 2}'), ("list", "[]")):
        (tmp_path / "robots" / f"{name}.json").write_text(text)
    client = client_with()
    assert len(client.get("/v1/robots").json()["items"]) == len(catalogue.names())
    assert client.get("/v1/robots/torn").status_code == 404


@pytest.mark.parametrize("name", ["../secret", "..%2Fsecret", "a/b", "own@..", "%00", "x" * 5000])
def test_no_name_leads_out_of_the_folder(client_with: Callable[..., TestClient], tmp_path: Path, name: str) -> None:
    (tmp_path / "robots").mkdir()
    (tmp_path / "secret.json").write_text("{}")
    client = client_with()
    assert client.get(f"/v1/robots/{name}").status_code == 404
    assert client.delete(f"/v1/robots/{name}").status_code in (404, 405)
    request = copy.deepcopy(REQUEST)
    request["arms"][0]["robot"] = name[:200]
    assert client.post("/v1/layouts", json=request).status_code == 422
    assert (tmp_path / "secret.json").exists()


def test_refusals_are_quick(service: TestClient) -> None:
    """What is refused before anything is taken apart costs no seconds."""
    started = time.perf_counter()
    for _ in range(5):
        assert send(service, meshes=bomb()).status_code == 422
    assert time.perf_counter() - started < 60.0  # half a second each, on a machine with nothing else to do
