"""Both checkouts are asked the same by turns, and medians and ratios are those of the measurements."""

from __future__ import annotations

import numpy as np

from bench.comparison.tasks import thesis_line
from bench.draws.beam import beam_cell
from bench.timings.speed_pairs import HERE, Compared, compare, summary, with_poses
from bench.trials.trial import Record


def test_this_checkout_against_itself() -> None:
    task = Compared("arc", lambda: thesis_line(3), lambda: thesis_line(3))
    noted: list[Record] = []
    records = compare(HERE, task, 1, noted.append)
    assert noted == records
    assert [record["who"] for record in records] == ["old", "new"]
    assert records[0]["word"] == "feasible"
    assert records[0]["objective"] == records[1]["objective"]
    assert all(record["cpu"] > 0.0 for record in records)


def test_medians_and_ratios() -> None:
    times = [("old", 1.0), ("new", 0.5), ("new", 0.8), ("old", 2.0), ("old", 4.0), ("new", 4.0)]
    records = [
        {
            "task": "x",
            "pair": k // 2,
            "who": who,
            "cpu": cpu,
            "word": "feasible",
            "objective": 1.0 if who == "old" else 2.0,
        }
        for k, (who, cpu) in enumerate(times)
    ]
    assert "| x | 3 | 2 | 0.8 | 0.5 | feasible 1 | feasible 2 | – | – |" in summary(records)
    assert "error" in summary([{"task": "x", "pair": 0, "who": "new", "word": "error", "detail": ["why"]}])


def test_poses_are_laid_on_the_way() -> None:
    cell = beam_cell()
    many = with_poses(cell, 1000).task.poses
    assert len(many) == 1000
    np.testing.assert_allclose(many[[0, -1]], cell.task.poses[[0, -1]], atol=1e-12)
    for pose in cell.task.poses:
        assert np.min(np.linalg.norm(many[:, :3, 3] - pose[:3, 3], axis=1)) < 0.003
    np.testing.assert_allclose(
        many[:, :3, :3] @ many[:, :3, :3].transpose(0, 2, 1), np.tile(np.eye(3), (1000, 1, 1)), atol=1e-9
    )
