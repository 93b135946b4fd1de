"""What a worker is given of an accepted request means what its text means, to the last bit."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.service.requests import convert_pose
from duocell.service.requests.accept import accept, accept_evaluation, hash_of
from duocell.service.requests.convert import joints_of
from duocell.service.requests.prepared import FORM, is_prepared, read_accepted, request_of
from duocell.service.schemas.evaluate import EvaluateRequest
from duocell.service.schemas.pose import PoseList
from duocell.service.schemas.request import EXAMPLE, LayoutRequest
from duocell.service.schemas.task import ARC, JOBS, LINE, PosesTask
from duocell.service.settings import Limits

POSES = [
    {
        "position": [0.9, 0.1 * k, 0.1],
        "orientation": {"rpy": [0.0, 0.1 * k, 3.0]} if k % 2 else {"oat": [0.3, 1.2, 0.1]},
    }
    for k in range(7)
]
PART = [
    {"name": "bit", "task": {"poses": POSES[:3]}, "weight": 0.25},
    *JOBS,
    {"name": "rest", "task": {"poses": POSES}},
]
TASKS: list[dict[str, Any]] = [
    {"task": {"poses": POSES}},
    {"task": {"line": LINE}},
    {"task": {"arc": ARC}},
    {"tasks": PART},
    {"tasks": PART[:1]},
]
REST = {name: value for name, value in EXAMPLE.items() if name != "task"}


def same_task(one: Cell, other: Cell) -> bool:
    first, second = one.task, other.task
    return (
        first.poses.tobytes() == second.poses.tobytes()
        and first.weights.tobytes() == second.weights.tobytes()
        and (first.starts, first.names) == (second.starts, second.names)
    )


def lists_of(request: LayoutRequest) -> list[PoseList]:
    """All lists of poses of a request."""
    tasks = [request.task] if request.tasks is None else [segment.task for segment in request.tasks]
    return [task.poses for task in tasks if isinstance(task, PosesTask)]


@pytest.mark.parametrize("task", TASKS)
def test_a_form_and_its_text_mean_the_same(task: dict[str, Any]) -> None:
    accepted = accept(json.dumps(REST | task).encode(), Limits())
    assert is_prepared(accepted.prepared)
    (prepared, made), (written, read) = (
        read_accepted(LayoutRequest, some) for some in (accepted.prepared, accepted.text)
    )
    assert same_task(made, read)
    assert [arm.name for arm in made.arms] == [arm.name for arm in read.arms]
    assert prepared.model_dump(mode="json", context=len) == written.model_dump(mode="json", context=len)
    for seen, sent in zip(lists_of(prepared), lists_of(written), strict=True):
        np.testing.assert_array_equal(seen.positions, sent.positions)


def test_poses_of_a_form_are_not_converted_again(monkeypatch: pytest.MonkeyPatch) -> None:
    accepted = accept(json.dumps(REST | {"tasks": PART[::3]}).encode(), Limits())
    monkeypatch.setattr(convert_pose, "poses_of", None)
    read_accepted(LayoutRequest, accepted.prepared)
    monkeypatch.setattr("duocell.service.requests.convert_task.poses_of", None)
    read_accepted(LayoutRequest, accepted.prepared)
    with pytest.raises(TypeError):
        read_accepted(LayoutRequest, accepted.text)


def test_the_text_is_what_the_hash_is_of_and_is_accepted_as_it_is() -> None:
    accepted = accept(json.dumps(REST | {"tasks": PART}).encode(), Limits())
    assert hash_of(json.loads(accepted.text)) == accepted.request_hash
    again = accept(accepted.text.encode(), Limits())
    assert (again.text, again.prepared) == (accepted.text, accepted.prepared)


def test_a_layout_to_evaluate_has_a_form_too() -> None:
    arm = EXAMPLE["arms"][0] | {"base": {"x": 0.3, "y": 0.9, "z": 0.0, "yaw": 0.5}, "joints": [[0.0] * 6] * 7}
    accepted = accept_evaluation(json.dumps({"task": {"poses": POSES}, "arms": [arm]}).encode(), Limits())
    (request, made), (written, read) = (
        read_accepted(EvaluateRequest, some) for some in (accepted.prepared, accepted.text)
    )
    assert same_task(made, read)
    np.testing.assert_array_equal(joints_of(request, made), joints_of(written, read))


def test_forms_of_other_versions_are_known_as_such() -> None:
    accepted = accept(json.dumps(EXAMPLE).encode(), Limits())
    assert not is_prepared(accepted.prepared.replace(b"request 1", b"request 2", 1))
    assert not is_prepared(b"")
    assert FORM.endswith(b"\n")
    request, task = request_of(LayoutRequest, accepted.text)
    assert task is None
    assert request.name == EXAMPLE["name"]
