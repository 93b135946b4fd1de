"""Lists of poses are read in one pass, and mean what they mean one by one; so does what is wrong with them."""

from __future__ import annotations

import copy
import json
import random
from typing import Annotated, Any

import numpy as np
import pytest
from pydantic import Field, TypeAdapter, ValidationError

from duocell.service.schemas.base import FIRST_WRONG
from duocell.service.schemas.pose import Pose, PoseList

TOGETHER = TypeAdapter(PoseList)
ONE_BY_ONE = TypeAdapter(Annotated[list[Pose], Field(min_length=2), FIRST_WRONG])
TURNS: list[dict[str, Any]] = [
    {"quaternion": [0, 0.0, 0.6, 0.8]},
    {"matrix": [[1.0, 0.0, 0.0], [0.0, 0.0, -1], [0.0, 1e0, 0.0]]},
    {"rpy": [0.1, -0.0, 3]},
    {"euler_zyz": [1e-300, 5e-324, 2.0]},
    {"oat": [1.0, 2.0, 10**20]},
    {"quaternion_wxyz": [0.8, 0.6, 0, 0]},
    {"axis_angle": [0.1, 0.2, 0.3]},
    {"abc_deg": [90, 0, 180.0]},
    {"wpr_deg": [-0.0, 1.0, 2.0]},
]
VALUES: list[Any] = [
    *(None, True, "1.0", "", float("inf"), float("nan"), 10**400, -(10**308), {}, [], [1.0], [1.0, 2.0, 3.0]),
    *({"rpy": [0.0, 0.0, 0.0]}, {"rpy": [0.0, 0.0, 0.0], "oat": [0.0, 0.0, 0.0]}, {"rpz": [0.0, 0.0, 0.0]}),
]


def documents(count: int) -> list[dict[str, Any]]:
    """Poses in all formats by turns."""
    return [{"position": [0.1 * k, k, -1.5], "orientation": copy.deepcopy(TURNS[k % len(TURNS)])} for k in range(count)]


def complaints(adapter: TypeAdapter[Any], value: Any) -> list[dict[str, Any]]:
    """What Pydantic has to say, [] if nothing. Compared as text: NaN is not equal to itself."""
    try:
        adapter.validate_python(value)
    except ValidationError as error:
        return [{**detail, "input": repr(detail["input"])} for detail in error.errors(include_url=False)]
    return []


def spoiled(rng: random.Random) -> Any:
    """A list with something in it that may be wrong."""
    poses: Any = documents(rng.choice((1, 2, 10)))
    holder, key = poses, rng.randrange(len(poses))
    while isinstance(holder[key], (dict, list)) and holder[key] and rng.random() < 0.75:
        holder = holder[key]
        key = rng.choice(list(holder)) if isinstance(holder, dict) else rng.randrange(len(holder))
    action = rng.random()
    if action < 0.6:
        holder[key] = copy.deepcopy(rng.choice(VALUES))
    elif action < 0.8:
        del holder[key]
    elif isinstance(holder, dict):
        holder["more"] = 1.0
    else:
        holder.append(rng.choice(VALUES))
    return poses


def test_numbers_are_those_that_were_sent() -> None:
    sent = documents(12)
    found = TOGETHER.validate_python(sent)
    assert len(found) == 12
    np.testing.assert_array_equal(found.positions, [pose["position"] for pose in sent])
    one_by_one = ONE_BY_ONE.dump_python(ONE_BY_ONE.validate_python(sent))
    assert found.document() == one_by_one
    # Not only equal: 0 and 0.0, or -0.0, are not written alike.
    assert json.dumps(found.document()) == json.dumps(one_by_one)
    assert TOGETHER.dump_python(found) == one_by_one
    assert TOGETHER.dump_python(found, context=len) == 12


def test_json_and_poses_that_are_objects_are_read_as_well() -> None:
    sent = documents(7)
    expected = TOGETHER.validate_python(sent).document()
    assert TOGETHER.validate_json(json.dumps(sent)).document() == expected
    assert TOGETHER.validate_python([Pose.model_validate(pose) for pose in sent]).document() == expected


@pytest.mark.parametrize("value", [None, {}, "poses", 3, [], [{}], [[], []], [1, 2]])
def test_what_is_no_list_of_poses_is_told_as_ever(value: Any) -> None:
    assert complaints(TOGETHER, value) == complaints(ONE_BY_ONE, value) != []


def test_whatever_is_wrong_is_told_as_it_is_for_one_pose_after_the_other() -> None:
    rng = random.Random(7)
    told = 0
    for _ in range(3000):
        value = spoiled(rng)
        expected = complaints(ONE_BY_ONE, value)
        assert complaints(TOGETHER, value) == expected
        told += bool(expected)
        if not expected:
            read = ONE_BY_ONE.dump_python(ONE_BY_ONE.validate_python(value))
            assert TOGETHER.validate_python(value).document() == read
    assert 2000 < told < 3000


def test_positions_alone_cannot_be_written() -> None:
    with pytest.raises(ValueError, match="cannot be written"):
        PoseList(np.zeros((2, 3)), ()).document()
