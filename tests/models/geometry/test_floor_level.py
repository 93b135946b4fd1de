"""What is wider below a floor than at it, and pedestals that reach to the floor whatever the height of their base."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.cell.floor import Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, PairClass, Pedestal, Surroundings
from duocell.models.collision.collision import CollisionModel
from duocell.models.geometry.floor_level import bulges_below, ends_at, highest
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box, Capsule, ConvexHull, Cylinder, HalfSpace, Shape, Sphere
from duocell.models.robot.arm import Interval
from tests.support.given.arms import make_arm, region
from tests.support.given.solids import FLOOR

LYING, LEANING, STEEP = rotation_x(np.pi / 2), rotation_x(0.6), rotation_x(1.2)
FRUSTUM = np.array([[x * s, y * s, z] for z, s in ((-0.5, 1.0), (0.5, 0.3)) for x in (-1, 1) for y in (-1, 1)])


def body(shape: Shape, z: float, turned: Floats | None = None) -> Body:
    return Body("body", transform(np.eye(3) if turned is None else turned, [0.0, 0.0, z]), shape)


@pytest.mark.parametrize(
    ("one", "bulges"),
    [
        (body(Box(np.array([1.0, 1.0, 1.0])), 0.2), False),
        (body(Box(np.array([1.0, 1.0, 1.0])), -0.6), False),  # below altogether
        (body(Box(np.array([1.0, 1.0, 1.0])), -0.1, LEANING), True),
        (body(Box(np.array([1.0, 1.0, 1.0])), 0.1, rotation_z(0.4)), False),
        (body(Sphere(0.5), 0.1), False),
        (body(Sphere(0.5), -0.1), True),
        (body(Sphere(0.5), -0.5), False),
        (body(Capsule(0.1, 1.0), 0.2), False),
        (body(Capsule(0.1, 1.0), -0.52), True),
        (body(Capsule(0.1, 1.0), 0.05, LYING), False),
        (body(Capsule(0.1, 1.0), 0.05, LEANING), True),
        (body(Cylinder(0.1, 1.0), 0.0), False),
        (body(Cylinder(0.1, 1.0), 0.05, LYING), False),
        (body(Cylinder(0.1, 1.0), 0.05, LEANING), True),
        (body(ConvexHull(FRUSTUM), 0.2), True),
        (body(ConvexHull(-FRUSTUM), 0.2), False),
        (body(HalfSpace(), 0.0), False),
        (body(HalfSpace(), 0.3), True),
        (body(HalfSpace(), 0.0, LYING), False),  # a wall
        (body(HalfSpace(), 0.0, LEANING), True),  # a slope
        (body(HalfSpace(), 0.0, rotation_x(np.pi)), False),  # a ceiling
    ],
)
def test_bodies_that_are_wider_below_the_floor(one: Body, bulges: bool) -> None:
    assert bulges_below(one, 0.0) == bulges


def test_the_top_of_a_body() -> None:
    assert highest(body(Box(np.array([1.0, 1.0, 0.4])), 0.3)) == pytest.approx(0.5)
    assert highest(body(Cylinder(0.1, 1.0), 0.3, LYING)) == pytest.approx(0.4)
    assert highest(body(HalfSpace(), 0.3)) == pytest.approx(0.3)
    assert highest(body(HalfSpace(), 0.3, LYING)) == np.inf
    assert ends_at(body(HalfSpace(), 1e-3), 0.0)
    assert not ends_at(body(HalfSpace(), 2e-3), 0.0)


def obstacles(rng: np.random.Generator) -> tuple[Body, ...]:
    """Bodies on, above, through and below a floor at 0.25, none of them wider below it."""
    made = [Body("floor", transform(np.eye(3), [0.0, 0.0, 0.25]), HalfSpace())]
    for index in range(14):
        size = rng.uniform(0.1, 0.6, 3)
        shapes: list[Shape] = [Box(size), Cylinder(size[0], size[2]), Sphere(size[0]), ConvexHull(-FRUSTUM * size)]
        pose = transform(rotation_z(rng.uniform(-3.0, 3.0)), [*rng.uniform(-1.0, 1.0, 2), rng.uniform(-0.3, 1.2)])
        one = Body(f"body {index}", pose, shapes[index % 4])
        if not bulges_below(one, 0.25):
            made.append(one)
    return tuple(made)


@pytest.mark.parametrize("seed", range(4))
def test_a_pedestal_counts_as_it_is_under_its_base(seed: int) -> None:
    """Against the solid of just that height, for every height of the base."""
    rng = np.random.default_rng(seed)
    footprint = (Footprint.disc(0.2), Footprint.rectangle(0.3, 0.5))[seed % 2]
    pedestal, around = Pedestal(0.7, footprint, foot=0.25), obstacles(rng)
    arm = make_arm("ur5e", "arm", base=region((-1, 1), (-1, 1), (0.3, 0.95)))
    cell = Surroundings(around, clearances=Clearances(arm_obstacle=0.0), equipment={"arm": Equipment((), pedestal)})
    model = CollisionModel([arm], cell)
    own = model.bodies.names.index("arm pedestal")
    pairs = {model.bodies.names[model.bodies.second[p]]: int(p) for p in np.flatnonzero(model.bodies.first == own)}
    assert set(pairs) == {one.name for one in around if highest(one) > 0.251}
    assert len(pairs) >= 5
    for _ in range(6):
        base = transform(rotation_z(rng.uniform(-3.0, 3.0)), [*rng.uniform(-0.8, 0.8, 2), rng.uniform(0.3, 0.95)])
        here = model.configure(base[None], [np.zeros((1, 6))], np.eye(4)[None])
        solid = pedestal.under(float(base[2, 3])).body
        assert 2.0 * (base @ solid.pose)[2, 3] - base[2, 3] == pytest.approx(0.25)
        for one in around:
            if one.name in pairs:
                found = model.contact(here, 0, pairs[one.name])
                assert found.kind is PairClass.ARM_OBSTACLE
                true = separation(solid.shape, base @ solid.pose, one.shape, one.pose).distance
                assert (found.distance < 0.0) == (true < 0.0)
                if true > 0.0:  # how deep it goes depends on where one can get out
                    assert found.distance == pytest.approx(true, abs=2e-5)


def test_an_arm_without_such_a_pedestal_meets_the_floor() -> None:
    arm = make_arm("ur5e", "arm", base=region((-1, 1), (-1, 1), (0.5, 0.5)))
    assert arm.base.z == Interval(0.5, 0.5)
    for foot, count in ((None, 1), (0.0, 0)):
        brings = Equipment((), Pedestal(0.5, Footprint.disc(0.2), foot))
        cell = Surroundings((FLOOR,), clearances=Clearances(arm_obstacle=0.0), equipment={"arm": brings})
        bodies = CollisionModel([arm], cell).bodies
        assert sum(bodies.owners[i].link == 0 and bodies.names[i] == "arm pedestal" for i in bodies.first) == count
