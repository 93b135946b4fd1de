"""Faults of layouts whose numbers are given: a reason for each rule that is broken, and none for what just keeps it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from duocell.models.cell.cell import Cell
from duocell.models.cell.coupling import Coupling, Distance, Mirror, SameHeight
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import PairClass, Surroundings
from duocell.models.cell.task import Task
from duocell.models.collision.collision import Contact
from duocell.models.collision.collision_bodies import Owner
from duocell.models.robot.posture import Posture
from duocell.optimizer.clearance.clearance import Break, ClassClearance, LimitExcess, PathClearance
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reasons.faults import SLACK, arm_faults, coupling_faults, floor_faults, path_faults, place_faults
from duocell.optimizer.verification.verify import ORIENTATION, POSITION, SIDE, ArmCheck
from tests.support.given.arms import make_arm

CELL = Cell(Task(np.tile(np.eye(4), (6, 1, 1))), (make_arm("ur5e", "left"), make_arm("ur5e", "right")))
STILL = np.zeros((6, 6))
INSIDE = LimitExcess("left", "joint", 2, 0.5, -1.0)
AT_HOME = ArmSolution(np.zeros(3), 0.0, STILL, (1, -1, 1))


KEPT = ArmCheck(0.0, 0.0, 0.0, -1.0, -1.0, -1.0, 0.0, 1.0)
"""Of an arm that keeps everything."""


def near(kind: PairClass, distance: float, required: float, fraction: float = 0.5) -> ClassClearance:
    """The closest pair of a class, half way from pose 2 to pose 3."""
    hand, crate = Owner(1, 6, False), Owner(None, None, False)
    owners = (crate, crate) if kind is PairClass.PART_OBSTACLE else (crate, hand)
    contact = Contact(kind, distance, "crate", "hand", *owners, np.zeros(3), np.zeros(3), np.array([0.0, 0.0, 1.0]), 0)
    return ClassClearance(kind, required, distance, contact, 2, fraction, distance)


def path_of(*classes: ClassClearance, breaks: tuple[Break, ...] = (), worst: LimitExcess = INSIDE) -> PathClearance:
    return PathClearance(classes, breaks, worst, True, 10)


@pytest.mark.parametrize(
    ("distance", "required", "words", "amount"),
    [
        (
            0.004,
            0.01,
            "come within 4.0 mm of each other between poses 2 and 3 (50 % of the way); 10 mm are asked",
            0.006,
        ),
        (-0.0123, 0.0, "penetrate by 12.3 mm between poses 2 and 3 (50 % of the way)", 0.0123),
        (0.00006, 0.01, "come within 0.1 mm of each other between", 0.00994),
        (0.00004, 0.01, "touch between", 0.00996),
        (-0.00004, 0.0, "touch between", 0.00004),
    ],
)
def test_a_pair_that_is_too_near_is_told_with_what_is_missing(
    distance: float, required: float, words: str, amount: float
) -> None:
    (reason,) = path_faults(CELL, path_of(near(PairClass.ARM_OBSTACLE, distance, required)))
    assert (reason.arm, reason.kind, reason.poses, reason.unit) == ("right", "collision", (2, 3), "m")
    assert reason.detail.startswith(f"crate and hand {words}")
    assert ("asked for" in reason.detail) == (required > 0.0)
    assert reason.amount == pytest.approx(amount)


def test_only_classes_that_keep_too_little_are_told_and_of_the_part_no_arm() -> None:
    enough = near(PairClass.ARM_ARM, 0.01, 0.01)
    (reason,) = path_faults(CELL, path_of(enough, near(PairClass.PART_OBSTACLE, 0.0, 0.01, 0.0)))
    assert (reason.arm, reason.poses) == ("", (2,))
    assert " at pose 2; 10 mm are asked for; " in reason.detail


def test_limits_count_between_the_poses_where_poses_do_not_see_them() -> None:
    beyond = LimitExcess("left", "elbow", 3, 0.25, np.radians(2.0))
    (reason,) = path_faults(CELL, path_of(worst=beyond))
    assert (reason.kind, reason.joint, reason.poses) == ("joint_limit", "elbow", (3, 4))
    assert "2.00° between poses 3 and 4 (25 % of the way)" in reason.detail
    for harmless in (replace(beyond, fraction=0.0), replace(beyond, fraction=1.0), replace(beyond, amount=0.9 * SLACK)):
        assert path_faults(CELL, path_of(worst=harmless)) == ()


def test_a_step_that_breaks_twice_is_told_once_at_the_first_place() -> None:
    breaks = (Break("left", 1, 0.25), Break("left", 1, 0.75), Break("right", 1, 0.5), Break("left", 4, 0.5))
    found = path_faults(CELL, path_of(breaks=breaks))
    assert [(reason.arm, reason.poses) for reason in found] == [("left", (1, 2)), ("right", (1, 2)), ("left", (4, 5))]
    assert "25 % of the way" in found[0].detail
    assert "add a pose between 1 and 2" in found[0].detail


def test_a_base_on_floor_that_is_not_free_is_told_the_shortest_way_off_it() -> None:
    pit = np.array([[0.0, 0.0], [2.0, 0.0], [2.0, 4.0], [0.0, 4.0]])
    cell = replace(CELL, surroundings=Surroundings(floor=Floor(None, (pit,), 0.1)))
    places = [np.array([1.7, 2.0, 0.0, 0.3]), np.array([-0.1, 2.0, 0.0, 0.0])]
    (reason,) = floor_faults(cell, places)
    assert (reason.arm, reason.kind, reason.unit) == ("left", "floor", "m")
    assert reason.amount == pytest.approx(0.4)
    assert "reach 0.400 m into forbidden 0; moving it that far along (1.00, 0.00) frees it" in reason.detail
    assert floor_faults(cell, [places[0] + [0.4 + 1e-9, 0.0, 0.0, 0.0], places[1]]) == ()
    for anywhere in (CELL, replace(CELL, surroundings=Surroundings(floor=Floor()))):
        assert floor_faults(anywhere, places) == ()


@pytest.mark.parametrize(
    ("coupling", "words", "amount", "unit"),
    [
        (
            Distance((0, 1), 0.5, 0.8),
            "coupling distance (distance of the bases) is 1 m; allowed is 0.5 to 0.8",
            0.2,
            "m",
        ),
        (Distance((0, 1), 1.5, 1.5), "coupling distance (distance of the bases) is 1 m; allowed is 1.5", 0.5, "m"),
        (SameHeight((1, 0)), "right and left: coupling same_z (same height) is -0.3 m; allowed is 0", 0.3, "m"),
        (Mirror((0, 1), (0.5, 0.0), np.pi / 2), "(same height) is 0.3 m; allowed is 0", 0.3, "m"),
    ],
)
def test_a_coupling_that_is_not_kept_says_what_it_is_and_what_is_allowed(
    coupling: Coupling, words: str, amount: float, unit: str
) -> None:
    places = [np.array([0.0, 0.0, 0.0, np.pi]), np.array([1.0, 0.0, 0.3, 0.0])]
    (reason,) = coupling_faults(replace(CELL, couplings=(coupling,)), places)
    assert words in reason.detail
    assert (reason.kind, reason.unit, reason.arm) == ("coupling", unit, CELL.arms[coupling.arms[0]].name)
    assert reason.amount == pytest.approx(amount, abs=1e-9)


def test_an_angle_between_mirrored_bases_is_told_in_radians() -> None:
    cell = replace(CELL, couplings=(Mirror((0, 1), (0.5, 0.0), np.pi / 2),))
    (reason,) = coupling_faults(cell, [np.array([0.0, 0.0, 0.0, np.pi]), np.array([1.0, 0.0, 0.0, 0.2])])
    assert "(mirrored yaw)" in reason.detail
    assert reason.unit == "rad"
    assert reason.amount == pytest.approx(0.2, rel=2e-3)


def test_arms_in_one_place_are_told_how_far_apart_they_are() -> None:
    places = [np.array([0.0, 0.0, 0.0, 0.0]), np.array([0.02, 0.0, 0.0, 1.0])]
    (reason,) = place_faults(CELL, places)
    assert (reason.arm, reason.kind, reason.unit) == ("left", "collision", "m")
    assert "left and right stand in one place: their bases are 20.0 mm apart, and two bases need 50 mm" in reason.detail
    assert reason.amount == pytest.approx(0.03)
    assert place_faults(CELL, [places[0], places[0] + 0.1]) == ()


@pytest.mark.parametrize(
    ("check", "kind", "words", "amount"),
    [
        (replace(KEPT, position_error=0.0123), "pose_error", "0.0123 m off its grasp", 0.0123),
        (replace(KEPT, orientation_error=0.1), "pose_error", "5.73° off its grasp", 0.1),
        (replace(KEPT, posture=2.0 * SIDE), "posture", "changes along the path", None),
        (replace(KEPT, posture=np.inf), "posture", "not the posture asked for", None),
        (replace(KEPT, conditioning=0.04), "conditioning", "falls to 0.160; 0.2 is asked for", 0.04),
    ],
)
def test_an_arm_is_told_the_rule_that_it_breaks(check: ArmCheck, kind: str, words: str, amount: float | None) -> None:
    arm = replace(CELL.arms[0], min_conditioning=0.2, avoid_singularities=False)
    (reason,) = arm_faults(CELL, arm, AT_HOME, check)
    assert (reason.arm, reason.kind, reason.amount) == ("left", kind, amount)
    assert words in reason.detail


def test_an_arm_that_keeps_all_rules_has_no_fault_and_one_in_another_posture_has() -> None:
    arm = replace(CELL.arms[0], avoid_singularities=False)
    just = replace(KEPT, position_error=POSITION, orientation_error=ORIENTATION, posture=SIDE)
    assert arm_faults(CELL, arm, AT_HOME, just) == ()
    assert arm_faults(CELL, arm, replace(AT_HOME, signs=None), just) == ()
    (reason,) = arm_faults(CELL, replace(arm, posture=Posture(shoulder=-1)), AT_HOME, just)
    assert reason.detail == "left: this is not the posture asked for"
    (unknown,) = arm_faults(CELL, arm, AT_HOME, replace(KEPT, limits=1.0))
    assert unknown.detail == "left: no usable path from this base"
