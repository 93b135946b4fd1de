"""Many stands at once: balls never throw out what is clean, bases get onto their couplings without leaving the task."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from bench.cells import real_cell
from bench.dense_check import dense_check
from models.coupling import Mirror
from models.link_frames import link_frames
from models.shapes import Body, Box, Capsule, ConvexHull, Cylinder, Sphere
from models.surroundings import Surroundings
from optimizer.coupled.crowds import crowded
from optimizer.coupled.inner_balls import ArmBalls, balls_in, pair_lacks, reach_of
from optimizer.coupled.scene import LIMITS, Scene
from optimizer.coupled.stands import Sieve
from optimizer.coupled.turn_tied import turned_onto
from optimizer.optimize import optimize
from optimizer.program import ArmPoint
from optimizer.reduced import reduced_problem
from optimizer.verify import check
from tests.support.arms import region
from tests.support.cells import beam_pair

POST = Body("post", np.eye(4), Cylinder(0.15, 2.0))
CRATE = Body(
    "crate", np.block([[np.eye(3), np.array([[0.5], [-0.4], [0.3]])], [np.zeros((1, 3)), 1.0]]), Box(np.ones(3))
)


@pytest.mark.parametrize(
    "shape",
    [
        Sphere(0.2),
        Capsule(0.1, 0.7),
        Cylinder(0.1, 0.7),
        Cylinder(0.4, 0.1),
        Box(np.array([0.1, 0.4, 0.7])),
        ConvexHull(np.array([[0.0, 0, 0], [1.0, 0, 0], [0, 0.5, 0], [0, 0, 0.8]])),
    ],
    ids=lambda shape: type(shape).__name__,
)
def test_balls_lie_inside_of_their_bodies(shape):
    """Points on the balls, by the definition of each shape."""
    around = np.random.default_rng(1).normal(size=(200, 3))
    around /= np.linalg.norm(around, axis=1)[:, None]
    balls = balls_in(Body("body", np.eye(4), shape))
    assert balls
    for centre, radius in balls:
        assert radius > 0.0
        x, y, z = (centre + radius * around).T
        match shape:
            case Sphere(radius=r):
                outside = np.sqrt(x * x + y * y + z * z) - r
            case Capsule(radius=r, length=length):
                outside = np.sqrt(x * x + y * y + np.maximum(np.abs(z) - length / 2, 0.0) ** 2) - r
            case Cylinder(radius=r, length=length):
                outside = np.maximum(np.hypot(x, y) - r, np.abs(z) - length / 2)
            case Box(size=size):
                outside = np.max(np.abs(np.stack([x, y, z], axis=1)) - size / 2, axis=1)
            case _:
                outside = np.maximum(np.max(-np.stack([x, y, z]), axis=0), x + 2.0 * y + z / 0.8 - 1.0)
        assert np.max(outside) <= 1e-9


def test_balls_never_lack_more_than_the_bodies_do_by_coal():
    made = beam_pair(count=3)
    around = replace(made.surroundings, obstacles=(*made.surroundings.obstacles, POST, CRATE))
    scene = Scene.of(replace(made.cell, surroundings=around))
    model, task, rng, seen = scene.model, made.cell.task, np.random.default_rng(2), 0
    balls = [ArmBalls.of(model, a, scene.required) for a in range(2)]
    reach = reach_of(model, balls[0], balls[1], scene.required)
    for _ in range(25):
        bases, placed, joints = made.bases.copy(), [], []
        for a, arm in enumerate(made.cell.arms):
            bases[a, :3, 3] += rng.uniform(-0.4, 0.4, 3)
            joints.append(made.joints[a][0] + rng.uniform(-0.8, 0.8, 6))
            placed.append(balls[a].placed(bases[a] @ link_frames(arm.robot, joints[a][None])))
        exact = model.contacts(bases, joints, task.poses[0])
        lack = {kind: around.clearances.required(kind) - contact.distance for kind, contact in exact.items()}
        for a in range(2):
            own = balls[a].lacks(placed[a], model.carriers(a, bases[a : a + 1]), task.poses[0], 0)[0]
            assert own <= max(lack["arm_obstacle"], lack["arm_part"]) + 1e-6
            seen += own > 0.0
        both = pair_lacks(placed[0].astype(np.float32), placed[1].astype(np.float32), reach)[0]
        assert both <= lack["arm_arm"] + 1e-5
        seen += both > 0.0
    assert seen > 20


def test_bases_are_turned_onto_a_mirror_and_their_arms_stay_on_the_task():
    made = beam_pair(count=4)
    arms = tuple(replace(arm, base=region((-2.0, 2.0), (-2.0, 2.0), (-1.0, 1.0))) for arm in made.cell.arms)
    cell = replace(made.cell, arms=arms, surroundings=Surroundings(), couplings=())
    tie, scene = Mirror((0, 1), (0.0, 0.0), 1.0), Scene.of(cell)
    sieves = [Sieve.of(scene, a, reduced_problem(cell, arm)) for a, arm in enumerate(cell.arms)]
    places = [base[:3, 3] + np.array([[0.0, 0.0, 0.0], [0.02, 0.05, 0.0]]) for base in made.bases]
    stands = [sieve.stands(some) for sieve, some in zip(sieves, places, strict=True)]
    count = min(map(len, stands))
    assert count > 2
    layouts = turned_onto([tie], sieves, [some.take(np.arange(count)) for some in stands])
    turned = 0
    for row in range(count):
        points = [some.point(row) for some in layouts]
        for arm, point, some in zip(cell.arms, points, layouts, strict=True):
            assert check(cell, arm, point).usable
            error = point.joints - arm.reference
            assert some.objective[row] == pytest.approx(float(np.sum(arm.weights * error**2)))
        free = all(low < -1e-6 and high > 1e-6 for low, high in (some.turns[row] for some in layouts))
        off = float(tie.rows([(*p.position, p.yaw) for p in points]).values[3])
        turned += free
        assert not free or abs(off) < 1e-6
    assert turned


def test_clean_layouts_are_found_where_the_best_stands_of_an_arm_hit_the_arm_itself():
    """Cell 49: the follower's best stands all lack a millimetre between its own forearm and wrist."""
    cell = real_cell(49).cell
    scene = Scene.of(cell)
    found, looked = crowded(scene, [reduced_problem(cell, arm) for arm in cell.arms], 1, np.inf)
    assert looked > 10_000
    clean = [one for one in found if one.lack <= LIMITS]
    assert clean
    bases, joints = [], []
    for point in clean[0].points:
        assert isinstance(point, ArmPoint)
        bases.append([*point.position, point.yaw])
        joints.append(point.joints)
    verdict = dense_check(cell, np.array(bases), joints, 10.0, 10.0)  # at the poses
    assert all(nearest.distance >= nearest.required - 1e-6 for nearest in verdict.nearest.values())


def test_a_mirrored_cell_with_a_narrow_floor_has_a_layout():
    """Cell 24: the stands that the mirror leaves are far from the best ones of either arm."""
    layout = optimize(real_cell(24).cell)
    assert layout.usable
    assert layout.objective < 227.4  # the best of a lattice
    assert all(found.distance >= found.required for found in layout.clearances)
