"""From requests to cells."""

import copy
import json
from collections.abc import Callable
from math import pi
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest

from duocell.models.catalogue.catalogue import robot
from duocell.models.robot.arm import range_weights
from duocell.models.robot.posture import Posture
from duocell.optimizer.baselines.penalty import METHODS
from duocell.service.common.issues import InvalidRequest
from duocell.service.library.library import Library
from duocell.service.library.user_robot import UserRobot
from duocell.service.requests.accept import accept
from duocell.service.requests.convert import cell_of, settings_of
from duocell.service.schemas.request import Baseline, LayoutRequest
from duocell.service.settings import Limits
from duocell.service.validation import validate

Document = dict[str, Any]

POSE = {"position": [0.8, 0.4, 0.1], "orientation": {"quaternion": [0.0, 0.0, 0.0, 1.0]}}


def cell(document: Document) -> Any:
    return cell_of(validate(LayoutRequest, document))


def refused(document: Document) -> dict[str, str]:
    with pytest.raises(InvalidRequest) as caught:
        cell(document)
    return {issue.pointer: issue.detail for issue in caught.value.issues}


def test_the_example_becomes_two_arms_on_a_line(example: Document) -> None:
    made = cell(example)
    assert made.name == example["name"]
    assert len(made.task) == 10
    assert [arm.name for arm in made.arms] == ["main", "follower"]
    main = made.arms[0]
    assert main.robot is robot("puma560")
    np.testing.assert_array_equal(main.tool, np.eye(4))
    np.testing.assert_allclose(main.grasp[:3, :3], [[0, 0, 1], [1, 0, 0], [0, 1, 0]], atol=1e-12)
    assert main.grasp[:3, 3].tolist() == [-0.06, -0.015, -0.02]
    assert main.base.z.fixed
    assert main.base.yaw_free
    assert main.posture == Posture()
    assert main.min_conditioning is None
    np.testing.assert_allclose(main.weights, range_weights(main.lower, main.upper))
    assert settings_of(validate(LayoutRequest, example), 7.0).certificate is None


