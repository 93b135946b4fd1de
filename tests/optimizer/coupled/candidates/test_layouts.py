"""Sampled layouts: on their couplings, on their tasks, and clean where the dense check says so."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.draws.cells import real_cell
from bench.judges.dense_check import dense_check
from duocell.models.cell.coupling import Distance, Mirror
from duocell.models.cell.surroundings import Surroundings
from duocell.optimizer.coupled.candidates.followed import Followed
from duocell.optimizer.coupled.candidates.layouts import sample_layouts
from duocell.optimizer.coupled.candidates.starts import starts_of
from duocell.optimizer.optimize import optimize
from duocell.optimizer.reduction.reduced import reduced_problem
from duocell.optimizer.results.layout import Outcome
from duocell.optimizer.settings import Settings
from duocell.optimizer.verification.scene import Scene
from duocell.optimizer.verification.verify import check
from tests.support.given.arms import region
from tests.support.given.cells import beam_pair
from tests.support.present import present


@pytest.mark.parametrize("tie", [Mirror((0, 1), (0.0, 0.0), 1.0), Distance((0, 1), 1.2, 1.2)], ids=lambda tie: tie.kind)
def test_layouts_are_moved_and_turned_onto_their_couplings_and_stay_on_the_task(tie: Mirror | Distance) -> None:
    made = beam_pair(count=4)
    arms = tuple(replace(arm, base=region((-2.0, 2.0), (-2.0, 2.0), (-1.0, 1.0))) for arm in made.cell.arms)
    cell = replace(made.cell, arms=arms, surroundings=Surroundings(), couplings=(tie,))
    scene = Scene.of(cell)
    followed = Followed.of(scene, [present(reduced_problem(cell, arm)) for arm in arms])
    layouts, tried = sample_layouts(followed, 0.3, 0)
    assert tried > 1000
    starts = starts_of(followed, layouts, 5, 0)
    assert starts
    for start in starts:
        assert start.clean
        assert scene.tie_violation(start.points) <= 1e-6
        assert scene.objective(start.points) == pytest.approx(start.objective, rel=1e-9)
        assert all(check(cell, arm, point).usable for arm, point in zip(arms, start.points, strict=True))


def test_clean_layouts_are_found_where_the_best_placements_of_an_arm_hit_the_arm_itself() -> None:
    """Cell 49: the follower's best placements all miss a millimetre between its own forearm and wrist."""
    cell = real_cell(49).cell
    followed = Followed.of(Scene.of(cell), [present(reduced_problem(cell, arm)) for arm in cell.arms])
    layouts, _ = sample_layouts(followed, 1.0, 1)
    clean = [start for start in starts_of(followed, layouts, 3, 0) if start.clean]
    assert clean
    bases = np.array([[*point.position, point.yaw] for point in clean[0].points])
    verdict = dense_check(cell, bases, [point.joints for point in clean[0].points], 10.0, 10.0)  # at the poses
    assert all(nearest.distance >= nearest.required - 1e-6 for nearest in verdict.nearest.values())


def test_a_mirrored_cell_with_a_narrow_floor_has_a_layout() -> None:
    """Cell 24: the placements that the mirror leaves are far from the best ones of either arm."""
    layout = optimize(real_cell(24).cell, Settings(certificate=None))
    assert layout.outcome is not Outcome.INFEASIBLE
    assert present(layout.objective) < 227.4  # the best of a lattice
    assert all(found.distance >= found.required - 1e-6 for found in layout.clearances)
