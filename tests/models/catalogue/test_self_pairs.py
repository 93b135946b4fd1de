"""Self-collision pairs: sound at the reference of every arm, and still seeing what matters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from duocell.models.base.arrays import Floats
from duocell.models.catalogue import catalogue
from duocell.models.catalogue.links import link_bodies
from duocell.models.catalogue.self_pairs import self_pairs
from duocell.models.geometry.bounding import bounding
from duocell.models.geometry.separation import separation
from duocell.models.geometry.shapes import Body, Box
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.robot import Robot
from tests.support.given.arms import general_six, oblique_wrist


def pairs_of(
    robot: Robot, extra: Sequence[tuple[int, Body]] = ()
) -> tuple[list[int], list[Body], list[tuple[int, int]]]:
    bodies = [(b.link, b.body) for b in link_bodies(robot)] + list(extra)
    links, solids = [link for link, _ in bodies], [body for _, body in bodies]
    found = self_pairs(robot, links, solids, [bounding(s.shape) for s in solids], robot.lower, robot.upper)
    return links, solids, found


def distance(robot: Robot, links: list[int], solids: list[Body], pair: tuple[int, int], q: Floats) -> float:
    frames = link_frames(robot, q[None])[0]
    i, j = pair
    return separation(
        solids[i].shape, frames[links[i]] @ solids[i].pose, solids[j].shape, frames[links[j]] @ solids[j].pose
    ).distance


@pytest.mark.parametrize("name", catalogue.names())
def test_no_arm_hits_itself_at_its_reference(name: str) -> None:
    robot = catalogue.robot(name)
    links, solids, pairs = pairs_of(robot)
    for pair in pairs:
        assert abs(links[pair[0]] - links[pair[1]]) > 1
        assert distance(robot, links, solids, pair, robot.reference) >= 0.0


@pytest.mark.parametrize("name", ["puma560", "ur5e", "ur10e", "kr210_r2700", "lrmate200id", "iiwa14", "irb120"])
def test_the_hand_against_base_or_upper_arm_is_still_looked_at(name: str) -> None:
    robot = catalogue.robot(name)
    links, _, pairs = pairs_of(robot)
    kept = {(links[i], links[j]) for i, j in pairs}
    assert any(high >= robot.dof - 2 and low <= 2 for low, high in kept)


def test_a_folded_ur_is_seen() -> None:
    robot = catalogue.robot("ur10e")
    links, solids, pairs = pairs_of(robot)
    folded = robot.reference.copy()
    folded[2] = 3.05
    assert min(distance(robot, links, solids, pair, folded) for pair in pairs) < 0.0


def test_tools_and_pedestals_take_part() -> None:
    robot = catalogue.robot("ur5e")
    pedestal = Body("pedestal", np.diag([1.0, 1.0, 1.0, 1.0]), Box(np.array([0.4, 0.4, 0.1])))
    tool = Body("tool", robot.flange_placement, Box(np.array([0.05, 0.05, 0.3])))
    links, _, pairs = pairs_of(robot, [(0, pedestal), (6, tool)])
    named = [(i, j) for i, j in pairs if len(links) - 1 in (i, j)]
    assert any(links[i] == 0 for i, _ in named)


def test_the_same_pairs_every_time() -> None:
    for robot in (general_six(), oblique_wrist()):
        assert pairs_of(robot)[2] == pairs_of(robot)[2]
