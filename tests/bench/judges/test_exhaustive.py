"""The exhaustive search finds what is there, says so when nothing is, and throws nothing out that could work."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bench.draws.cells import real_cell
from bench.judges.dense_check import dense_check
from bench.judges.dense_shapes import coal_shape
from bench.judges.exhaustive import exhaustive
from bench.judges.grid_stands import lattice_of, stands_of
from bench.judges.inner_balls import Balls, point_distances
from duocell.models.base.pose import transform
from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Direction, Mirror, Rail
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box, ConvexHull, HalfSpace, Shape, Sphere
from duocell.models.robot.arm import Interval
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate
from tests.support.given.solids import KINDS, random_shape
from tests.support.present import present

EXAMPLES = Path(__file__).parents[3] / "examples"


def cornered(seed: int, side: float) -> Cell:
    """An open cell whose bases may only stand near the known layout, with the lattice through that layout's corner."""
    real = real_cell(seed)
    arms = []
    for arm, stand in zip(real.cell.arms, present(real.known).stands, strict=True):
        x, y = (Interval(float(v) - side, float(v) + side) for v in stand[:2])
        arms.append(replace(arm, base=replace(arm.base, x=x, y=y)))
    return replace(real.cell, arms=tuple(arms), couplings=())


def test_a_planted_layout_is_found_and_clean() -> None:
    cell = cornered(91, 0.04)
    found = exhaustive(cell, 30.0, step=0.03)
    assert found.layout is not None
    assert found.complete
    assert dense_check(cell, found.layout.stands, list(found.layout.joints)).clean


def test_nothing_is_found_where_the_part_cannot_pass_and_the_search_is_through() -> None:
    cell = cornered(91, 0.04)
    poses = cell.task.poses
    post = Body("post", transform(np.eye(3), 0.5 * (poses[0, :3, 3] + poses[1, :3, 3])), Sphere(0.01))
    blocked = replace(cell, surroundings=replace(cell.surroundings, obstacles=(post,)))
    found = exhaustive(blocked, 30.0, step=0.03)
    assert found.layout is None
    assert found.complete
    assert found.pairs == 0


def test_nothing_is_found_where_a_base_is_buried() -> None:
    cell = cornered(91, 0.04)
    heap = cell.arms[0].base
    middle = [heap.x.middle, heap.y.middle, heap.z.low + 0.4]
    rock = Body("rock", transform(np.eye(3), middle), Box(np.array([0.3, 0.3, 0.4])))
    clear = replace(cell.surroundings.clearances, part_obstacle=None)
    around = replace(cell.surroundings, obstacles=(rock,), clearances=clear)
    found = exhaustive(replace(cell, surroundings=around), 30.0, step=0.03)
    assert found.layout is None
    assert found.complete
    assert found.free[0] == 0
    assert found.working[0] > 0


def test_a_mirrored_pair_is_found_on_the_lattice_of_its_plane() -> None:
    request = json.loads((EXAMPLES / "mirror_cell.json").read_text())
    cell = cell_of(validate(LayoutRequest, request))
    found = exhaustive(cell, 30.0)
    assert found.layout is not None
    assert dense_check(cell, found.layout.stands, list(found.layout.joints)).coupling_excess < 1e-6


def test_lattices_carry_rails_directions_and_mirrors() -> None:
    cell = real_cell(91).cell
    for tie in (Rail((0, 1), 0.3, (0.1, 0.2)), Direction((0, 1), -1.0), Mirror((0, 1), (0.2, 0.1), 0.7)):
        lattice = lattice_of(replace(cell, couplings=(tie,)), 0.1)
        assert lattice.angle == tie.angle
        points = lattice.points(cell.arms[0])
        box = cell.arms[0].base.bounds[:3]
        assert ((points >= box[:, 0] - 1e-12) & (points <= box[:, 1] + 1e-12)).all()
        aside = (points[:, :2] - lattice.origin) @ [-np.sin(tie.angle), np.cos(tie.angle)] / lattice.step
        assert aside == pytest.approx(aside.round(), abs=1e-9)
        area = np.prod(box[:2, 1] - box[:2, 0])
        assert len(points) == pytest.approx(area / 0.01, rel=0.15)


def test_stands_are_sorted_and_do_the_task() -> None:
    cell = cornered(91, 0.1)
    stands = stands_of(cell, 0, lattice_of(cell, 0.05))
    assert stands.working >= len(stands) > 0
    assert (np.diff(stands.objective) >= 0.0).all()
    alone = replace(cell, arms=cell.arms[:1], surroundings=replace(cell.surroundings, obstacles=()))
    for k in range(0, len(stands), 7):
        verdict = dense_check(alone, stands.stands[k][None], [stands.joints[k]], 1e3, 1e3)
        assert verdict.pose_error < 1e-8
        assert verdict.limit_excess <= 1e-9
        assert verdict.region_excess == 0.0


@pytest.mark.parametrize("kind", KINDS)
def test_balls_lie_inside_and_distances_of_points_are_coals(kind: type[Shape]) -> None:
    rng = np.random.default_rng(7)
    speck = Sphere(1e-6)
    for _ in range(5):
        shape = random_shape(kind, rng)
        body = Body("it", transform(np.eye(3), rng.uniform(-1.0, 1.0, 3)), shape)
        balls = Balls([body], [0])
        inside = point_distances(body, balls.centres)
        assert (inside <= -balls.radii + 1e-9).all()
        assert (len(balls.radii) > 0) == (not isinstance(shape, HalfSpace))
        for point in rng.uniform(-1.5, 1.5, (20, 3)):
            mine = point_distances(body, point)
            theirs = separation(speck, transform(np.eye(3), point), shape, body.pose).distance + 1e-6
            if mine > 0.0 and not isinstance(shape, ConvexHull):
                assert mine == pytest.approx(theirs, abs=2e-6)
            assert (mine > 1e-5) == (theirs > 1e-5)
        assert coal_shape(shape) is not None
