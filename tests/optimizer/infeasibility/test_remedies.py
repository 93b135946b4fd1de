"""The smallest change that samples find is of a layout that passes every check, and near to what a known one needs."""

from __future__ import annotations

import numpy as np
import pytest

from bench.conflicts.planted_conflicts import NEAR, needed, planted, remedy_of
from duocell.optimizer.infeasibility.effort import Effort
from duocell.optimizer.infeasibility.remedies import least_sampled
from duocell.optimizer.infeasibility.searched.trial import clean
from duocell.optimizer.verification.scene import Scene

ENOUGH = [(53, "step", 0.2510), (52, "conditioning", 0.1571), (21, "clearance", 0.1649)]
"""Seeds, and the amounts (rad, 1, m) for which the known layouts, which no search has found, pass every check."""


@pytest.mark.parametrize(("seed", "kind", "known"), ENOUGH)
def test_samples_find_a_change_no_larger_than_a_known_layout_needs_by_a_fifth(
    seed: int, kind: str, known: float
) -> None:
    made = planted(seed)
    remedy = remedy_of(made)
    assert made.kind == kind
    assert remedy is not None
    found = least_sampled(remedy, Effort(1.2, np.inf), 0)
    assert found is not None
    assert clean(Scene.of(remedy.change(found.amount)), found.found.points)
    assert not clean(Scene.of(made.cell), found.found.points)
    assert found.amount <= NEAR * known


def test_longer_steps_than_those_of_a_layout_are_not_asked_for() -> None:
    made = planted(53)
    remedy = remedy_of(made)
    assert remedy is not None
    assert remedy.need is not None
    longest = max(float(np.max(np.abs(np.diff(point.joints, axis=0)))) for point in made.known)
    need = remedy.need([point.joints[None] for point in made.known])
    assert need.tolist() == pytest.approx([longest - made.cell.max_joint_step], abs=1e-12)


def test_what_is_needed_may_be_more_than_can_be_told() -> None:
    made = planted(54)
    remedy = remedy_of(made)
    assert remedy is not None
    apart = float(np.linalg.norm(made.known[0].position[:2] - made.known[1].position[:2]))
    assert apart - 0.1 * apart > remedy.most  # the planted distance ends at a tenth of the known one
    assert needed(made, remedy) == pytest.approx(0.9 * apart, abs=2e-3)
