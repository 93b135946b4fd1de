"""CONTRIBUTING.md: its examples work, its commands and files exist."""

import csv
import json
import re
import shlex
from dataclasses import replace
from math import cos, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.objective.measure import Measure
from duocell.models.objective.registry import MEASURES, objective_from
from duocell.optimizer.optimize import optimize
from duocell.service.exports.export import Export, NothingToExport
from duocell.service.exports.exports import exported
from duocell.service.requests.accept import accept
from duocell.service.requests.convert import cell_of, settings_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.settings import Limits
from duocell.service.validation import validate
from duocell.service.workers.solving import solve_request
from tests.support.markdown import blocks_of
from tests.support.oracles.answers import assert_sound

ROOT = Path(__file__).parents[2]
PAGE = ROOT / "CONTRIBUTING.md"
TEXT, BLOCKS = PAGE.read_text(encoding="utf-8"), blocks_of(PAGE)
LINE: dict[str, Any] = json.loads((ROOT / "examples" / "line.json").read_text())


def names_of(kind: str, **given: Any) -> dict[str, Any]:
    """What the one example of a kind defines, beside what others did."""
    (block,) = [block for block in BLOCKS if block.kind == f"python {kind}"]
    names: dict[str, Any] = {"__name__": f"example_{kind}", **given}
    exec(compile(block.text, str(block), "exec"), names)
    return names


def test_every_block_is_checked_by_a_test() -> None:
    assert {block.kind for block in BLOCKS} == {
        "sh",
        "python robot",
        "python coupling",
        "python schema",
        "python export",
        "python objective",
    }


def test_every_file_that_is_named_exists() -> None:
    examples = {"models/cell/coupling/raised.py", "service/exports/base_table.py", "models/objective/overhang.py"}
    named = set(
        re.findall(r"`((?:service|optimizer|models|tests|docs|bench|src)/[\w./-]*|[\w-]+\.(?:toml|md|lock))`", TEXT)
    )
    assert named > examples
    tables = {f"models/catalogue/robots/{name}" for name in ("arms.toml", "frames.toml", "links.toml")}
    missing = {name for name in named - examples if not (ROOT / name).exists()}
    assert {f"models/catalogue/robots/{name}" for name in missing} == tables
    assert all((ROOT / table).exists() for table in tables)
    for target in re.findall(r"\]\(([^)\s]+)\)", TEXT):
        assert (ROOT / target).exists(), target


def test_every_command_exists() -> None:
    makefile = (ROOT / "Makefile").read_text()
    for line in (line for block in BLOCKS if block.kind == "sh" for line in block.commands):
        words = [word for word in shlex.split(line) if not re.match(r"\w+=", word)]
        if words[0] == "make":
            assert re.search(rf"^{words[1]}: ", makefile, re.M), line
        elif words[1:2] == ["-m"]:
            assert (ROOT / f"{words[2].replace('.', '/')}.py").exists()
        else:
            assert words[0].split("/")[-1] in ("grep", "lint-imports")


def test_the_robot_is_that_of_its_table_and_is_placed() -> None:
    names = names_of("robot")
    robot, expected = names["bench_arm"](), np.eye(4)
    q = np.array([0.3, -1.2, 0.4, 0.7, -0.9, 1.1])
    for (alpha, a, d, _, _), angle in zip(names["TABLE"], q, strict=True):
        c, s, ca, sa = cos(angle), sin(angle), cos(radians(alpha)), sin(radians(alpha))
        a, d = a / 1000.0, d / 1000.0
        expected = expected @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    assert np.abs(flange_poses(robot, q)[0] - expected).max() < 1e-12
    assert closed_form(robot) is not None
    request = validate(LayoutRequest, {**LINE, "arms": LINE["arms"][:1], "certificate": None})
    cell = cell_of(request)
    arm = replace(
        cell.arms[0], robot=robot, lower=robot.lower, upper=robot.upper, reference=robot.reference, weights=np.ones(6)
    )
    cell = replace(cell, arms=(arm,))
    layout = optimize(cell, settings_of(request, 60.0))
    assert layout.usable
    assert_sound(cell, layout)


