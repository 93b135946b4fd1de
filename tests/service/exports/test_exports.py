"""Every export of a layout: on the command line, over HTTP, and what is answered where there is nothing to export."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.cli.main import main
from duocell.service.exports.export import NothingToExport
from duocell.service.exports.exports import EXPORTS, export_of, exported

Document = dict[str, Any]
Make = Callable[..., TestClient]
WAIT = {"Prefer": "wait=10"}
BEGINS = {".csv": b"arm,pose,", ".svg": b"<?xml", ".pdf": b"%PDF", ".png": b"\x89PNG"}
LAYOUT: dict[str, Any] = {
    "arms": [
        {"name": "left", "joints": [[0.1, 0.2], [0.3, 0.4]]},
        {"name": "=right, 2", "joints": [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]},
    ]
}


def test_the_joint_table_has_a_row_per_arm_and_pose() -> None:
    export = export_of("joints.csv")
    assert export is not None
    rows = list(csv.reader(exported(export, {"result": LAYOUT}, None).decode().splitlines()))
    assert rows == [
        ["arm", "pose", "joint_1", "joint_2", "joint_3"],
        ["left", "0", "0.1", "0.2", ""],
        ["left", "1", "0.3", "0.4", ""],
        ["'=right, 2", "0", "1.0", "2.0", "3.0"],  # no formula
        ["'=right, 2", "1", "4.0", "5.0", "6.0"],
    ]


@pytest.mark.parametrize("result", [None, {"arms": []}])
def test_there_is_no_table_without_joints(result: Any) -> None:
    export = export_of("joints.csv")
    assert export is not None
    with pytest.raises(NothingToExport):
        exported(export, {"result": result}, None)


@pytest.mark.parametrize("export", EXPORTS, ids=lambda export: export.name)
def test_every_export_comes_over_http_and_from_the_command_line_alike(
    export: Any, client: TestClient, example: Document, tmp_path: Path, capfdbinary: pytest.CaptureFixture[bytes]
) -> None:
    example["task"]["line"]["count"] = 2  # as many poses as the made-up answer has
    resource = client.post("/v1/layouts", json=example, headers=WAIT).json()
    answer = client.get(f"/v1/layouts/{resource['id']}/exports/{export.name}")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == export.media_type
    assert answer.headers["content-disposition"] == f'attachment; filename="{resource["id"]}_{export.name}"'
    assert answer.content.startswith(BEGINS[Path(export.name).suffix])
    given, made = tmp_path / "layout.json", tmp_path / export.name
    given.write_text(json.dumps(resource))
    assert main(["export", str(given), export.name, "-o", str(made)]) == 0
    assert made.read_bytes() == answer.content
    capfdbinary.readouterr()
    assert main(["export", str(given), export.name]) == 0
    assert capfdbinary.readouterr().out == answer.content


def test_problems_say_what_is_missing(client_with: Make, fake: Any, example: Document) -> None:
    client = client_with()
    done = client.post("/v1/layouts", json=example, headers=WAIT).headers["location"]
    fake.seconds = 60.0
    busy = client.post("/v1/layouts", json=example).headers["location"]
    cases = [
        (f"{done}/exports/joints.xlsx", 404, "export-not-found", "joints.csv"),
        (f"{busy}/exports/joints.csv", 409, "layout-active", "finished"),
        ("/v1/layouts/lay_nothing/exports/joints.csv", 404, "layout-not-found", "no layout"),
    ]
    for address, status, code, words in cases:
        answer = client.get(address)
        assert (answer.status_code, answer.json()["code"]) == (status, code)
        assert words in answer.json()["detail"]
    client.post(f"{busy}/cancel")
    answer = client.get(f"{busy}/exports/joints.csv")
    assert (answer.status_code, answer.json()["code"]) == (409, "nothing-to-export")


def test_the_document_lists_every_export(client: TestClient) -> None:
    operation = client.get("/openapi.json").json()["paths"]["/v1/layouts/{layout_id}/exports/{name}"]["get"]
    (name,) = [parameter for parameter in operation["parameters"] if parameter["name"] == "name"]
    assert name["schema"]["enum"] == [export.name for export in EXPORTS]
    content = operation["responses"]["200"]["content"]
    assert set(content) == {export.media_type.partition(";")[0] for export in EXPORTS}


def test_an_unknown_export_and_a_file_that_is_no_layout(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    given = tmp_path / "layout.json"
    given.write_text(json.dumps({"result": None}))
    assert main(["export", str(given), "joints.xlsx"]) == 2
    assert "floor_plan.svg" in capsys.readouterr().err
    assert main(["export", str(given), "joints.csv"]) == 2
    assert "no finished layout" in capsys.readouterr().err
    assert main(["figure", str(given), "-o", str(tmp_path / "plan.gif")]) == 2
    assert ".png" in capsys.readouterr().err
