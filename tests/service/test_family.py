"""Several jobs in one request: read, refused with the place, solved, told apart in the answer, drawn."""

from __future__ import annotations

import copy
import io
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from duocell.models.base.pose import rotation_from_rpy, transform
from duocell.optimizer.optimize import optimize
from duocell.service.cli.printing.tables import print_layout
from duocell.service.common.issues import InvalidRequest
from duocell.service.figure.figure import draw_layout
from duocell.service.requests.accept import accept
from duocell.service.requests.convert import cell_of, settings_of
from duocell.service.results.documents import result_document
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.result import LayoutResult
from duocell.service.schemas.task import ARC, JOBS, LINE
from duocell.service.settings import Limits
from duocell.service.validation import validate

Document = dict[str, Any]
EXAMPLE: Document = json.loads((Path(__file__).parents[2] / "examples" / "family.json").read_text())
GRASP = {"position": [0.0, 0.1, 0.0], "orientation": {"rpy": [0.3, 0.0, 0.0]}}
FAR = GRASP | {"position": [1e5, 0.0, 0.0]}


@pytest.fixture
def request_of_jobs(example: Document) -> Document:
    """The example of the service with the jobs of the documentation."""
    document = copy.deepcopy(example)
    del document["task"]
    document["tasks"] = copy.deepcopy(JOBS)
    return document


def cell(document: Document) -> Any:
    return cell_of(validate(LayoutRequest, document))


def issues(document: Document, limits: Limits | None = None) -> dict[str, str]:
    with pytest.raises(InvalidRequest) as caught:
        accept(json.dumps(document).encode(), limits or Limits())
    assert all(issue.detail.endswith((".", "?")) for issue in caught.value.issues)
    return {issue.pointer: issue.detail for issue in caught.value.issues}


def test_jobs_become_one_task(request_of_jobs: Document) -> None:
    request_of_jobs["tasks"][1]["grasps"] = {"follower": GRASP}
    made = cell(request_of_jobs)
    lone = [cell(request_of_jobs | {"tasks": None, "task": way}) for way in ({"line": LINE}, {"arc": ARC})]
    assert np.array_equal(made.task.poses, np.concatenate([one.task.poses for one in lone]))
    assert made.task.starts == (0, 10)
    assert made.task.names == ("carry", "turn")
    assert made.task.weights.tolist() == [1.0] * 10 + [0.5] * 10
    main, follower = made.arms
    assert main.grasps is None
    assert np.array_equal(follower.grasps[0], follower.grasp)
    assert np.allclose(follower.grasps[1], transform(rotation_from_rpy([0.3, 0.0, 0.0]), [0.0, 0.1, 0.0]))


def test_what_is_left_out_is_filled_in(request_of_jobs: Document) -> None:
    filled = json.loads(accept(json.dumps(request_of_jobs).encode(), Limits()).text)
    assert filled["task"] is None
    assert [(job["weight"], job["grasps"]) for job in filled["tasks"]] == [(1.0, {}), (0.5, {})]
    again = json.loads(accept(json.dumps(filled).encode(), Limits()).text)
    assert again == filled


def test_exactly_one_of_task_and_tasks(request_of_jobs: Document) -> None:
    both = request_of_jobs | {"task": {"line": LINE}}
    assert "exactly one of task, tasks" in issues(both)["/task"]
    neither = {name: value for name, value in request_of_jobs.items() if name != "tasks"}
    assert "missing" in issues(neither)["/task"]
    assert "missing" in issues(neither | {"task": None, "tasks": None})["/task"]
    assert "at least 1" in issues(request_of_jobs | {"tasks": []})["/tasks"]


