"""What a base is mounted on: met straight below it, whatever the shape, and nothing else."""

from __future__ import annotations

import coal
import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from bench.judges.dense_mounting import carriers as judged_carriers
from bench.judges.dense_shapes import coal_shape
from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, transform
from duocell.models.catalogue.links import LinkBody
from duocell.models.cell.floor import Footprint
from duocell.models.cell.mounting import DEPTH, Mounting, face_depth
from duocell.models.cell.surroundings import Clearances, Equipment, Pedestal, Surroundings
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.floor_level import ABOVE, lowest
from duocell.models.geometry.shapes import Body, Box, Capsule, Cylinder, HalfSpace, Shape
from tests.support.given.arms import make_arm
from tests.support.given.solids import FLOOR, KINDS, random_pose, random_shape

UP = np.eye(3)
BLOCK = Body("block", transform(UP, [-0.25, 0.0, -0.14]), Box(np.array([0.5, 2.0, 1.0])))


def at(x: float, y: float, z: float, turn: Floats = UP) -> Floats:
    return transform(turn, [x, y, z])[None]


@pytest.mark.parametrize(
    ("height", "carried"),
    [(0.0, True), (0.01, True), (DEPTH, True), (0.0201, False), (-0.0005, True), (-0.005, False)],
)
def test_a_floor_at_the_base_or_a_little_below_carries_it(height: float, carried: bool) -> None:
    assert Mounting([FLOOR]).carriers(at(0.3, 0.2, height), 0.0)[0, 0] == carried


@pytest.mark.parametrize("x", [-1e-3, -1e-12, 0.0, 1e-12, 1e-3])
def test_a_block_beside_the_base_never_carries_it(x: float) -> None:
    assert not np.any(Mounting([BLOCK]).carriers(at(x, 0.0, 0.3), 0.0))
    assert Mounting([BLOCK]).carriers(at(-1e-3, 0.0, 0.36), 0.0)[0, 0]


def test_only_the_first_surface_carries_and_flush_ones_together() -> None:
    plate = Body("plate", transform(UP, [0.0, 0.0, 0.005]), Box(np.array([1.0, 1.0, 0.01])))
    assert Mounting([FLOOR, plate]).carriers(at(0.0, 0.0, 0.01), 0.0).tolist() == [[False, True]]
    beside = Body("beside", transform(UP, [1.0, 0.0, 0.005]), Box(np.array([1.0, 1.0, 0.01])))
    assert Mounting([plate, beside]).carriers(at(0.5, 0.0, 0.01), 0.0).tolist() == [[True, True]]


def test_hanging_and_tilted_bases_look_along_their_own_axis() -> None:
    ceiling = Body("ceiling", transform(rotation_x(np.pi), [0.0, 0.0, 2.5]), HalfSpace())
    assert Mounting([ceiling, FLOOR]).carriers(at(0.0, 0.0, 2.49, rotation_x(np.pi)), 0.0).tolist() == [[True, False]]
    wall = Body("wall", transform(rotation_x(np.pi / 2), [0.0, 1.0, 0.0]), HalfSpace())  # solid where y >= 1
    tilted = rotation_x(np.pi / 2)  # its -z axis points along y
    assert Mounting([FLOOR, wall]).carriers(at(0.0, 0.99, 0.001, tilted), 0.0).tolist() == [[False, True]]


def test_of_a_pedestal_the_underside_is_the_face_and_of_meshes_the_lowest_point() -> None:
    arm = make_arm("ur5e", "arm")
    pedestal = Surroundings(equipment={"arm": Equipment(pedestal=Pedestal(0.4, Footprint.disc(0.1)))})
    assert face_depth(pedestal, arm) == 0.4
    assert face_depth(Surroundings(), arm) == 0.0
    base = LinkBody(0, Body("base", transform(UP, [0.0, 0.0, 0.03]), Box(np.array([0.2, 0.2, 0.1]))), "mesh", "")
    meshes = Surroundings(equipment={"arm": Equipment(links=(base,))})
    assert face_depth(meshes, arm) == pytest.approx(0.02)