def test_the_coupling_is_kept() -> None:
    height = -0.15
    raised = names_of("coupling")["Raised"]((0, 1), height)
    arms = [{**arm, "base": {**arm["base"], "z": [-0.2, 0.2]}} for arm in LINE["arms"]]
    request = validate(LayoutRequest, {**LINE, "arms": arms, "certificate": None})
    free = cell_of(request)
    tied, loose = (optimize(cell, settings_of(request, 60.0)) for cell in (replace(free, couplings=(raised,)), free))
    first, second = (placement.position for placement in tied.placements)
    assert second[2] - first[2] == pytest.approx(height, abs=1e-6)
    assert tied.objective is not None
    assert loose.objective is not None
    assert tied.objective >= loose.objective - 1e-6
    assert_sound(free, tied)


def test_the_fields_of_the_coupling_become_it() -> None:
    raised = names_of("coupling")["Raised"]
    tie = names_of("schema", Raised=raised)["RaisedTie"]
    asked = validate(tie, {"type": "raised", "arms": ["main", "follower"], "height": 0.25})
    made = asked.made((1, 0))
    assert made == raised((1, 0), 0.25)
    assert list(asked.lengths()) == [("height", [0.25])]
    (row,) = made.relations()
    bases = ((0.0, 0.0, 0.75, 0.0), (0.0, 0.0, 0.5, 0.0))
    assert made.rows(bases).values == (0.25,)
    assert sum(np.dot(bases[arm][:3], way) for arm, way in row.terms) == row.low == row.high == 0.25


def test_the_export_has_a_row_per_arm() -> None:
    accepted = accept(json.dumps({**LINE, "certificate": None}).encode(), Limits())
    result = solve_request(accepted.text, accepted.request_hash, 60.0)
    make = names_of("export")["base_table"]
    export = Export("bases.csv", "the bases", "text/csv", lambda resource, library: bytes(make(resource)))
    head, *rows = csv.reader(exported(export, {"result": result}, None).decode().splitlines())
    assert head == ["arm", "x", "y", "z", "yaw"]
    for row, arm in zip(rows, result["arms"], strict=True):
        assert row[0] == arm["name"]
        assert [float(value) for value in row[1:]] == [*arm["base"]["position"], arm["base"]["yaw"]]
    with pytest.raises(NothingToExport):
        exported(export, {"result": {"arms": []}}, None)


def test_the_objective_is_minimised(monkeypatch: pytest.MonkeyPatch) -> None:
    overhang: Measure = names_of("objective")["Overhang"]()
    monkeypatch.setitem(MEASURES, overhang.name, overhang)
    cell = cell_of(validate(LayoutRequest, {**LINE, "certificate": None}))
    asked = replace(cell, objective=objective_from([("overhang", 1.0)]))
    usual, found = (optimize(one, settings_of(validate(LayoutRequest, LINE), 60.0)) for one in (cell, asked))
    assert_sound(asked, found)
    for arm, here, there in zip(cell.arms, usual.placements, found.placements, strict=True):
        q = here.joints
        sideways = [float(np.hypot(*pose[:2, 3])) for pose in flange_poses(arm.robot, q)]
        assert overhang.values(arm, q) == pytest.approx(sideways, rel=1e-9)
        assert there.objective == pytest.approx(float(np.sum(overhang.values(arm, there.joints) ** 2)), rel=1e-9)
        assert there.objective < 0.9 * float(np.sum(np.square(sideways)))
        step, slopes = 1e-6, overhang.gradient(arm, q, np.ones(len(q)))
        for k, unit in enumerate(step * np.eye(arm.dof)):
            ahead, behind = (overhang.costs(arm, q + sign * unit) for sign in (1.0, -1.0))
            assert slopes[:, k] == pytest.approx((ahead - behind) / (2.0 * step), abs=1e-6)
