"""Changes that are told are read back as they were told."""

from __future__ import annotations

import numpy as np

from bench.conflicts.double_conflicts import changed, doubled
from bench.conflicts.planted_conflicts import planted
from duocell.optimizer.infeasibility.changes.candidates import candidates
from duocell.optimizer.infeasibility.requirements import Kind, Requirement, Selection
from tests.support.present import present

OBSTACLE = 6


def test_a_wider_region_and_floor_are_read_from_the_words_that_tell_them() -> None:
    kinds, cell = doubled(0)
    assert kinds == ("floor", "region")
    name = cell.arms[0].name
    words = f"let {name} stand 250 mm farther out of its base region"
    wider = present(changed(cell, f"{words}, and let bases stand 100 mm farther out on the floor, on every side"))
    assert np.isclose(wider.arms[0].base.x.high, cell.arms[0].base.x.high + 0.25)
    old, new = present(cell.surroundings.floor).forbidden[0], present(wider.surroundings.floor).forbidden[0]
    assert np.allclose(np.ptp(new, axis=0), np.ptp(old, axis=0) - 0.2)


def test_an_obstacle_is_put_where_the_words_say() -> None:
    made = planted(OBSTACLE)
    some = Selection(frozenset({made.requirement}), 0, len(made.cell.task) - 1)
    (remedy,) = candidates(made.cell, some)
    assert made.requirement == Requirement(Kind.OBSTACLE, made.requirement.index)
    moved = present(remedy.fitted)(made.known)
    told, wanted = present(changed(made.cell, moved.words(0.25))), present(moved.change(0.25))
    pose = [cell.surroundings.obstacles[made.requirement.index].pose for cell in (told, wanted)]
    assert np.allclose(pose[0], pose[1], atol=1e-4)
