"""Planted conflicts are named, nothing more and nothing less."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bench.draws.cells import real_cell
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import Clearances, Part, Surroundings
from duocell.models.geometry.shapes import Body, Sphere
from duocell.optimizer.infeasibility.searched.conflict import ConflictSearch, Known
from duocell.optimizer.infeasibility.searched.violations import Violation, part_violations
from tests.support.given.arms import region
from tests.support.given.blocked import (
    ball_in_the_way,
    carried,
    conflict_of,
    far_box,
    halves,
    limited,
    one_arm,
)


def blocking(cell: Cell) -> set[str]:
    """What blocks, without the poses."""
    found = conflict_of(cell)
    assert found.irreducible
    return {word for word in found.selection.words(cell) if not word.startswith("pose")}


def test_an_obstacle_that_alone_blocks_is_all_that_is_named() -> None:
    cell, found = ball_in_the_way()
    assert found.irreducible
    assert found.selection.words(cell) == ("pose 2", "obstacle ball")


def test_a_limit_that_alone_blocks_is_all_that_is_named() -> None:
    cell, found = limited()
    assert found.irreducible
    joint = cell.arms[0].robot.joint_names[5]
    assert found.selection.words(cell)[1:] == (f"limits of main / {joint}",)
    turned = np.radians(20.0) * (found.selection.last - found.selection.first)
    assert np.radians(100.0) < turned <= np.radians(121.0)  # no more poses than it takes to turn too far


def test_two_obstacles_that_only_block_together_are_both_named() -> None:
    left, right = halves()
    cell = one_arm(task=carried(2), obstacles=(left, far_box(), right), base=region(0.0, (-0.7, 0.7)))
    assert blocking(cell) == {"obstacle left", "obstacle right"}


def test_an_obstacle_and_a_region_that_only_block_together_are_both_named() -> None:
    """A platform on one side of the way, and a base that may only stand there."""
    left, _ = halves()
    cell = one_arm(task=carried(2), obstacles=(far_box(), left), base=region(0.0, (0.2, 0.7)))
    assert blocking(cell) == {"obstacle left", "base region of main"}


def test_a_base_region_out_of_reach_is_named_with_the_pose_it_cannot_reach() -> None:
    cell = one_arm(task=carried(4), base=region((1.9, 2.0), (-0.1, 0.1)))
    found = conflict_of(cell)
    assert found.irreducible
    assert found.selection.words(cell)[1:] == ("base region of main",)
    assert found.selection.first == found.selection.last


def test_floor_that_is_nowhere_free_is_named() -> None:
    cell = one_arm(task=carried(3))
    around = replace(cell.surroundings, floor=Floor(None, (np.array([[-3, -3], [3, -3], [3, 3], [-3, 3]]),)))
    assert blocking(replace(cell, surroundings=around)) == {"floor"}


def test_a_part_that_hits_something_on_its_way_blocks_whatever_the_arms_do() -> None:
    cell = one_arm(task=carried(5))
    spot = 0.5 * (cell.task.poses[2] + cell.task.poses[3])[:3, 3]
    around = Surroundings(
        obstacles=(far_box(), Body("post", transform(np.eye(3), spot), Sphere(0.01))),
        part=Part((Body("part", np.eye(4), Sphere(0.02)),), 0.2),
        clearances=Clearances(part_obstacle=0.0),
    )
    cell = replace(cell, surroundings=around)
    found = conflict_of(cell, 2.0)
    assert found.irreducible
    assert found.selection.words(cell) == ("poses 2-3", "obstacle post", "part")
    hit = {(v.first, v.last) for v in part_violations(cell)}
    assert hit == {(2, 3)}


@pytest.mark.parametrize(
    ("seed", "expected"),
    [
        (13, {"floor"}),  # nowhere free
        (23, {"base region of follower"}),  # too far away
        (53, {"obstacle post", "part"}),  # in the part's way
    ],
)
def test_blocked_bench_cells_are_explained_by_what_was_put_in_their_way(seed: int, expected: set[str]) -> None:
    cell = real_cell(seed).cell
    words = blocking(cell)
    assert {word for word in words if not word.startswith("arm ")} == expected


@given(st.data())
@settings(max_examples=60, deadline=None)
def test_the_smallest_set_breaks_every_known_layout_and_no_subset_does(data: st.DataObject) -> None:
    cell = one_arm(obstacles=[far_box(f"box {k}") for k in range(6)])
    search = ConflictSearch(cell, np.inf, 0)
    removable = sorted(search.whole.requirements, key=lambda e: (e.kind, e.index, e.joint))
    draw = st.frozensets(st.sampled_from(removable), min_size=1, max_size=3)
    for _ in range(data.draw(st.integers(1, 8))):
        breaks = tuple(Violation(requirements) for requirements in data.draw(st.lists(draw, min_size=1, max_size=4)))
        search.known.append(Known({}, breaks))
    found = search._smallest(search.whole, removable)
    assert not any(known.keeps(found) for known in search.known)
    for requirement in found.requirements:
        assert any(known.keeps(found.without(requirement)) for known in search.known)
