"""Task files over HTTP: read, refused with their place, and fit for a request."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from fastapi.testclient import TestClient

from bench.draws.task_file_draw import WRITERS, drawn_way

EXAMPLES = Path(__file__).parents[3] / "examples" / "tasks"
SEAM = (EXAMPLES / "seam.csv").read_bytes()


def send(client: TestClient, data: bytes, name: str = "way", **given: str) -> Any:
    return client.post("/v1/tasks/import", files={"file": (name, data)}, data=given)


def test_files_of_every_kind_become_tasks(client: TestClient) -> None:
    way = drawn_way(np.random.default_rng(1), 5)
    for name, write in WRITERS.items():
        answer = send(client, write(way).encode())
        assert answer.status_code == 200, answer.text
        found = answer.json()
        assert found["understood"]["format"] == name
        assert found["understood"]["free_roll"] == (name in ("apt", "gcode"))
        positions = [pose["position"] for pose in found["task"]["poses"]]
        np.testing.assert_allclose(positions, way.positions, rtol=0.0, atol=1e-8)


def test_the_task_goes_into_a_request_as_it_is(client: TestClient, example: dict[str, Any]) -> None:
    found = send(client, SEAM, "seam.csv", tolerance="0.0005", angle_tolerance="0.02").json()
    understood = found["understood"]
    assert (understood["read"], understood["units"], understood["rotation"]) == (41, "mm", "rpy_deg")
    assert 2 <= understood["kept"] == len(found["task"]["poses"]) < 41
    assert 0.0 < understood["position_error"] <= 0.0005
    assert 0.0 < understood["rotation_error"] <= 0.02
    request = copy.deepcopy(example) | {"task": found["task"]}
    assert client.post("/v1/layouts", json=request).status_code == 202


REFUSED: list[tuple[bytes, dict[str, str], str, str]] = [
    (
        SEAM.replace(b",180,-20,43.304", b",180,down,43.304", 1),
        {},
        "/file",
        "line 2, column 5: column 'pitch [deg]'",
    ),
    (SEAM.replace(b"z [mm]", b"z [m]"), {}, "/file", "line 1: mixed units"),
    (SEAM, {"format": "step"}, "/file", "format is 'step'; it must be one of json"),
    (SEAM, {"tolerance": "fine"}, "/tolerance", "is 'fine'; a number greater than 0"),
    (SEAM, {"tolerance": "0"}, "/tolerance", "greater than 0"),
    (SEAM, {"tolerance": "nan"}, "/tolerance", "greater than 0"),
    (SEAM, {"angle_tolerance": "0.1"}, "/tolerance", "missing beside angle_tolerance"),
    (b"", {}, "/file", "the file is empty"),
    (SEAM, {"unit": "mm"}, "/unit", "is not known here; allowed are format, units"),
]


def test_refusals_name_the_part_and_the_place(client: TestClient) -> None:
    for data, given, pointer, words in REFUSED:
        answer = send(client, data, "seam.csv", **given)
        assert answer.status_code == 422
        (issue,) = answer.json()["errors"]
        assert issue["pointer"] == pointer
        assert words in issue["detail"]


def test_a_file_is_needed(client: TestClient) -> None:
    answer = client.post("/v1/tasks/import", files={"other": ("a.csv", SEAM)})
    assert answer.status_code == 422
    answer = client.post("/v1/tasks/import", json={})
    assert answer.status_code == 415


def test_sizes_are_limited(client_with: Callable[..., TestClient]) -> None:
    client = client_with(max_poses=20, max_body=3000)
    assert "41 poses; allowed are 20 (DUOCELL_MAX_POSES). Send a tolerance" in send(client, SEAM).json()["detail"]
    assert send(client, SEAM, tolerance="0.001", angle_tolerance="0.05").status_code == 200
    answer = send(client, SEAM + SEAM + SEAM)
    assert answer.status_code == 422
    assert "more than 3000 bytes (DUOCELL_MAX_BODY)" in answer.json()["detail"]


def test_times_are_limited(client_with: Callable[..., TestClient]) -> None:
    answer = send(client_with(accept_limit=1e-4), SEAM)
    assert answer.status_code == 422
    assert "Reading it takes longer than 0.0001 s (DUOCELL_ACCEPT_LIMIT). Send fewer way-points." in answer.text


def test_every_example_is_read(client: TestClient) -> None:
    for path in sorted(EXAMPLES.iterdir()):
        answer = send(client, path.read_bytes(), path.name)
        assert answer.status_code == 200, answer.text
        assert json.loads(answer.text)["understood"]["guessed"] == []
