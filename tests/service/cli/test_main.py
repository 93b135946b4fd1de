"""The command line, as a process of its own where that matters."""

import json
import os
import re
import signal
import subprocess
import sys
import time
import urllib.request
from pathlib import Path
from typing import Any

import pytest

from duocell.models.geometry.decomposition import Decomposition, decompose
from duocell.models.geometry.meshes import Mesh
from duocell.models.geometry.piece_cache import PiecesInMemory
from duocell.service.cli.main import main
from duocell.service.cli.solve import exit_code, show
from duocell.service.library.library import Library
from duocell.service.library.user_robot import as_document
from duocell.service.settings import Limits
from duocell.service.uploads.robot_import import RobotFiles, robot_from_files
from tests.support.given import own_robot

Document = dict[str, Any]

COMMAND = [sys.executable, "-m", "duocell.service.cli.main"]
REPOSITORY = Path(__file__).parents[3]


def write(folder: Path, document: Document) -> str:
    path = folder / "request.json"
    path.write_text(json.dumps(document))
    return str(path)


def at(x: float, y: float, z: float) -> Document:
    return {"position": [x, y, z], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}


@pytest.fixture
def small(example: Document) -> Document:
    """A request that is quickly solved."""
    example["arms"] = example["arms"][:1]
    example["task"]["line"]["count"] = 3
    return example


def test_version(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["version"]) == 0
    assert capsys.readouterr().out.startswith("duocell ")


def test_version_loads_no_engine() -> None:
    code = (
        "import sys, duocell.service.cli.main as c; c.main(['version']); "
        "print({'numpy', 'casadi', 'fastapi'} & set(sys.modules))"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=REPOSITORY, capture_output=True, text=True, check=True)
    assert done.stdout.endswith("set()\n")


