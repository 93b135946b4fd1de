"""Answers are followed as their words promise, and one that cannot be followed is seen."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from bench.trials.acceptance_search import case
from bench.trials.followed import attempt, lost_on_the_way, summary, task_of
from bench.trials.trial import ask
from tests.support.present import present


def test_an_elbow_that_touched_its_stretched_position_on_the_way_no_longer_does() -> None:
    one = case("between_27")
    layout = ask(one.cell, one.settings).layout
    assert layout is not None
    assert layout.usable
    assert present(layout.objective) < 4.25337
    assert lost_on_the_way(one.cell, layout) is None
    (placement,) = layout.placements
    astray = placement.joints.copy()
    astray[1, 3] += 0.1
    found = lost_on_the_way(one.cell, replace(layout, placements=(replace(placement, joints=astray),)))
    assert found is not None
    assert found[0].pose == 1


def test_odd_tasks_have_few_poses_far_apart() -> None:
    (kind, many), (other, few) = task_of(0), task_of(1)
    assert other == f"{kind}, few poses"
    assert len(few.task) == 2 < len(many.task)
    whole = many.task.poses[-1, :3, 3] - many.task.poses[0, :3, 3]
    np.testing.assert_allclose(np.diff(few.task.poses[:, :3, 3], axis=0)[0], 2.0 * whole, atol=1e-12)


def test_the_share_that_cannot_be_followed_is_told() -> None:
    record = {"seed": 223, **attempt(223)}
    assert record["lost"] is None
    lost = record | {"seed": 7, "lost": [0, 0.5, 0.1]}
    assert summary([record, lost]).splitlines()[-1].startswith("| all | 2 | 1 of 2 | 7 |")
