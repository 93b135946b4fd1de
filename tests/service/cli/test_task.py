"""`duocell task`: in millimetres and degrees; what it prints goes into a request."""

from __future__ import annotations

import io
import json
from pathlib import Path
from types import SimpleNamespace

import pytest

from duocell.service.cli.main import main

SEAM = Path(__file__).parents[3] / "examples" / "tasks" / "seam.csv"


def test_the_task_is_printed_and_what_it_was_taken_for(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["task", str(SEAM), "--tolerance", "0.5", "--angle-tolerance", "1"]) == 0
    printed = capsys.readouterr()
    found = json.loads(printed.out)
    assert 2 < len(found["task"]["poses"]) < 41
    assert found["task"]["poses"][0]["position"] == pytest.approx([0.7, 0.3, 0.12])
    assert found["understood"]["position_error"] <= 0.0005
    assert printed.err.startswith(
        f"csv, mm, rotation rpy_deg: 41 way-points, {len(found['task']['poses'])} kept (within"
    )


def test_it_is_written_where_that_is_asked(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    output = tmp_path / "task.json"
    assert main(["task", str(SEAM), "-o", str(output)]) == 0
    assert len(json.loads(output.read_text())["task"]["poses"]) == 41
    assert capsys.readouterr().out == ""


def test_standard_input_has_no_name(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    text = b"GOTO/0,0,0,0,0,1\nGOTO/100,0,0,0,0,1\n"
    monkeypatch.setattr("sys.stdin", SimpleNamespace(buffer=io.BytesIO(text)))
    assert main(["task", "-"]) == 0
    assert "free roll" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["no_such_file.csv"], "cannot be read"),
        ([str(SEAM), "--units", "m"], "mixed units"),
        ([str(SEAM), "--tolerance", "0"], "--tolerance is 0"),
        ([str(SEAM), "--angle-tolerance", "1"], "needs --tolerance"),
        ([str(SEAM), "--columns", "x,y"], "6 cells, but 2 columns are named"),
        ([str(SEAM.parents[2] / "LICENSE")], "/file: line 1: column x is missing"),
    ],
)
def test_what_cannot_be_read_is_told(arguments: list[str], words: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["task", *arguments]) == 2
    assert words in capsys.readouterr().err