def test_bases_of_random_cells_stand_where_a_lowered_ball_lands() -> None:
    rng, met = np.random.default_rng(3), 0
    for _ in range(60):
        bodies = [Body(kind.__name__, random_pose(rng, 0.4), random_shape(kind, rng)) for kind in KINDS]
        bases = [random_pose(rng, 0.4) for _ in range(12)]
        bases += [_above(body, rng) for body in bodies]
        found = Mounting(bodies).carriers(np.array(bases), 0.05)
        maybe = Mounting(bodies).possible_carriers(np.array(bases), 0.05, np.zeros(len(bases)))
        for base, carried, possible in zip(bases, found, maybe, strict=True):
            judged = judged_carriers(base, 0.05, [(coal_shape(body.shape), body.pose) for body in bodies])
            assert set(np.flatnonzero(carried)) == judged
            assert judged <= set(np.flatnonzero(possible))
            met += len(judged)
    assert met > 100


def test_what_may_carry_a_base_nearby_is_told_beforehand() -> None:
    rng = np.random.default_rng(4)
    bodies = [Body(f"body {index}", random_pose(rng, 0.3), random_shape(kind, rng)) for index, kind in enumerate(KINDS)]
    mounting, excluded = Mounting(bodies), 0
    for body in bodies * 8:
        base, shift = _above(body, rng), rng.uniform(0.0, 0.1)
        possible = mounting.possible_carriers(base[None], 0.05, np.array([shift]))[0]
        moved = np.tile(base, (200, 1, 1))
        ways = rng.normal(size=(200, 3))
        moved[:, :3, 3] += shift * ways / np.linalg.norm(ways, axis=1)[:, None] * rng.random((200, 1))
        assert not np.any(mounting.carriers(moved, 0.05) & ~possible)
        excluded += np.sum(~possible)
    assert excluded > 20


@pytest.mark.parametrize("shape", [Box(np.array([0.4, 0.4, 0.6])), Cylinder(0.2, 0.6), Capsule(0.2, 0.3)])
def test_no_base_that_starts_inside_or_beside_a_body_may_be_carried_by_it(shape: Shape) -> None:
    mounting = Mounting([Body("body", transform(UP, [0.0, 0.0, 0.3]), shape)])
    for x, z, possible in ((0.0, 0.1, False), (0.195, 0.1, False), (0.205, 0.1, False), (0.0, 0.61, True)):
        base = transform(UP, [x, 0.0, z + 0.05])
        assert mounting.possible_carriers(base[None], 0.05, np.array([0.01]))[0, 0] == possible


def _above(body: Body, rng: np.random.Generator) -> Floats:
    """A base whose mounting face, 50 mm below it, is at most 30 mm from the top of a body, seen along a random way."""
    turn = Rotation.random(rng=rng).as_matrix()
    start = body.pose[:3, 3] + rng.uniform(-0.03, 0.03, 3) + 2.0 * turn[:, 2]
    speck = coal.Sphere(1e-6)
    for _ in range(200):
        place = coal.Transform3s(np.eye(3), start)
        shape = coal.Transform3s(body.pose[:3, :3], body.pose[:3, 3])
        gap = coal.distance(speck, place, coal_shape(body.shape), shape, coal.DistanceRequest(), coal.DistanceResult())
        if gap < 1e-6:
            break
        start = start - gap * turn[:, 2]
    return transform(turn, start + rng.uniform(0.045, 0.075) * turn[:, 2])


def test_the_lowest_point_of_a_body_is_where_a_rising_floor_meets_it() -> None:
    rng = np.random.default_rng(5)
    for kind in KINDS * 4:
        pose, shape = random_pose(rng, 0.3), random_shape(kind, rng)
        ground = coal.Halfspace(np.array([0.0, 0.0, 1.0]), -10.0)
        placed = coal.Transform3s(pose[:3, :3], pose[:3, 3])
        gap = coal.distance(
            coal_shape(shape), placed, ground, coal.Transform3s(), coal.DistanceRequest(), coal.DistanceResult()
        )
        assert lowest(Body(kind.__name__, pose, shape)) == pytest.approx(gap - 10.0, abs=1e-6)


@pytest.mark.parametrize("name", ["ur10e", "irb120", "kassow_kr810"])
def test_arms_stand_on_a_floor_whatever_link_has_the_metal_of_their_base(name: str) -> None:
    arm = make_arm(name, "arm")
    model = CollisionModel([arm], Surroundings((FLOOR,), clearances=Clearances(arm_obstacle=0.0)))
    counted = model.counted(np.eye(4)[None])
    first, owners = arm.robot.joint_placements[0], model.bodies.owners
    for i in model.bodies.first[counted]:
        body = model.bodies.bodies[i]
        assert owners[i].link > 1 or lowest(Body("", first @ body.pose, body.shape)) > ABOVE
    assert np.any(~counted)
