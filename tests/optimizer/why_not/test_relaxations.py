"""Changes that are offered work."""

from __future__ import annotations

import time
from dataclasses import replace

import numpy as np
import pytest

from bench.cells import real_cell
from bench.dense_check import dense_check, judge
from models.arm import range_weights
from models.cell import Cell
from optimizer.findings import Relaxation
from optimizer.optimize import optimize
from optimizer.why_not import relaxations as relaxation_module
from optimizer.why_not.changes import changes
from optimizer.why_not.conflict import Conflict, ConflictSearch
from optimizer.why_not.elements import everything
from optimizer.why_not.relaxations import _Trials, relaxations
from tests.support.arms import region
from tests.support.blocked import (
    ball_in_the_way,
    blocked_by,
    carried,
    explained,
    limited,
    one_arm,
)


def offered(cell: Cell, conflict: Conflict, pointer: str) -> list[Relaxation]:
    """What helps among the changes of one field."""
    trials = _Trials(cell, conflict, time.perf_counter() + 100.0, 0)
    ladders = [ladder for ladder in changes(cell, conflict.selection) if ladder[0].pointer == pointer]
    assert len(ladders) == 1
    return list(trials.climb(ladders[0]))


def test_removing_the_obstacle_that_blocks_is_offered_and_works():
    cell, conflict = ball_in_the_way()
    (removal,) = offered(cell, conflict, "/obstacles/1")
    assert "obstacle ball" in removal.what
    far, _, other = cell.surroundings.obstacles
    freed = replace(cell, surroundings=blocked_by(far, other))
    layout = optimize(freed)
    assert layout.objective is not None
    assert removal.objective >= layout.objective * (1.0 - 1e-6)
    assert judge(freed, layout).clean


def test_a_region_is_offered_larger_by_no_more_than_it_takes():
    near = one_arm(task=carried(4), base=region((0.75, 0.85), (-0.1, 0.1)))
    cell = replace(near, arms=(replace(near.arms[0], base=region((1.25, 1.35), (-0.1, 0.1))),))
    found = explained(cell)
    (wider,) = [r for r in found.relaxations if r.pointer == "/arms/0/base"]
    size = float(wider.what.split("up to ")[1].split(" m")[0])
    assert 0.1 < size < 1.0
    base = region((1.25 - size, 1.35 + size), (-0.1 - size, 0.1 + size))
    layout = optimize(replace(cell, arms=(replace(cell.arms[0], base=base),)))
    assert layout.objective == pytest.approx(wider.objective, rel=1e-3)
    assert found.relaxations == tuple(sorted(found.relaxations, key=lambda r: r.objective))


def test_wider_limits_are_offered_where_a_limit_blocks():
    cell, conflict = limited()
    (wider,) = offered(cell, conflict, "/arms/0/limits/5")
    arm = cell.arms[0]
    more = np.radians(float(wider.what.split("turn ")[1].split("°")[0])) * (np.arange(6) == 5)
    lower, upper = arm.lower - more, arm.upper + more
    freer = replace(arm, lower=lower, upper=upper, weights=range_weights(lower, upper))
    layout = optimize(replace(cell, arms=(freer,)))
    assert layout.objective == pytest.approx(wider.objective, rel=1e-3)


def test_every_change_that_helps_leads_to_a_layout_that_a_dense_check_accepts(monkeypatch):
    """Two arms of the bench, one of which may not stand anywhere."""
    cell = real_cell(13).cell
    accepted = []
    found = ConflictSearch(cell, time.perf_counter() + 60.0, 0).run()

    def spy(original, trials, change, hints):
        layout = original(trials, change, hints)
        if layout is not None:
            stands = np.array([[*p.position, p.yaw] for p in layout.points])
            verdict = dense_check(change.cell, stands, [p.joints for p in layout.points], 0.005, 0.03)
            accepted.append((change.what, verdict.faults))
        return layout

    original = relaxation_module._Trials._try
    monkeypatch.setattr(relaxation_module._Trials, "_try", lambda self, *given: spy(original, self, *given))
    helpful = relaxations(cell, found, time.perf_counter() + 60.0, 0)
    assert helpful
    assert accepted
    assert all(not faults for _, faults in accepted), accepted


def test_pointers_lead_to_the_fields_that_are_changed():
    cell = real_cell(4).cell
    everything_named = everything(cell)
    seen = {change.pointer.split("/")[1] for ladder in changes(cell, everything_named) for change in ladder}
    assert {"arms", "obstacles", "clearance", "max_joint_step"} <= seen
    for ladder in changes(cell, everything_named):
        for change in ladder:
            _, field, *rest = change.pointer.split("/")
            if field == "obstacles":
                assert len(change.cell.surroundings.obstacles) == len(cell.surroundings.obstacles) - 1
                assert cell.surroundings.obstacles[int(rest[0])] not in change.cell.surroundings.obstacles
            if field == "coupling":
                assert cell.couplings[int(rest[0])] not in change.cell.couplings
            if field == "arms":
                changed = [k for k, (a, b) in enumerate(zip(cell.arms, change.cell.arms, strict=True)) if a is not b]
                assert changed == [int(rest[0])]
