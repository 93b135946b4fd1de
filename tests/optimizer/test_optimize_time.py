"""The whole way again: long tasks, the same answer every time, limits of time."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from duocell.models.cell.task import Task
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.settings import Settings
from tests.support.given.tasks import possible
from tests.support.oracles.answers import solved
from tests.support.present import present

ROOT = Path(__file__).resolve().parents[2]
FREE = np.pi


def test_a_thousand_poses() -> None:
    task = possible("ur10e", np.random.default_rng(2), poses=1000, step=0.0008, half=(0.5, 0.5, 0.0, FREE))
    layout = solved(task.cell)
    witness = float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2))
    assert present(layout.objective) <= witness
    few = replace(task.cell, task=Task(task.cell.task.poses[::111]))
    position = optimize(few).placements[0].position
    assert layout.placements[0].position == pytest.approx(position, abs=0.05)


def test_a_long_path_along_the_edge_of_the_workspace_does_not_use_up_the_time() -> None:
    """The best-looking starts stretch the arm at poses that the screening did not sample; others are fine."""
    task = possible("puma560", np.random.default_rng(12), poses=1000, step=0.0008, half=(0.5, 0.5, 0.0, FREE))
    layout = optimize(task.cell, Settings(time_limit=5.0))
    assert layout.usable, [reason.detail for reason in layout.reasons]
    witness = float(np.sum(task.arm.weights * (task.joints - task.arm.reference) ** 2))
    assert present(layout.objective) <= witness
    assert layout.search.wall_time < 20.0


SCRIPT = """
import json, sys
import numpy as np
from tests.support.given.tasks import possible
from duocell.optimizer.optimize import optimize
result = []
for name in json.loads(sys.argv[1]):
    layout = optimize(possible(name, np.random.default_rng(13), poses=4, half=(0.3, 0.3, 0.0, np.pi)).cell)
    placement = layout.placements[0]
    result.append([*placement.position, placement.yaw, *placement.joints.ravel(), layout.objective,
                   layout.search.candidates, layout.search.starts, layout.search.basins])
print(json.dumps(result))
"""


def test_the_same_cell_has_the_same_layout_also_in_another_process() -> None:
    names = ["puma560", "ur10e", "iiwa14"]
    run = subprocess.run(
        [sys.executable, "-c", SCRIPT, json.dumps(names)],
        cwd=ROOT,
        capture_output=True,
        text=True,
        check=True,
        timeout=100,
    )
    for name, there in zip(names, json.loads(run.stdout), strict=True):
        cell = possible(name, np.random.default_rng(13), poses=4, half=(0.3, 0.3, 0.0, FREE)).cell
        for layout in (optimize(cell), optimize(cell)):
            (placement,) = layout.placements
            search = layout.search
            here = [*placement.position, placement.yaw, *placement.joints.ravel(), layout.objective]
            assert [*here, search.candidates, search.starts, search.basins] == there


def test_time_that_has_run_out_is_told_not_hidden() -> None:
    task = possible("ur10e", np.random.default_rng(14))
    layout = optimize(task.cell, Settings(time_limit=1e-6))
    assert layout.outcome in (Outcome.FEASIBLE, Outcome.UNKNOWN)
    assert not layout.search.ended
    if layout.outcome is Outcome.UNKNOWN:
        assert {reason.kind for reason in layout.reasons} == {"limit_reached"}
