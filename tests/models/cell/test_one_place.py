"""Bases that are in one place, and sides of one machine, which may be."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.cell.coupling.apart import Apart
from duocell.models.cell.one_place import NEAREST, in_one_place, one_machine
from duocell.models.robot.arm import Arm
from tests.support.given.arms import make_arm


def two(first: str, second: str) -> list[Arm]:
    return [make_arm(first, "one"), make_arm(second, "other")]


@pytest.mark.parametrize(
    ("shift", "near"), [([0, 0, 0], True), ([0.03, 0.03, 0.02], True), ([0, 0, 0.06], False), ([0.04, 0.04, 0], False)]
)
def test_origins_nearer_than_any_base_is_wide_are_one_place(shift: list[float], near: bool) -> None:
    arms = two("ur5e", "ur5e")
    found = in_one_place(arms, [np.ones(3), np.ones(3) + shift])
    assert [pair[:2] for pair in found] == ([(0, 1)] if near else [])
    for *_, apart in found:
        assert apart == pytest.approx(np.linalg.norm(shift))
    rows = Apart((0, 1), NEAREST).rows([np.ones(4), np.array([*(np.ones(3) + shift), 2.0])])
    assert (rows.values[0] < rows.lower[0]) == near


@pytest.mark.parametrize(
    ("names", "one"),
    [
        (("yumi_left", "yumi_right"), True),
        (("openarm_right", "openarm_left"), True),
        (("yumi_left", "openarm_right"), False),
        (("yumi_left", "yumi_left"), False),
        (("ur5e", "ur5e"), False),
        (("ur5e", "ur10e"), False),
    ],
)
def test_sides_of_one_machine(names: tuple[str, str], one: bool) -> None:
    arms = two(*names)
    assert one_machine(*arms) == one_machine(*arms[::-1]) == one
    assert bool(in_one_place(arms, [np.zeros(3)] * 2)) == (not one)
