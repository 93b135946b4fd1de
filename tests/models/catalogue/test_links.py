"""Bodies of links: they contain the arm's skeleton, end where they should, and say where they come from."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.links import (
    AT_BASE,
    LinkBody,
    estimated_bodies,
    estimated_radius,
    link_bodies,
    provenance,
    skeleton,
)
from duocell.models.geometry.bounding import bounding, segment_distances
from duocell.models.geometry.shapes import Capsule, Sphere
from duocell.models.kinematics.kinematics import reach
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.robot import Robot
from tests.support.given.arms import general_six, oblique_wrist, puma_by_table
from tests.support.given.linear_axis import on_linear_axis

ROBOTS = [catalogue.robot(name) for name in catalogue.names()] + [general_six(), oblique_wrist(), puma_by_table()]
ESTIMATED = [robot for robot in ROBOTS if provenance(link_bodies(robot)) == "estimated"]


def segments(robot: Robot, bodies: tuple[LinkBody, ...], q: Floats) -> tuple[Floats, Floats]:
    """(K, B, 2, 3) capsule segments in the base frame, and their radii (B,)."""
    frames = link_frames(robot, q)
    bounds = [bounding(b.body.shape) for b in bodies]
    local = [b.body.pose[:3, :3] @ bound.ends.T + b.body.pose[:3, 3:] for b, bound in zip(bodies, bounds, strict=True)]
    placed = [
        (frames[:, b.link, :3, :3] @ ends + frames[:, b.link, :3, 3:]).swapaxes(1, 2)
        for b, ends in zip(bodies, local, strict=True)
    ]
    return np.stack(placed, axis=1), np.array([bound.radius for bound in bounds])


@pytest.mark.parametrize("robot", ESTIMATED, ids=lambda robot: robot.name)
def test_capsules_contain_the_lines_between_joint_origins(robot: Robot) -> None:
    """At any posture: every point of the skeleton lies in a capsule."""
    bodies = link_bodies(robot)
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (5, robot.dof))
    frames = link_frames(robot, q)
    ends, radii = segments(robot, bodies, q)
    for link in range(robot.dof + 1):
        corners = skeleton(robot, link)
        for start, end in pairwise(corners):
            for share in np.linspace(0.0, 1.0, 11):
                point = frames[:, link] @ np.array([*(start + share * (end - start)), 1.0])
                spots = np.stack([point[:, :3], point[:, :3]], axis=1)[:, None]
                beyond = segment_distances(spots, ends) - radii
                assert np.all(np.min(beyond, axis=1) < 1e-9), (link, share)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_skeletons_join_the_joints(robot: Robot) -> None:
    for link in range(robot.dof + 1):
        corners = skeleton(robot, link)
        place = robot.joint_placements[link] if link < robot.dof else robot.flange_placement @ robot.flange()
        assert np.allclose(corners[0], 0.0)
        assert np.allclose(corners[-1], place[:3, 3], atol=1e-6)


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
def test_every_arm_has_bodies_with_provenance(robot: Robot) -> None:
    bodies = link_bodies(robot)
    assert bodies
    assert all(0 <= body.link <= robot.dof for body in bodies)
    assert all(isinstance(body.body.shape, Capsule | Sphere) for body in bodies)
    assert provenance(bodies) in ("estimated", "cited")
    assert all(body.source for body in bodies)
    assert [body.link for body in bodies] == sorted(body.link for body in bodies)


@pytest.mark.parametrize("robot", ESTIMATED, ids=lambda robot: robot.name)
def test_the_estimated_radius_follows_the_stated_rule(robot: Robot) -> None:
    assert estimated_radius(robot, 0) == pytest.approx(0.085 * reach(robot))
    assert estimated_radius(robot, robot.dof) == pytest.approx(0.04 * reach(robot))
    for body in link_bodies(robot):
        assert isinstance(body.body.shape, Capsule | Sphere)
        assert body.body.shape.radius == pytest.approx(estimated_radius(robot, body.link))


def test_a_dh_arm_is_bent_like_its_table() -> None:
    """PUMA link 2: 149.1 mm along the shoulder axis, then 431.8 mm of upper arm across."""
    robot = catalogue.robot("puma560")
    corners = skeleton(robot, 2)
    assert np.linalg.norm(np.diff(corners, axis=0), axis=1) == pytest.approx([0.1491, 0.4318])
    first, second = np.diff(corners, axis=0)
    assert first @ second == pytest.approx(0.0, abs=1e-9)


def test_capsules_end_flush_with_flange_and_mounting_face() -> None:
    robot = catalogue.robot("xarm6")
    bodies = link_bodies(robot)
    q = np.zeros((1, 6))
    ends, radii = segments(robot, bodies, q)
    lowest = np.min(ends[0, bodies[0].link == np.array([b.link for b in bodies]), :, 2]) - radii[0]
    assert lowest == pytest.approx(0.0, abs=1e-9)


CITED = [robot for robot in ROBOTS if provenance(link_bodies(robot)) == "cited"]


def test_some_arms_are_better_known() -> None:
    assert {"ur5e", "ur10e", "lrmate200id", "kr6_r900", "iiwa14"} <= {robot.name for robot in CITED}


@pytest.mark.parametrize("robot", CITED, ids=lambda robot: robot.name)
def test_cited_bodies_hang_together_along_the_arm(robot: Robot) -> None:
    """Each link's bodies touch those of the link before, at any posture, and no body is out of proportion."""
    bodies = link_bodies(robot)
    ends, radii = segments(robot, bodies, np.random.default_rng(0).uniform(-3.0, 3.0, (5, robot.dof)))
    links = np.array([body.link for body in bodies])
    assert set(links) == set(range(robot.dof + 1))
    for link in range(1, robot.dof + 1):
        gaps = [
            segment_distances(ends[:, i], ends[:, j]) - radii[i] - radii[j]
            for i in np.flatnonzero(links == link)
            for j in np.flatnonzero(links == link - 1)
        ]
        assert np.all(np.min(gaps, axis=0) < 0.0)
    assert radii.max() < 0.16 * reach(robot)
    assert all("capsules around" in body.source for body in bodies)


