"""Poses and arms from numbers: they mean what a request means, and what cannot be used is refused with its place."""

import json
from dataclasses import fields
from math import nan, pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

import duocell
from duocell.models.base.errors import InvalidInput, InvalidRotation, UnknownRobot
from duocell.models.robot.arm import Arm

EXAMPLES = Path(__file__).parents[2] / "examples"
GRASP = duocell.pose((0.0, 0.0, 0.05), rpy=(pi, 0.0, 0.0))


def arm(**changed: Any) -> Arm:
    return duocell.make_arm(**{"name": "main", "robot": "ur5e", "x": (0, 1), "y": 0.5, "grasp": GRASP, **changed})


def test_orientations_agree_with_scipy() -> None:
    turn = Rotation.from_euler("xyz", [0.3, -0.4, 1.1])  # about fixed axes
    for given in ({"rpy": [0.3, -0.4, 1.1]}, {"quaternion": turn.as_quat()}, {"matrix": turn.as_matrix()}):
        made = duocell.pose((1.0, 2.0, 3.0), **given)
        np.testing.assert_allclose(made[:3, :3], turn.as_matrix(), atol=1e-15)
        np.testing.assert_array_equal(made[:, 3], (1.0, 2.0, 3.0, 1.0))
    np.testing.assert_array_equal(duocell.pose(), np.eye(4))


@pytest.mark.parametrize("stem", ["line", "beam_ur10e"])
def test_an_arm_is_that_of_the_request_with_the_same_values(stem: str) -> None:
    source = json.loads((EXAMPLES / f"{stem}.json").read_text())
    for asked, expected in zip(source["arms"], duocell.read_request(source).cell.arms, strict=True):
        base: dict[str, Any] = {
            key: tuple(value) if isinstance(value, list) else value for key, value in asked["base"].items()
        }
        others = {key: asked[key] for key in ("reference", "weights", "min_conditioning") if key in asked}
        frames: dict[str, Any] = {
            key: duocell.pose(asked[key]["position"], **asked[key]["orientation"])
            for key in ("tool", "grasp")
            if key in asked
        }
        made = duocell.make_arm(asked["name"], asked["robot"], **base, **frames, **others)
        for field in fields(Arm):
            one, other = getattr(made, field.name), getattr(expected, field.name)
            assert np.array_equal(one, other) if isinstance(one, np.ndarray) else one == other, field.name


def test_a_reference_outside_narrower_limits_is_replaced_by_their_middle() -> None:
    limits = [[-1.0, 1.0]] * 5 + [[0.5, 1.5]]
    made = arm(limits=limits)
    np.testing.assert_array_equal(made.lower, [-1.0] * 5 + [0.5])
    assert np.all((made.reference >= made.lower) & (made.reference <= made.upper))
    assert made.reference[5] == 1.0


def test_weights_are_equal_if_asked_for() -> None:
    np.testing.assert_array_equal(arm(weights="equal").weights, np.ones(6))


REFUSED: list[tuple[dict[str, Any], type[InvalidInput], str]] = [
    ({"robot": "ur5ee"}, UnknownRobot, "/robot"),
    ({"x": (1.0, 0.0)}, InvalidInput, "/x"),
    ({"yaw": nan}, InvalidInput, "/yaw"),
    ({"y": (0.0, 1.0, 2.0)}, InvalidInput, "/y"),
    ({"grasp": np.eye(3)}, InvalidInput, "/grasp"),
    ({"tool": np.diag([1.0, 1.0, 2.0, 1.0])}, InvalidRotation, "/tool"),
    ({"tool": np.full((4, 4), nan)}, InvalidInput, "/tool"),
    ({"limits": [[-1.0, 1.0]]}, InvalidInput, "/limits"),
    ({"limits": [[1.0, -1.0]] * 6}, InvalidInput, "/limits"),
    ({"reference": [0.0] * 5}, InvalidInput, "/reference"),
    ({"reference": [99.0] * 6}, InvalidInput, "/reference"),
    ({"weights": "wide"}, InvalidInput, "/weights"),
    ({"weights": [-1.0] * 6}, InvalidInput, "/weights/0"),
    ({"min_conditioning": 5.0}, InvalidInput, "/min_conditioning"),
    ({"flange": "elbow"}, InvalidInput, "/flange"),
]


@pytest.mark.parametrize(("changed", "kind", "pointer"), REFUSED, ids=lambda value: str(value)[:30])
def test_what_cannot_be_used_is_refused(changed: dict[str, Any], kind: type[InvalidInput], pointer: str) -> None:
    with pytest.raises(kind) as refused:
        arm(**changed)
    assert refused.value.pointer == pointer
    assert isinstance(refused.value, duocell.DuocellError)


@pytest.mark.parametrize(("position", "turns"), [([0.0, nan, 0.0], {}), ([0.0], {}), ([0, 0, 0], {"rpy": [0.0]})])
def test_what_is_no_pose_is_refused(position: ArrayLike, turns: dict[str, Any]) -> None:
    with pytest.raises(InvalidInput):
        duocell.pose(position, **turns)


def test_one_orientation_is_enough() -> None:
    with pytest.raises(InvalidInput, match="more than one"):
        duocell.pose(rpy=(0, 0, 0), matrix=np.eye(3))
