"""The collision model: every pair that should count, none that should not, and the closest one found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import rotation_x, rotation_z, transform
from duocell.models.cell.floor import Footprint
from duocell.models.cell.surroundings import Clearances, Equipment, PairClass, Part, Pedestal, Surroundings
from duocell.models.collision.collision import CollisionModel, Contact
from duocell.models.collision.collision_bodies import collect
from duocell.models.geometry.floor_level import lowest
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box, Sphere
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.robot.arm import Arm
from tests.support.given.arms import make_arm, region
from tests.support.given.cells import ALL, Scene, beam_pair, random_obstacles
from tests.support.given.solids import FLOOR

SCENE = beam_pair(obstacles=random_obstacles(np.random.default_rng(5), 7, [-1.5, -1.0, 0.2], [1.5, 1.5, 1.5]))
MODEL = CollisionModel(SCENE.cell.arms, SCENE.surroundings)


def contacts(
    model: CollisionModel, scene: Scene = SCENE, k: int = 0, bases: Floats | None = None
) -> dict[PairClass, Contact]:
    bases = scene.bases if bases is None else bases
    return model.contacts(bases, [q[k] for q in scene.joints], scene.cell.task.poses[k])


def all_distances(model: CollisionModel, scene: Scene = SCENE, k: int = 0) -> dict[PairClass, list[float]]:
    """Coal on every counted pair: class -> distances."""
    here = model.configure(scene.bases, [q[k : k + 1] for q in scene.joints], scene.cell.task.poses[k : k + 1])
    found: dict[PairClass, list[float]] = {}
    for pair in np.flatnonzero(here.counted):
        contact = model.contact(here, 0, int(pair))
        found.setdefault(contact.kind, []).append(contact.distance)
    return found


@pytest.mark.parametrize("k", range(5))
def test_the_closest_pair_of_every_class_is_the_closest_of_all(k: int) -> None:
    found = contacts(MODEL, k=k)
    everything = all_distances(MODEL, k=k)
    assert set(found) == set(everything) == set(PairClass)
    for kind, contact in found.items():
        assert contact.kind is kind
        assert contact.distance == min(everything[kind])


@pytest.mark.parametrize("k", range(3))
def test_bounds_are_below_every_distance_and_exact_where_they_say_so(k: int) -> None:
    here = MODEL.configure(SCENE.bases, [q[k : k + 1] for q in SCENE.joints], SCENE.cell.task.poses[k : k + 1])
    bounds = MODEL.bounds(here)[0]
    assert np.all(np.isinf(bounds[~here.counted]))
    for pair in np.flatnonzero(here.counted):
        distance = MODEL.contact(here, 0, int(pair)).distance
        assert bounds[pair] <= distance + 1e-6
        if MODEL.exact_bounds[pair]:
            assert bounds[pair] == pytest.approx(distance, abs=1e-6)
    some = np.zeros(len(bounds), dtype=bool)
    some[::3] = True
    assert np.array_equal(MODEL.bounds(here, some)[0], np.where(some, bounds, np.inf))


def test_distances_asked_for_together_are_those_of_coal() -> None:
    here = MODEL.configure(SCENE.bases, SCENE.joints, SCENE.cell.task.poses)
    rng = np.random.default_rng(0)
    pairs = rng.choice(np.flatnonzero(here.counted), 300)
    k = rng.integers(0, len(here), 300)
    found = MODEL.distances(here, k, pairs)
    one_by_one = [MODEL.contact(here, int(i), int(pair)).distance for i, pair in zip(k, pairs, strict=True)]
    assert found == pytest.approx(one_by_one, abs=2e-6)


def test_many_configurations_at_once_are_the_same_as_one_by_one() -> None:
    poses = SCENE.cell.task.poses
    together = MODEL.bounds(MODEL.configure(SCENE.bases, SCENE.joints, poses))
    for k in range(len(poses)):
        here = MODEL.configure(SCENE.bases, [q[k : k + 1] for q in SCENE.joints], poses[k : k + 1])
        assert np.allclose(MODEL.bounds(here)[0], together[k], rtol=0.0, atol=1e-12)


def test_near_lists_all_pairs_within_a_distance() -> None:
    within = {PairClass.ARM_OBSTACLE: 0.5, PairClass.SELF: 0.1}
    found = MODEL.near(SCENE.bases, [q[0] for q in SCENE.joints], SCENE.cell.task.poses[0], within)
    everything = all_distances(MODEL)
    for kind, limit in within.items():
        expected = sorted(d for d in everything[kind] if d < limit)
        assert [c.distance for c in found if c.kind is kind] == pytest.approx(expected)
    assert {c.kind for c in found} <= set(within)
    assert [c.distance for c in found] == sorted(c.distance for c in found)


def test_witness_points_lie_where_the_distance_says() -> None:
    for contact in contacts(MODEL).values():
        gap = contact.point_second - contact.point_first
        assert contact.normal @ gap == pytest.approx(contact.distance, abs=1e-6)
        assert np.linalg.norm(gap) == pytest.approx(abs(contact.distance), abs=1e-6)


def test_an_obstacle_put_into_a_link_is_a_known_collision() -> None:
    here = MODEL.configure(SCENE.bases, [q[:1] for q in SCENE.joints], SCENE.cell.task.poses[:1])
    body = MODEL.bodies.names.index("arm 1 link 2")
    middle = here.ends[0, body].mean(axis=0)
    ball = Body("ball", transform(np.eye(3), middle), Sphere(0.05))
    surroundings = replace(SCENE.surroundings, obstacles=(ball,))
    contact = contacts(CollisionModel(SCENE.cell.arms, surroundings))[PairClass.ARM_OBSTACLE]
    assert (contact.first, contact.second) == ("arm 1 link 2", "ball")
    assert contact.distance == pytest.approx(-(0.05 + MODEL.bodies.radius[body]), abs=1e-6)
    assert contact.first_owner.arm == 1
    assert contact.first_owner.link == 2
    assert contact.second_owner.arm is None


def test_arms_side_by_side_at_no_distance_collide() -> None:
    bases = SCENE.bases.copy()
    bases[1] = bases[0]
    assert contacts(MODEL, bases=bases)[PairClass.ARM_ARM].distance < -0.1


def test_classes_that_nobody_asked_for_are_not_looked_at() -> None:
    surroundings = replace(SCENE.surroundings, clearances=Clearances(arm_arm=0.05))
    model = CollisionModel(SCENE.cell.arms, surroundings)
    assert model.kinds == (PairClass.ARM_ARM,)
    assert set(contacts(model)) == {PairClass.ARM_ARM}


def test_hands_may_touch_the_part_but_forearms_may_not() -> None:
    kinds = MODEL.bodies.kinds
    pairs = {
        MODEL.bodies.owners[i].link
        for i, kind in zip(MODEL.bodies.first, kinds, strict=True)
        if kind is PairClass.ARM_PART
    }
    assert 6 not in pairs
    assert {2, 3, 4} <= pairs


def test_the_grasp_zone_is_cut_from_the_part_for_arms_but_not_for_obstacles() -> None:
    b = MODEL.bodies
    of_arms = {j for j, kind in zip(b.second, b.kinds, strict=True) if kind is PairClass.ARM_PART}
    of_obstacles = {i for i, kind in zip(b.first, b.kinds, strict=True) if kind is PairClass.PART_OBSTACLE}
    assert not of_arms & of_obstacles
    lengths = [2.0 * b.half[j, 0] for j in of_arms]
    assert max(lengths) == pytest.approx(0.7)  # 1.2 m less what is within 0.15 m of the grasps at ±0.5 m
    assert [2.0 * b.half[i, 0] for i in of_obstacles] == pytest.approx([1.2])


def test_what_an_arm_is_bolted_to_does_not_count_against_base_and_pedestal() -> None:
    model = CollisionModel(SCENE.cell.arms, replace(SCENE.surroundings, obstacles=(FLOOR,)))

    def nearest(height: float) -> Contact:
        bases = SCENE.bases.copy()
        bases[0, 2, 3] += height
        return contacts(model, bases=bases)[PairClass.ARM_OBSTACLE]

    assert "pedestal" not in nearest(0.0).first
    assert nearest(0.0).distance > 0.1
    for height in (0.03, -0.1):
        assert (nearest(height).first, nearest(height).second) == ("arm 0 pedestal", "floor")
        assert nearest(height).distance == pytest.approx(height, abs=1e-6)


def test_a_ceiling_or_table_may_carry_an_arm_but_not_be_hit_by_it() -> None:
    arm = make_arm("ur5e", "arm")
    table = Body("table", transform(np.eye(3), [0.0, 0.0, 0.35]), Box(np.array([0.6, 0.6, 0.7])))
    model = CollisionModel([arm], Surroundings((table, FLOOR), clearances=ALL))
    on_table = transform(np.eye(3), [0.0, 0.0, 0.7])[None]
    free = model.contacts(on_table, [arm.robot.reference], np.eye(4))[PairClass.ARM_OBSTACLE]
    assert free.distance > 0.05
    bent = arm.robot.reference.copy()
    bent[1] = 0.5
    hit = model.contacts(on_table, [bent], np.eye(4))[PairClass.ARM_OBSTACLE]
    assert hit.distance < 0.0
    ceiling = Body("ceiling", transform(rotation_x(np.pi), [0.0, 0.0, 2.5]), FLOOR.shape)
    hanging = CollisionModel([arm], Surroundings((ceiling,), clearances=ALL))
    base = transform(rotation_x(np.pi) @ rotation_z(0.3), [0.0, 0.0, 2.5])[None]
    assert hanging.contacts(base, [arm.robot.reference], np.eye(4))[PairClass.ARM_OBSTACLE].distance > 0.05


def test_pedestals_and_tools_of_one_arm_count_for_the_other() -> None:
    kinds = {
        (MODEL.bodies.names[i], MODEL.bodies.names[j])
        for i, j, kind in zip(MODEL.bodies.first, MODEL.bodies.second, MODEL.bodies.kinds, strict=True)
        if kind is PairClass.ARM_ARM
    }
    assert ("arm 0 pedestal", "arm 1 gripper") in kinds
    assert ("arm 0 gripper", "arm 1 pedestal") in kinds
    assert ("arm 0 gripper", "arm 1 gripper") in kinds


def test_a_cell_with_nothing_to_check_has_no_pairs() -> None:
    model = CollisionModel([make_arm("puma560")], Surroundings(clearances=Clearances(arm_arm=0.1, part_obstacle=0.1)))
    assert model.contacts(np.eye(4)[None], [np.zeros(6)], np.eye(4)) == {}
    assert model.kinds == ()


def test_bodies_sit_where_forward_kinematics_puts_them() -> None:
    equipment = {
        "arm": Equipment(
            (Body("tip", transform(np.eye(3), [0, 0, 0.1]), Sphere(0.01)),), Pedestal(0.5, Footprint.disc(0.2))
        )
    }
    arm = make_arm("puma560", "arm")
    part = Part((Body("ball", transform(np.eye(3), [0.3, 0.0, 0.0]), Sphere(0.02)),))
    bodies = collect([arm], Surroundings((FLOOR,), part, clearances=ALL, equipment=equipment))
    model = CollisionModel([arm], Surroundings((FLOOR,), part, clearances=ALL, equipment=equipment))
    q, base = np.array([0.3, -0.5, 2.0, 0.4, 0.6, 0.1]), transform(rotation_z(0.4), [0.2, 0.1, 0.5])
    here = model.configure(base[None], [q[None]], transform(np.eye(3), [1.0, 1.0, 1.0])[None])
    tip = bodies.names.index("arm tip")
    expected = (base @ flange_poses(arm.robot, q)[0] @ [0, 0, 0.1, 1.0])[:3]
    assert np.allclose(here.ends[0, tip], expected, atol=1e-12)
    assert np.allclose(here.ends[0, bodies.names.index("ball")], [1.3, 1.0, 1.0])
    pedestal = bodies.bodies[bodies.names.index("arm pedestal")]
    floor = separation(pedestal.shape, base @ pedestal.pose, FLOOR.shape, FLOOR.pose)
    assert floor.distance == pytest.approx(0.0, abs=1e-9)


def on_pedestal(height: float, z: float | tuple[float, float], side: float = 0.4) -> tuple[Arm, Surroundings]:
    """A UR5e on a pedestal that reaches from the floor to its base."""
    pedestal = Pedestal(height, Footprint.rectangle(side, side), foot=0.0)
    around = Surroundings(clearances=Clearances(self_collision=0.0), equipment={"arm": Equipment(pedestal=pedestal)})
    return make_arm("ur5e", base=region(z=z)), around


@pytest.mark.parametrize("height", [0.02, 0.1, 0.3, 1.5])
def test_what_keeps_off_a_pedestal_does_not_depend_on_its_height(height: float) -> None:
    """The forearm too, however much of its range a high pedestal takes from it."""
    arm, around = on_pedestal(height, height)
    bodies = collect([arm], around)
    links = {
        bodies.owners[j].link
        for i, j in zip(bodies.first, bodies.second, strict=True)
        if bodies.names[i] == "arm pedestal"
    }
    assert links == {3, 4, 5, 6}


@pytest.mark.parametrize("side", [0.4, 0.3])
def test_proofs_rest_on_what_there_is_of_a_pedestal_at_every_height(side: float) -> None:
    arm, around = on_pedestal(0.9, (0.5, 0.9), side)
    bodies = collect([arm], around)
    number = bodies.names.index("arm pedestal")
    assert lowest(bodies.bodies[number]) == pytest.approx(-0.9)
    assert lowest(bodies.sure[number]) == pytest.approx(-0.5, abs=1e-4)
    assert lowest(bodies.sure[number]) > -0.5
    others = [i for i in range(len(bodies.names)) if i != number]
    assert all(bodies.sure[i] is bodies.bodies[i] for i in others)
    arm, around = on_pedestal(0.9, (0.5, 0.9))
    fixed = collect([arm], replace(around, equipment={"arm": Equipment(pedestal=Pedestal(0.9, Footprint.disc(0.2)))}))
    assert all(one is other for one, other in zip(fixed.sure, fixed.bodies, strict=True))