@pytest.mark.parametrize(
    ("change", "pointer", "word"),
    [
        ({"name": "carry"}, "/tasks/1/name", "unique"),
        ({"name": ""}, "/tasks/1/name", "at least 1"),
        ({"weight": -1.0}, "/tasks/1/weight", "at least 0"),
        ({"weight": 1e300}, "/tasks/1/weight", "at most"),
        ({"weight": True}, "/tasks/1/weight", "boolean"),
        ({"task": {}}, "/tasks/1/task", "exactly one of"),
        ({"task": {"poses": [GRASP]}}, "/tasks/1/task/poses", "repeat"),
        ({"task": {"line": {**LINE, "count": 1}}}, "/tasks/1/task/line/count", "at least 2"),
        ({"task": {"arc": {**ARC, "center": [0.1, 0.0, 0.1]}}}, "/tasks/1/task/arc/center", "centre"),
        ({"task": {"line": {**LINE, "end": FAR}}}, "/tasks/1/task/line/end/position/0", "metres"),
        ({"grasps": {"nobody": GRASP}}, "/tasks/1/grasps/nobody", "'main', 'follower'"),
        ({"grasps": {"a/b": GRASP}}, "/tasks/1/grasps/a~1b", "No arm"),
        ({"grasps": {"main": FAR}}, "/tasks/1/grasps/main/position/0", "metres"),
        (
            {"grasps": {"main": {"position": [0, 0, 0], "orientation": {"quaternion": [0, 0, 0, 0]}}}},
            "/tasks/1/grasps/main/orientation/quaternion",
            "[0, 0, 0, 1]",
        ),
        ({"grasps": {"main": None}}, "/tasks/1/grasps/main", "object"),
        ({"grasp": {}}, "/tasks/1/grasp", "'grasps'"),
    ],
    ids=lambda value: str(value)[:30],
)
def test_refused_with_place_and_advice(request_of_jobs: Document, change: Document, pointer: str, word: str) -> None:
    request_of_jobs["tasks"][1].update(change)
    found = issues(request_of_jobs)
    assert pointer in found, found
    assert word in found[pointer]


def test_poses_are_limited_and_not_jobs(request_of_jobs: Document) -> None:
    strips = json.loads(
        (Path(__file__).parents[1] / "data" / "acceptance" / "tasks" / "19_seventeen_strips.json").read_text()
    )
    accept(json.dumps(strips).encode(), Limits())
    jobs = [{**JOBS[0], "name": str(k)} for k in range(50)]
    accept(json.dumps(request_of_jobs | {"tasks": jobs}).encode(), Limits())
    assert "500 poses" in issues(request_of_jobs | {"tasks": jobs}, Limits(max_poses=499))["/tasks"]
    request_of_jobs["tasks"][0]["task"]["line"]["count"] = request_of_jobs["tasks"][1]["task"]["arc"]["count"] = 4000
    assert "8000 poses of all jobs" in issues(request_of_jobs)["/tasks"]


@pytest.fixture(scope="module")
def answer() -> Document:
    """The answer to the example."""
    checked = validate(LayoutRequest, EXAMPLE)
    layout = optimize(cell_of(checked), settings_of(checked, 60.0))
    assert layout.outcome == "optimal"
    assert layout.proved
    return result_document(layout, "hash")


def test_the_answer_tells_the_jobs_apart(answer: Document) -> None:
    assert LayoutResult.model_validate(answer).model_dump() == answer
    load, turn = answer["jobs"]
    assert (load["name"], load["first_pose"], load["poses"], load["weight"]) == ("load", 0, 8, 3.0)
    assert (turn["name"], turn["first_pose"], turn["poses"], turn["weight"]) == ("turn over", 8, 3, 1.0)
    assert load["objective"] + turn["objective"] == pytest.approx(answer["objective"])
    made = cell(EXAMPLE)
    for job, share in ((load, slice(0, 8)), (turn, slice(8, 11))):
        rows = zip(made.arms, answer["arms"], strict=True)
        cost = sum(np.sum(arm.weights * (np.array(a["joints"])[share] - arm.reference) ** 2) for arm, a in rows)
        assert job["objective"] == pytest.approx(job["weight"] * cost)


def test_the_jobs_are_printed_and_drawn(answer: Document) -> None:
    printed = io.StringIO()
    print_layout({"name": EXAMPLE["name"], "result": answer}, printed)
    lines = printed.getvalue().splitlines()
    assert any("load" in line and "0 to 7" in line and " 3 " in line for line in lines)
    assert any("turn over" in line and "8 to 10" in line for line in lines)
    axes = draw_layout(cell(EXAMPLE), answer).axes[0]
    ways = [line for line in axes.lines if line.get_marker() == "o" and line.get_linewidth() == 1.0]
    assert [len(np.asarray(line.get_xdata())) for line in ways] == [8, 3]
    assert {"0", "7", "8", "10"} <= {text.get_text() for text in axes.texts}
    labels = [str(line.get_label()) for line in axes.lines]
    assert sum(label.startswith("left: ") for label in labels) == 1


def test_a_plain_task_has_one_job(example: Document) -> None:
    checked = validate(LayoutRequest, example | {"certificate": None})
    layout = optimize(cell_of(checked), settings_of(checked, 60.0))
    (job,) = result_document(layout, "")["jobs"]
    assert (job["name"], job["first_pose"], job["poses"], job["weight"]) == ("", 0, 10, 1.0)
    assert job["objective"] == pytest.approx(layout.objective)
