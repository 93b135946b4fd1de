"""Task sequences: segments are joined in order, keep their names, weights and grasps, and can be taken apart again."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.errors import InvalidTask
from duocell.models.base.pose import inverse, rotation_x, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task, line
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from tests.support.given.arms import make_arm

FIRST = line(transform(np.eye(3), [0.5, 0.0, 0.1]), transform(rotation_z(0.4), [0.7, 0.2, 0.1]), 3)
SECOND = line(transform(rotation_z(2.0), [0.0, 0.6, 0.3]), transform(rotation_x(0.4), [0.1, 0.8, 0.3]), 5)
BOTH = task_sequence([TaskSegment("first", FIRST, 2.0), TaskSegment("second", SECOND, 0.5)])


def test_segments_follow_each_other_with_their_names_and_weights() -> None:
    assert np.array_equal(BOTH.poses, np.concatenate([FIRST.poses, SECOND.poses]))
    assert (BOTH.starts, BOTH.names) == ((0, 3), ("first", "second"))
    assert BOTH.weights.tolist() == [2.0] * 3 + [0.5] * 5
    assert BOTH.segments == (slice(0, 3), slice(3, 8))
    assert BOTH.segment_of.tolist() == [0] * 3 + [1] * 5
    assert BOTH.joined.tolist() == [True, True, False, True, True, True, True]
    assert BOTH.total_weight == 8.5
    assert BOTH.weight_scale == pytest.approx(8.5 / 8)


def test_a_segment_by_itself_is_a_plain_task() -> None:
    for k, (task, weight) in enumerate(((FIRST, 2.0), (SECOND, 0.5))):
        alone = BOTH.alone(k)
        assert np.array_equal(alone.poses, task.poses)
        assert alone.starts == (0,)
        assert alone.names == (BOTH.names[k],)
        assert set(alone.weights) == {weight}
        assert alone.joined.all()


def test_a_plain_task_is_a_task_sequence_of_one_segment_that_counts_once() -> None:
    one = task_sequence([TaskSegment("", FIRST)])
    for task in (FIRST, one):
        assert (task.starts, task.names) == ((0,), ("",))
        assert task.weights.tolist() == [1.0] * 3
        assert task.joined.tolist() == [True, True]
        assert task.weight_scale == 1.0
    assert np.array_equal(one.poses, FIRST.poses)
    assert not FIRST.weights.flags.writeable


def test_what_counts_for_nothing_still_has_a_scale() -> None:
    still = task_sequence([TaskSegment("a", FIRST, 0.0), TaskSegment("b", SECOND, 0.0)])
    assert (still.total_weight, still.weight_scale) == (8, 1.0)
    assert task_sequence([TaskSegment("a", FIRST, 0.0), TaskSegment("b", SECOND, 3.0)]).weight_scale == 3.0


@pytest.mark.parametrize("weight", [-0.1, np.nan, np.inf])
def test_weights_are_numbers_and_not_negative(weight: float) -> None:
    with pytest.raises(InvalidTask) as caught:
        task_sequence([TaskSegment("a", FIRST), TaskSegment("b", SECOND, weight)])
    assert caught.value.pointer == "/1/weight"
    assert "0" in caught.value.detail


def test_task_sequences_need_a_segment_and_are_not_nested() -> None:
    with pytest.raises(InvalidTask):
        task_sequence([])
    with pytest.raises(ValueError, match="family"):
        task_sequence([TaskSegment("a", BOTH)])


@pytest.mark.parametrize("starts", [(), (1,), (0, 0), (0, 2, 1), (0, 8), (0, 9)])
def test_every_segment_has_a_pose(starts: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="start"):
        Task(BOTH.poses, starts)


def test_names_and_weights_fit_the_segments() -> None:
    with pytest.raises(ValueError, match="names"):
        Task(BOTH.poses, (0, 3), ("a",))
    with pytest.raises(ValueError, match="shape"):
        Task(BOTH.poses, weights=np.ones(3))


def test_every_segment_has_the_grasp_that_is_given_for_it() -> None:
    own = np.array([transform(rotation_x(0.3), [0.1, 0.0, 0.0]), transform(rotation_z(0.7), [0.0, 0.2, 0.0])])
    tool = transform(rotation_z(-1.0), [0.0, 0.1, 0.2])
    same, other = make_arm("ur5e", "same", tool=tool, grasp=own[0]), make_arm("ur5e", "other", tool=tool, grasps=own)
    cell = Cell(BOTH, (same, other))
    assert np.array_equal(cell.grasps(same), np.tile(own[0], (8, 1, 1)))
    assert np.array_equal(cell.grasps(other), np.concatenate([np.tile(own[0], (3, 1, 1)), np.tile(own[1], (5, 1, 1))]))
    assert np.allclose(cell.flange_targets(other) @ tool, BOTH.poses @ cell.grasps(other), rtol=0.0, atol=1e-14)
    assert np.array_equal(cell.flange_targets(same), BOTH.poses @ own[0] @ inverse(tool))
    second = cell.alone(1)
    assert np.array_equal(second.task.poses, SECOND.poses)
    assert np.array_equal(second.flange_targets(second.arms[1]), cell.flange_targets(other)[3:])
    assert np.array_equal(second.flange_targets(second.arms[0]), cell.flange_targets(same)[3:])


def test_there_are_as_many_grasps_as_segments() -> None:
    arm = make_arm("ur5e", grasps=np.tile(np.eye(4), (3, 1, 1)))
    with pytest.raises(ValueError, match="3 grasps for 2 jobs"):
        Cell(BOTH, (arm,))
    with pytest.raises(ValueError, match="shape"):
        replace(arm, grasps=np.eye(4))