@pytest.mark.parametrize(
    ("orientation", "rows"),
    [
        ({"quaternion": [0, 0, 0.7071068, 0.7071068]}, [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ({"matrix": [[0, -1, 0], [1, 0, 0], [0, 0, 1]]}, [[0, -1, 0], [1, 0, 0], [0, 0, 1]]),
        ({"rpy": [pi / 2, 0, pi / 2]}, [[0, 0, 1], [1, 0, 0], [0, 1, 0]]),
        ({"euler_zyz": [pi / 2, pi / 2, 0]}, [[0, -1, 0], [0, 0, 1], [-1, 0, 0]]),
        ({"oat": [pi / 2, pi / 2, 0]}, np.eye(3)),
    ],
)
def test_every_format_of_orientation(example: Document, orientation: Document, rows: Any) -> None:
    example["arms"][0]["tool"] = {"position": [0, 0, 0], "orientation": orientation}
    np.testing.assert_allclose(cell(example).arms[0].tool[:3, :3], rows, atol=1e-7)


@pytest.mark.parametrize(
    ("task", "middle"),
    [
        ({"poses": [POSE, {**POSE, "position": [1, 2, 3]}, POSE]}, [1, 2, 3]),
        ({"line": {"start": POSE, "end": {**POSE, "position": [1.8, 0.4, 0.1]}, "count": 3}}, [1.3, 0.4, 0.1]),
        (
            {
                "arc": {
                    "start": {**POSE, "position": [1, 0, 0]},
                    "end": {**POSE, "position": [0, 1, 0]},
                    "center": [0, 0, 0],
                    "count": 3,
                }
            },
            [0.5**0.5, 0.5**0.5, 0],
        ),
        (
            {
                "arc": {
                    "start": {**POSE, "position": [1, 0, 0]},
                    "end": {**POSE, "position": [-1, 0, 0]},
                    "radius": 1,
                    "normal": [0, 0, 2],
                    "count": 3,
                }
            },
            [0, 1, 0],
        ),
    ],
    ids=["poses", "line", "arc by centre", "arc by radius"],
)
def test_every_kind_of_task(example: Document, task: Document, middle: list[float]) -> None:
    example["task"] = task
    made = cell(example)
    assert len(made.task) == 3
    np.testing.assert_allclose(made.task.poses[1, :3, 3], middle, atol=1e-12)


def test_references_default_to_the_robots_own(example: Document) -> None:
    for arm, name in zip(example["arms"], ("puma560", "ur10e"), strict=True):
        arm["robot"], arm["reference"] = name, None
    first, second = cell(example).arms
    np.testing.assert_array_equal(first.reference, robot("puma560").reference)
    np.testing.assert_array_equal(second.reference, robot("ur10e").reference)
    assert abs(second.reference[2]) == pytest.approx(pi / 2)


def test_a_default_reference_outside_the_limits_in_force_becomes_mid_range(example: Document) -> None:
    arm = example["arms"][0]
    arm["robot"], arm["reference"] = "ur10e", None
    own = robot("ur10e").reference
    elbow = [-own[2] - 0.5, -own[2] + 0.7]
    arm["limits"] = [[value - 0.5, value + 0.5] for value in own]
    arm["limits"][2] = elbow
    made = cell(example).arms[0]
    np.testing.assert_allclose(np.delete(made.reference, 2), np.delete(own, 2))
    assert made.reference[2] == pytest.approx(sum(elbow) / 2)
    np.testing.assert_allclose(made.weights, range_weights(made.lower, made.upper))


def test_a_reference_may_stand_on_its_limit(example: Document) -> None:
    arm = example["arms"][0]
    arm["reference"] = robot("puma560").upper.tolist()
    np.testing.assert_array_equal(cell(example).arms[0].reference, robot("puma560").upper)


def test_weights(example: Document) -> None:
    example["arms"][0]["weights"] = "equal"
    example["arms"][1]["weights"] = [0, 1, 2, 3, 4, 5]
    first, second = cell(example).arms
    assert first.weights.tolist() == [1.0] * 6
    assert second.weights.tolist() == [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]


def test_postures_may_be_named_in_part(example: Document) -> None:
    example["arms"][0]["posture"] = {"shoulder": "left", "wrist": "flip"}
    assert cell(example).arms[0].posture == Posture(shoulder=1, wrist=-1)
    example["arms"][0]["posture"] = {"elbow": "up"}
    assert cell(example).arms[0].posture == Posture(elbow=-1)


def test_an_inline_table_is_the_robot_it_describes(example: Document) -> None:
    table = [(-90, 0, 0), (0, 0.4318, 0.1491), (90, -0.0203, 0), (-90, 0, 0.4331), (90, 0, 0), (0, 0, 0.0563)]
    rows = [{"alpha": np.radians(alpha), "a": a, "d": d, "lower": -1.5, "upper": 1.5} for alpha, a, d in table]
    example["arms"][0] |= {"robot": {"dh": rows}, "reference": None}
    made = cell(example).arms[0]
    np.testing.assert_allclose(made.robot.joint_placements, robot("puma560").joint_placements, atol=1e-12)
    np.testing.assert_allclose(made.robot.flange_placement, robot("puma560").flange_placement, atol=1e-12)
    assert made.upper.tolist() == [1.5] * 6


def test_a_joint_step_of_pi_as_people_write_it_is_pi(example: Document) -> None:
    example["max_joint_step"] = 3.1416
    assert cell(example).max_joint_step == pi


def test_robots_of_the_command_line_come_first(example: Document, tmp_path: Path) -> None:
    own = robot("ur5e")
    made = cell_of(
        validate(LayoutRequest, example | {}), Library(tmp_path, given={"puma560": UserRobot(own, None, "v1")})
    )
    assert made.arms[0].robot is own


def test_all_that_is_wrong_is_told_at_once(example: Document) -> None:
    example["arms"][0]["robot"] = "nobody"
    example["arms"][1]["name"] = "main"
    example["arms"][1]["reference"] = [0.0] * 5
    example["task"]["line"]["start"]["orientation"] = {"quaternion": [0, 0, 0, 0]}
    example["baselines"] = ["interior-penalty", "interior-penalty"]
    assert {
        "/arms/0/robot",
        "/arms/1/name",
        "/arms/1/reference",
        "/task/line/start/orientation/quaternion",
        "/baselines/1",
    } <= set(refused(example))


def test_the_methods_that_may_be_asked_for_are_those_of_the_optimizer() -> None:
    assert set(get_args(Baseline)) == set(METHODS)


@pytest.mark.parametrize(
    ("change", "same"),
    [
        (lambda r: r.update(name="other"), False),
        (lambda r: r["arms"][0].update(weights="range", posture=None), True),
        (lambda r: r["arms"][0]["base"].update(z=0), True),
        (lambda r: r["arms"][0]["base"].update(z=1e-9), False),
    ],
)
def test_the_hash_is_that_of_the_meaning(example: Document, change: Callable[[Document], None], same: bool) -> None:
    other = copy.deepcopy(example)
    change(other)
    shuffled = dict(reversed(other.items()))
    first, second = (accept(json.dumps(r).encode(), Limits()) for r in (example, shuffled))
    assert (first.request_hash == second.request_hash) is same


def test_limits_of_size_are_settings(example: Document) -> None:
    body = json.dumps(example).encode()
    for limits, pointer in (
        (Limits(max_poses=9), "/task/line/count"),
        (Limits(max_arms=1), "/arms"),
        (Limits(max_coordinate=0.5), "/task/line/start/position/0"),
        (Limits(max_angle=3.0), "/arms/0/base/yaw/0"),
    ):
        with pytest.raises(InvalidRequest) as caught:
            accept(body, limits)
        assert caught.value.code == "too-large"
        assert pointer in [issue.pointer for issue in caught.value.issues]


def test_limits_come_from_the_environment(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DUOCELL_MAX_POSES", "7")
    assert Limits().max_poses == 7
