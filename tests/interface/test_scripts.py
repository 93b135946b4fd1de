"""The scripts of examples/ and the example of README.md run, and print what they are there to show."""

import json
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

from tests.support.markdown import blocks_of, tokens

ROOT = Path(__file__).parents[2]
EXAMPLES = ROOT / "examples"

PRINTED = {
    "solve_request": r"line: optimal\nmain: x 15\d mm, y 95\d mm, z 0 mm, yaw -0\.87\d rad\nfollower: .*\n",
    "build_cell": r"beam: optimal\nleft: x .* degrees\n  joints .*\nright: x .* degrees\n  joints .*\n",
    "compare_robots": r"ur5e: optimal, 10\d\.\d degrees .*\npuma560: infeasible\. main: .*\n",
    "evaluate_layout": r"0 mm: feasible, objective 155\.\d\n(  .*\n){2}50 mm: .*\n(  .*\n){2}100 mm: .*\n(  .*\n){2}",
    "why_not": r"infeasible\nreason: main: .* out of reach .*\nconflict: .*base region of main\nremedy: let main .*\n",
}
"""What each of them prints. 155.2 is the optimum of the thesis' line, see README.md."""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Somewhere else than the examples."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def run(monkeypatch: pytest.MonkeyPatch, script: Path, *arguments: str) -> None:
    """Run a script in this process, which has the engines loaded."""
    monkeypatch.setattr(sys, "argv", [str(script), *arguments])
    runpy.run_path(str(script), run_name="__main__")


def test_no_script_is_forgotten() -> None:
    assert {path.stem for path in EXAMPLES.glob("*.py")} == set(PRINTED)


@pytest.mark.parametrize("name", PRINTED)
def test_a_script_prints_what_it_is_there_for(
    name: str, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    run(monkeypatch, EXAMPLES / f"{name}.py")
    output = capsys.readouterr().out
    assert re.fullmatch(PRINTED[name], output), output
    assert list(folder.iterdir()) == []


def test_an_answer_is_written_if_asked_for(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    run(monkeypatch, EXAMPLES / "solve_request.py", str(EXAMPLES / "line.json"), "answer.json")
    assert json.loads((folder / "answer.json").read_text())["result"]["outcome"] == "optimal"


def test_a_request_that_cannot_be_carried_out_is_told(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.json"
    wrong.write_text((EXAMPLES / "line.json").read_text().replace("puma560", "puma"))
    command = [sys.executable, str(EXAMPLES / "solve_request.py"), str(wrong)]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=100)
    assert done.returncode == 1
    assert re.match(r"/arms/0/robot: .*\n/arms/1/robot: ", done.stderr)


def test_the_example_of_the_readme_prints_what_is_shown(
    folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    code, shown = (block for block in blocks_of(ROOT / "README.md") if block.kind.endswith(" interface"))
    (folder / "example.py").write_text(code.text)
    run(monkeypatch, folder / "example.py")
    for one, other in zip(tokens(shown.text), tokens(capsys.readouterr().out), strict=True):
        assert one == (pytest.approx(other, abs=0.11) if isinstance(other, float) else other)
    assert json.loads((folder / "handover.json").read_text())["outcome"] == "optimal"
