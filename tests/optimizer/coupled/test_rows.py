"""Linear rows of a layout against what really happens when its bases move."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from models.cell import Cell
from models.floor import Floor
from models.surroundings import Clearances
from models.task import Task
from optimizer.coupled.rows import MOST_ROWS, Columns, look
from optimizer.coupled.scene import Scene
from optimizer.path_samples import follow
from optimizer.program import ArmPoint
from tests.support.arms import make_arm
from tests.support.cells import beam_pair

STEP = 1e-5


@pytest.fixture(scope="module")
def case():
    made = beam_pair(count=4, shift=(0.25, 0.0, 0.1))
    square = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    hole = np.array([[-0.2, 0.2], [0.2, 0.2], [0.2, 0.5], [-0.2, 0.5]])
    clearances = Clearances(0.4, 0.2, 0.2, None, 0.05)
    around = replace(made.surroundings, floor=Floor(square, (hole,), 0.1), clearances=clearances)
    cell = replace(made.cell, surroundings=around)
    points = [
        ArmPoint(base[:3, 3], float(np.arctan2(base[1, 0], base[0, 0])), q, None)
        for base, q in zip(made.bases, made.joints, strict=True)
    ]
    return Scene.of(cell), points


def moved(scene, points, index, axis, step):
    """The layout with one base moved, its arm still on the task."""
    arm, point = scene.cell.arms[index], points[index]
    place = np.array([*point.position, point.yaw]) + step * np.eye(4)[axis]
    targets = scene.cell.flange_targets(arm)
    q, good = follow(arm.robot, arm.base_in_world(place[:3], place[3]), targets, point.joints, point.joints)
    assert np.all(good)
    changed = list(points)
    changed[index] = ArmPoint(place[:3], float(place[3]), q, None)
    return changed


def test_slopes_are_those_of_the_values(case, monkeypatch):
    monkeypatch.setattr("optimizer.coupled.rows.MOST_ROWS", 10_000)  # the same pairs here and beside
    monkeypatch.setattr("optimizer.coupled.rows.NEAR", 10.0)
    scene, points = case
    here = look(scene, points, {})
    assert len(here.rows.values) > 300
    close = total = 0
    for index in range(2):
        for axis in range(4):
            plus, minus = (look(scene, moved(scene, points, index, axis, s * STEP), {}) for s in (1.0, -1.0))
            expected = matched(plus.rows, minus.rows, here.rows) / (2.0 * STEP)
            slopes = here.rows.gradients[:, 4 * index + axis]
            fine = np.abs(slopes - expected) < 5e-3
            close, total = close + int(np.sum(fine)), total + len(fine)
    assert close > 0.97 * total  # the rest are pairs whose nearest points jump


def matched(plus, minus, here):
    """Differences of the same rows; the order is by distance, so rows are told apart by their values."""
    assert len(plus.values) == len(minus.values) == len(here.values)
    contact = np.argsort(here.values, kind="stable")
    difference = np.empty(len(here.values))
    difference[contact] = np.sort(plus.values) - np.sort(minus.values)
    return difference


def test_only_the_nearest_pairs_get_rows_and_lack_is_the_worst_of_them(case):
    scene, points = case
    here = look(scene, points, {})
    assert len(here.rows.values) <= MOST_ROWS + 2 * len(scene.cell.arms) + 100
    assert here.lack == pytest.approx(max(here.rows.required - here.rows.values))
    assert here.lack >= scene.contact_lacks([points])[0] - 1e-9


def test_cushions_raise_what_is_required(case):
    scene, points = case
    kinds = set(scene.model.kinds)
    plain, soft = look(scene, points, {}), look(scene, points, dict.fromkeys(kinds, 0.01))
    assert np.max(soft.rows.required - plain.rows.required) == pytest.approx(0.01)


def test_redundant_arms_bring_their_joints_as_unknowns():
    cell = Cell(Task(np.tile(np.eye(4), (3, 1, 1))), (make_arm("iiwa14", "a"), make_arm("puma560", "b")))
    columns = Columns.of(cell)
    assert columns.count == 8 + 3 * 7
    assert columns.first_joint == (8, None)