def test_robots_are_listed_and_shown(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robots"]) == 0
    assert "ur10e" in capsys.readouterr().out
    assert main(["robots", "puma560"]) == 0
    shown = capsys.readouterr().out
    assert "-160.0" in shown
    assert "shoulder height" in shown


def test_an_unknown_robot_is_bad_input(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["robots", "ur10x"]) == 2
    assert "ur10e" in capsys.readouterr().err


def test_solve_prints_millimetres_and_degrees_and_writes_the_answer(
    tmp_path: Path, small: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    small["arms"][0]["name"] = "[bold]me[/]"
    output = tmp_path / "result.json"
    assert main(["solve", write(tmp_path, small), "-o", str(output)]) == 0
    resource = json.loads(output.read_text())
    arm = resource["result"]["arms"][0]
    printed = capsys.readouterr().out
    assert f"{1000 * arm['base']['position'][0]:.2f}" in printed
    assert f"{arm['base']['yaw'] * 57.29577951308232:.3f}" in printed
    assert " ".join(arm["posture"].values()) in printed
    assert "joint 6" in printed
    assert "x [mm]" in printed
    assert "[bold]me[/]" in printed
    assert resource["status"] == "succeeded"
    assert resource["request"]["arms"][0]["weights"] == "range"


def test_solve_reads_standard_input_and_writes_standard_output(small: Document) -> None:
    done = subprocess.run(
        [*COMMAND, "solve", "-", "-o", "-"], input=json.dumps(small), cwd=REPOSITORY, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["result"]["outcome"] == "feasible"  # no proof is tried
    assert "Placements" in done.stderr


def test_an_answer_passes_its_own_check(tmp_path: Path, small: Document, capsys: pytest.CaptureFixture[str]) -> None:
    small["obstacles"] = [{"name": "floor", "pose": at(0.0, 0.0, -1.0), "shape": {"type": "half_space"}}]
    result, checked = tmp_path / "result.json", tmp_path / "checked.json"
    assert main(["solve", write(tmp_path, small), "-o", str(result)]) == 0
    assert main(["check", str(result), "-o", str(checked)]) == 0
    printed = capsys.readouterr().out
    assert "feasible, objective" in printed
    assert re.search(r"arm_obstacle │ +0\.0 │ +\d+\.\d │ +\d+\.\d │ main .* and floor", printed)
    solved, again = (json.loads(path.read_text()) for path in (result, checked))
    assert again["result"]["outcome"] == "feasible"
    assert again["result"]["objective"] == pytest.approx(solved["result"]["objective"])
    assert again["request"]["arms"][0]["joints"] == solved["result"]["arms"][0]["joints"]
    assert main(["check", str(checked)]) == 0
    assert main(["figure", str(checked), "-o", str(tmp_path / "layout.svg")]) == 0


def test_a_base_that_is_moved_is_checked_there(
    tmp_path: Path, small: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    small["arms"][0]["base"] = {"x": 0.2, "y": 0.9, "z": 0.0, "yaw": -0.8}
    assert main(["check", write(tmp_path, small)]) == 0
    small["obstacles"] = [{"name": "post", "pose": at(0.2, 0.9, 0.0), "shape": {"type": "sphere", "radius": 0.3}}]
    assert main(["check", write(tmp_path, small)]) == 3
    assert "and post penetrate by" in capsys.readouterr().out
    small["arms"][0]["base"]["x"] = [0.0, 1.0]
    assert main(["check", write(tmp_path, small)]) == 2
    assert "/arms/0/base/x: " in capsys.readouterr().err


@pytest.mark.parametrize(
    ("change", "code", "word"),
    [
        (lambda r: r["result"]["arms"][0]["base"]["position"].__setitem__(0, 9.0), 2, "stands at x = 9"),
        (lambda r: r["result"]["arms"][0]["base"]["position"].__setitem__(2, 0.01), 2, "the request allows 0 to 0"),
        (lambda r: r["result"]["arms"].clear(), 2, "no place for 'main'"),
        (lambda r: r["result"]["arms"][0].pop("joints"), 2, "no complete layout"),
        (lambda r: r["result"]["arms"][0]["joints"][1].__setitem__(2, 0.0), 3, "off its grasp"),
    ],
)
def test_a_result_that_was_changed_does_not_pass(
    tmp_path: Path, small: Document, capsys: pytest.CaptureFixture[str], change: Any, code: int, word: str
) -> None:
    result = tmp_path / "result.json"
    assert main(["solve", write(tmp_path, small), "-o", str(result)]) == 0
    resource = json.loads(result.read_text())
    change(resource)
    result.write_text(json.dumps(resource))
    capsys.readouterr()
    assert main(["check", str(result)]) == code
    assert word in "".join(capsys.readouterr())


def test_a_drawing_of_the_answer(tmp_path: Path, small: Document) -> None:
    result, drawing = tmp_path / "result.json", tmp_path / "layout.svg"
    assert main(["solve", write(tmp_path, small), "-o", str(result)]) == 0
    assert main(["figure", str(result), "-o", str(drawing)]) == 0
    assert "<svg" in drawing.read_text()


def test_a_drawing_of_something_else_is_bad_input(
    tmp_path: Path, small: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["figure", write(tmp_path, small), "-o", str(tmp_path / "layout.svg")]) == 2
    assert "/result" in capsys.readouterr().err


def test_bad_input_is_told_like_the_service_does(
    tmp_path: Path, small: Document, capsys: pytest.CaptureFixture[str]
) -> None:
    small["arms"][0]["robot"] = "ur10x"
    assert main(["solve", write(tmp_path, small)]) == 2
    complaint = capsys.readouterr().err
    assert complaint.startswith("/arms/0/robot: ")
    assert "ur10e" in complaint


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["solve", "none.json"], "cannot be read"),
        (["solve", "REQUEST", "-o", "/nowhere/result.json"], "no such folder"),
        (["solve", "REQUEST", "--robot-urdf", "name"], "NAME=FILE"),
        (["solve", "REQUEST", "--robot-urdf", "name=none.urdf"], "none.urdf"),
        (["solve", "REQUEST", "--time-limit", "-1"], "time_limit"),
        (["serve", "--port", "70000"], "port"),
        (["serve", "--workers", "0"], "workers"),
    ],
)
def test_more_bad_input(
    tmp_path: Path, small: Document, arguments: list[str], word: str, capsys: pytest.CaptureFixture[str]
) -> None:
    request = write(tmp_path, small)
    assert main([request if word == "REQUEST" else word for word in arguments]) == 2
    assert word in capsys.readouterr().err


def test_no_json_is_bad_input(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "request.json"
    path.write_text("{,}")
    assert main(["solve", str(path)]) == 2
    assert "line 1, column 2" in capsys.readouterr().err


def test_infeasible_is_3_with_reasons(tmp_path: Path, small: Document, capsys: pytest.CaptureFixture[str]) -> None:
    small["arms"][0]["base"] = {"x": 30.0, "y": 30.0, "z": 0.0, "yaw": 0.0}
    output = tmp_path / "result.json"
    assert main(["solve", write(tmp_path, small), "-o", str(output)]) == 3
    reasons = json.loads(output.read_text())["result"]["reasons"]
    assert reasons
    printed = capsys.readouterr().out
    assert reasons[0]["detail"].split()[0] in printed
    assert "warning: /arms/0/base/x: 30 m is far for a cell." in printed


def test_the_answer_is_written_also_where_nobody_reads_what_is_printed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As of `duocell solve ... -o answer.json | head -3`."""

    def gone(*_: object) -> None:
        raise BrokenPipeError

    monkeypatch.setattr("duocell.service.cli.printing.tables.print_layout", gone)
    output = tmp_path / "result.json"
    with pytest.raises(BrokenPipeError):
        show({"status": "succeeded"}, str(output))
    assert json.loads(output.read_text()) == {"status": "succeeded"}


def test_a_robot_from_a_urdf_file(tmp_path: Path, small: Document) -> None:
    names = [f"joint_{number}" for number in range(1, 7)]
    links = "".join(f'<link name="{name}"/>' for name in ("base", *(f"link_{n}" for n in range(1, 7)), "tool"))
    origins = ["0 0 0.4", "0.1 0 0", "0 0 0.45", "0.05 0 0.1", "0.35 0 0", "0.08 0 0"]
    axes = ["0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0"]
    parents = ["base", *(f"link_{n}" for n in range(1, 6))]
    joints = "".join(
        f'<joint name="{name}" type="revolute"><parent link="{parent}"/><child link="link_{index + 1}"/>'
        f'<origin xyz="{origin}"/><axis xyz="{axis}"/><limit lower="-3" upper="3" effort="1" velocity="1"/></joint>'
        for index, (name, parent, origin, axis) in enumerate(zip(names, parents, origins, axes, strict=True))
    )
    joints += '<joint name="fixed" type="fixed"><parent link="link_6"/><child link="tool"/></joint>'
    urdf = tmp_path / "arm.urdf"
    urdf.write_text(f'<?xml version="1.0"?><robot name="arm">{links}{joints}</robot>')
    small["arms"][0] |= {"robot": "mine", "reference": None}
    output = tmp_path / "result.json"
    arguments = ["solve", write(tmp_path, small), "-o", str(output), "--robot-urdf", f"mine={urdf}:base:tool"]
    assert main(arguments) == 0
    assert json.loads(output.read_text())["result"]["verification"]["max_position_error"] < 1e-6
    assert main(["figure", str(output), "-o", str(tmp_path / "a.svg"), "--robot-urdf", f"mine={urdf}:base:tool"]) == 0
    assert main(["solve", write(tmp_path, small)]) == 2


def test_a_urdf_file_brings_the_shape_of_its_links(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], small: Document
) -> None:
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    folder = tmp_path / "own_arm" / "urdf"
    for name, data in own_robot.meshes().items():
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).write_bytes(data)
    folder.mkdir()
    (folder / "own.urdf").write_text(own_robot.urdf())
    small["arms"][0] |= {"robot": "own", "reference": None}
    option = ["--robot-urdf", f"own={folder / 'own.urdf'}"]
    solve = ["solve", write(tmp_path, small), "-o", str(tmp_path / "result.json"), *option]

    def geometry() -> str:
        assert main(solve) == 0
        arm = json.loads((tmp_path / "result.json").read_text())["result"]["arms"][0]
        return str(arm["geometry"])

    taken_apart: list[Mesh] = []

    def counted(mesh: Mesh, most: int) -> Decomposition:
        taken_apart.append(mesh)
        return decompose(mesh, most)

    monkeypatch.setattr("duocell.models.geometry.link_meshes.decompose", counted)
    monkeypatch.setattr("duocell.models.geometry.link_meshes._in_memory", PiecesInMemory())
    assert [geometry(), geometry()] == ["mesh", "mesh"]
    assert len(taken_apart) == 3  # of three meshes; the second time they were known
    assert main(["check", str(tmp_path / "result.json"), *option]) == 0
    assert capsys.readouterr().err == ""

    (tmp_path / "own_arm" / "meshes" / "collision" / "base.stl").unlink()
    assert main(solve) == 2
    assert 'missing_meshes "estimate"' in capsys.readouterr().err
    solve += ["--missing-meshes", "estimate"]
    assert geometry() == "estimated"
    warning = capsys.readouterr().err
    assert "base.stl of link base_link" in warning
    assert "estimated" in warning


def test_robots_of_the_data_folder_are_known(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], small: Document
) -> None:
    monkeypatch.setenv("DUOCELL_DATA_DIR", str(tmp_path))
    files = RobotFiles("own", "own.urdf", own_robot.urdf({}).replace("turn_1", "[/turn]").encode())
    Library(tmp_path).robot_store.put("own", as_document(robot_from_files(files, Limits())))
    assert main(["robots"]) == 0
    assert "own arm" in capsys.readouterr().out
    assert main(["robots", "own"]) == 0
    shown = capsys.readouterr().out
    assert "[/turn]" in shown
    assert "shape of the links: estimated" in shown
    small["arms"][0] |= {"robot": "own", "reference": None}
    assert main(["solve", write(tmp_path, small)]) == 0


def test_an_interrupt_is_130(tmp_path: Path, example: Document) -> None:
    example["task"]["line"]["count"] = 5000
    process = subprocess.Popen([*COMMAND, "solve", write(tmp_path, example)], cwd=REPOSITORY, stderr=subprocess.PIPE)
    time.sleep(3.0)
    assert process.poll() is None
    os.kill(process.pid, signal.SIGINT)
    _, complaint = process.communicate(timeout=10.0)
    assert process.returncode == 130
    assert complaint.endswith(b"interrupted\n")


def test_a_limit_that_leaves_nothing_is_5(tmp_path: Path, example: Document) -> None:
    assert main(["solve", write(tmp_path, example), "--time-limit", "0.001"]) == 5


@pytest.mark.parametrize(
    ("outcome", "ended", "code"),
    [
        ("optimal", True, 0),
        ("optimal", False, 0),
        ("feasible", True, 0),
        ("feasible", None, 0),
        ("feasible", False, 4),
        ("infeasible", True, 3),
        ("infeasible", False, 3),
        ("unknown", True, 5),
        ("unknown", False, 5),
    ],
)
def test_exit_codes(outcome: str, ended: bool | None, code: int) -> None:
    assert exit_code({"outcome": outcome, "search": {"ended": ended}}) == code


def test_serve_answers_and_leaves_when_told(tmp_path: Path) -> None:
    log = tmp_path / "log"
    command = [*COMMAND, "serve", "--port", "0", "--workers", "1", "--data-dir", str(tmp_path)]
    with log.open("wb") as stream:
        process = subprocess.Popen(command, cwd=REPOSITORY, stderr=stream)
    try:
        for _ in range(200):
            address = re.search(r"http://127\.0\.0\.1:\d+", log.read_text())
            if address is not None:
                break
            time.sleep(0.1)
        assert address is not None, log.read_text()
        with urllib.request.urlopen(f"{address[0]}/healthz", timeout=10.0) as answer:
            assert json.load(answer)["status"] == "ok"
    finally:
        process.send_signal(signal.SIGTERM)
        code = process.wait(timeout=15.0)
    assert code in (0, -signal.SIGTERM)
