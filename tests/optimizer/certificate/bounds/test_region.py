from __future__ import annotations

import numpy as np
import pytest

from duocell.optimizer.certificate.bounds.angles.targets import Targets
from duocell.optimizer.certificate.bounds.region import reachable_region
from duocell.optimizer.reduction.reduced import evaluate
from tests.support.given.boxes import PARALLEL, SPECIAL, SPHERICAL, random_problem


@pytest.mark.parametrize("name", SPHERICAL + PARALLEL + SPECIAL)
def test_no_base_outside_reaches_every_pose(name: str) -> None:
    rng = np.random.default_rng(23)
    cut = inside = 0
    for trial in range(6):
        problem = random_problem(name, rng, mounted=trial % 2 == 1)
        wide = problem.arm.base.bounds[:3] * [[2.5], [2.5], [1.5]]
        region = reachable_region(Targets.of(problem), wide)
        places = rng.uniform(wide[:, 0], wide[:, 1], (3000, 3))
        reached = np.any(evaluate(problem, places).missing == 0.0, axis=0)
        within = np.all((places >= region.low) & (places <= region.high), axis=1)
        assert not np.any(reached & ~within)
        cut, inside = cut + int(np.sum(~within)), inside + int(np.sum(within))
    assert cut > 1000
    assert inside > 100


def test_poses_too_far_from_the_region_or_from_each_other_are_named() -> None:
    problem = random_problem("ur10e", np.random.default_rng(1))
    bounds = problem.arm.base.bounds[:3]
    targets = Targets.of(problem)
    far = reachable_region(targets, bounds + np.array([[9.0], [0.0], [0.0]]))
    assert far.empty
    assert np.all(far.culprits)
    moved = targets.wrist.copy()
    moved[-1, 1] += 6.0
    apart = reachable_region(
        Targets(targets.form, targets.sigma, targets.mount, moved, targets.turned, targets.last_axis, targets.dims),
        np.array([[-9.0, 9.0], [-9.0, 9.0], [0.0, 0.0]]),
    )
    assert apart.empty
    assert apart.culprits[-1]
    assert apart.culprits.sum() == 2
