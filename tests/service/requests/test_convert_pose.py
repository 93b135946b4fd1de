"""Lists of poses: converted at once, and no otherwise than one by one."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.spatial.transform import Rotation

from duocell.models.base.arrays import Floats
from duocell.service.common.issues import IssueCollector
from duocell.service.requests.convert_pose import pose_of, poses_of
from duocell.service.schemas.pose import FORMS, Pose, PoseList

LISTS = TypeAdapter(PoseList)


def as_sent(turn: Rotation, name: str) -> Any:
    """A rotation as a user would send it."""
    if name == "oat":
        alpha, beta, gamma = turn.as_euler("ZYZ")
        return [alpha + np.pi / 2, np.pi / 2 - beta, gamma]
    made: dict[str, Callable[[], Any]] = {
        "quaternion": turn.as_quat,
        "matrix": turn.as_matrix,
        "rpy": lambda: turn.as_euler("xyz"),
        "euler_zyz": lambda: turn.as_euler("ZYZ"),
        "quaternion_wxyz": lambda: turn.as_quat(scalar_first=True),
        "axis_angle": turn.as_rotvec,
        "abc_deg": lambda: turn.as_euler("ZYX", degrees=True),
        "wpr_deg": lambda: turn.as_euler("xyz", degrees=True),
    }
    return made[name]().tolist()


def poses(count: int) -> tuple[list[dict[str, Any]], Floats]:
    """Documents of poses in all formats by turns, and the matrices that they mean."""
    rng = np.random.default_rng(5)
    turns, positions = Rotation.random(count, rng=rng), rng.uniform(-2.0, 2.0, (count, 3))
    made = []
    for k, (turn, position) in enumerate(zip(turns, positions, strict=True)):
        name = FORMS[k % len(FORMS)]
        made.append({"position": position.tolist(), "orientation": {name: as_sent(turn, name)}})
    meant = np.tile(np.eye(4), (count, 1, 1))
    meant[:, :3, :3], meant[:, :3, 3] = turns.as_matrix(), positions
    return made, meant


def converted(documents: list[dict[str, Any]], issues: IssueCollector) -> np.ndarray | None:
    """What becomes of a list of poses that was sent."""
    return poses_of(LISTS.validate_python(documents), "/task/poses", issues)


def test_formats_may_be_mixed() -> None:
    made, meant = poses(40)
    found = converted(made, IssueCollector())
    assert found is not None
    np.testing.assert_allclose(found, meant, rtol=0.0, atol=1e-14)


def test_together_is_as_one_by_one() -> None:
    made, _ = poses(40)
    issues = IssueCollector()
    found = converted(made, issues)
    np.testing.assert_array_equal(found, [pose_of(Pose.model_validate(pose), "", issues) for pose in made])
    assert issues.found == []


@pytest.mark.parametrize(
    ("orientation", "words"),
    [
        ({"quaternion": [0.0, 0.0, 0.0, 2.0]}, "length 2"),
        ({"matrix": [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, -1.0]]}, "left-handed"),
        ({"matrix": [[2.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]}, "unit vector to 2;"),
        ({"rpy": [0.0, 90.0, 0.0]}, "90 rad"),
        ({"oat": [0.0, 0.0, -45.0]}, "-45 rad"),
        ({"axis_angle": [0.0, 180.0, 0.0]}, "180 rad"),
        ({"abc_deg": [0.0, 0.0, 900.0]}, "900°"),
        ({"wpr_deg": [-721.0, 0.0, 0.0]}, "-721°"),
        ({"quaternion_wxyz": [2.0, 0.0, 0.0, 0.0]}, "quaternion [w, x, y, z] has length 2"),
        ({"quaternion_wxyz": [0.0, 0.0, 0.0, 0.0]}, "No rotation at all is [1, 0, 0, 0]"),
    ],
)
def test_every_wrong_pose_is_named(orientation: dict[str, Any], words: str) -> None:
    made, _ = poses(20)
    wrong = {"position": [0.0, 0.0, 0.0], "orientation": orientation}
    made[3] = made[17] = wrong
    issues = IssueCollector()
    assert converted(made, issues) is None
    name = next(iter(orientation))
    assert [issue.pointer for issue in issues.found] == [f"/task/poses/{k}/orientation/{name}" for k in (3, 17)]
    assert all(words in issue.detail for issue in issues.found)