@pytest.mark.parametrize("robot", CITED, ids=lambda robot: robot.name)
def test_cited_bodies_contain_every_joint_origin(robot: Robot) -> None:
    bodies = link_bodies(robot)
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (5, robot.dof))
    ends, radii = segments(robot, bodies, q)
    origins = link_frames(robot, q)[:, 1:, :3, 3]
    for joint in range(robot.dof):
        spots = np.stack([origins[:, joint], origins[:, joint]], axis=1)[:, None]
        assert np.all(np.min(segment_distances(spots, ends) - radii, axis=1) < 0.0), joint


def test_the_upper_arm_of_a_ur_is_beside_its_kinematic_line() -> None:
    """The shoulder offset (176 mm for a UR10e) that the joint origins know nothing of."""
    (arm,) = [body for body in link_bodies(catalogue.robot("ur10e")) if body.link == 2]
    assert np.linalg.norm(arm.body.pose[1, 3]) == pytest.approx(0.1762, abs=0.005)


def test_a_user_s_robot_does_not_inherit_a_catalogue_name_s_data() -> None:
    robot = replace(general_six(), name="ur10e")
    assert provenance(link_bodies(robot)) == "estimated"


def test_the_rail_of_a_linear_axis_spans_its_travel_and_is_no_thicker_than_the_arm() -> None:
    robot = on_linear_axis("ur10e", travel=(-2.0, 9.0))
    carried = robot.carried
    assert carried is not None
    bodies = estimated_bodies(robot)
    rail = next(body for body in bodies if body.link == 0)
    assert isinstance(rail.body.shape, Capsule)
    assert rail.body.shape.length == pytest.approx(11.0)
    assert rail.body.shape.radius == pytest.approx(AT_BASE * reach(carried))
    ends = [rail.body.pose @ np.array([0.0, 0.0, side * 5.5, 1.0]) for side in (-1.0, 1.0)]
    frames = link_frames(robot, np.array([[-2.0, *6 * [0.0]], [9.0, *6 * [0.0]]]))[:, 1, :3, 3]
    assert sorted(end[0] for end in ends) == pytest.approx(sorted(frames[:, 0]))
    assert max(body.body.shape.radius for body in bodies if isinstance(body.body.shape, Capsule)) < 0.2
