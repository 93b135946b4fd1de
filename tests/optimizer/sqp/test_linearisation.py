"""Rows of a layout against what really happens when its unknowns change."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from duocell.models.base.arrays import Floats, Ints
from duocell.models.cell.coupling import Distance, Mirror
from duocell.models.cell.floor import Floor
from duocell.models.cell.surroundings import Clearances
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.sqp.linearisation import linearise
from duocell.optimizer.sqp.manifold import Unknowns, move
from duocell.optimizer.verification.scene import Scene
from tests.support.given.cells import beam_pair
from tests.support.given.witness import signs_at
from tests.support.present import present

STEP = 1e-5


def scene_of(robot: str = "ur10e", count: int = 4) -> tuple[Scene, list[ArmSolution]]:
    """Two arms with everything that makes rows, and a layout of theirs."""
    made = beam_pair(robot, count=count, shift=(0.25, 0.0, 0.1))
    square = np.array([[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]])
    hole = np.array([[-0.2, 0.2], [0.2, 0.2], [0.2, 0.5], [-0.2, 0.5]])
    around = replace(
        made.surroundings, floor=Floor(square, (hole,), 0.1), clearances=Clearances(0.4, 0.2, 0.2, None, 0.05)
    )
    points = []
    for arm, base, q in zip(made.cell.arms, made.bases, made.joints, strict=True):
        yaw = float(np.arctan2(base[1, 0], base[0, 0]))
        points.append(ArmSolution(base[:3, 3], yaw, q, signs_at(arm.robot, q[0])))
    couplings = (Distance((0, 1), 0.5, 2.0), Mirror((0, 1), (0.0, 0.0), np.pi / 2))
    arms = tuple(replace(arm, min_conditioning=0.02) for arm in made.cell.arms)
    cell = replace(made.cell, arms=arms, surroundings=around, couplings=couplings, max_joint_step=0.6)
    return Scene.of(cell), points


@pytest.fixture(scope="module")
def case() -> tuple[Scene, list[ArmSolution]]:
    return scene_of()


def agreement(scene: Scene, points: list[ArmSolution], order: Callable[[Floats], Ints]) -> tuple[int, float]:
    """Number of slopes compared, and the share of them that agree with differences of the values.

    ``order`` puts the values of a linearisation into an order in which rows can be told apart beside it.
    """
    unknowns = Unknowns.of(scene.cell)
    here = linearise(scene, unknowns, points, {})
    slopes = here.rows.gradients[order(here.rows.values)]
    fine = []
    for column in range(unknowns.count):
        step = STEP * np.eye(unknowns.count)[column]
        sides = [move(scene.cell, points, here.along, unknowns, sign * step)[0] for sign in (1.0, -1.0)]
        values = [linearise(scene, unknowns, side, {}).rows.values for side in sides]
        plus, minus = (v[order(v)] for v in values)
        expected = (plus - minus) / (2.0 * STEP)
        fine.append(np.abs(slopes[:, column] - expected) < 5e-3 * np.maximum(1.0, np.abs(expected)))
    return len(fine) * len(fine[0]), float(np.mean(fine))


def test_slopes_of_joints_floor_and_couplings_are_those_of_the_values(
    case: tuple[Scene, list[ArmSolution]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("duocell.optimizer.sqp.joint_rows.NEAR", 50.0)  # the same rows here and beside
    scene, points = case
    count, share = agreement(replace(scene, model=None), points, lambda values: np.arange(len(values)))
    assert count > 1000
    assert share == 1.0


def test_slopes_of_distances_are_those_of_the_values(
    case: tuple[Scene, list[ArmSolution]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("duocell.optimizer.sqp.cell_rows.NEAR", 50.0)
    monkeypatch.setattr("duocell.optimizer.sqp.cell_rows.MOST_ROWS", 10_000)
    monkeypatch.setattr("duocell.optimizer.sqp.linearisation.add_joint_rows", lambda *given: None)
    scene, points = case
    count, share = agreement(scene, points, lambda values: np.argsort(values, kind="stable"))
    assert count > 5000
    assert share > 0.95  # the rest are pairs whose nearest points jump, and rows that change places


def test_violation_is_the_worst_of_all(case: tuple[Scene, list[ArmSolution]]) -> None:
    scene, points = case
    here = linearise(scene, Unknowns.of(scene.cell), points, {})
    assert here.followed
    assert here.violation == pytest.approx(max(here.rows.required - here.rows.values))
    assert here.violation >= scene.contact_violations([points])[0] - 1e-9
    assert here.violation >= scene.tie_violation(points) - 1e-9
    assert here.violation >= scene.floor_violation(points) - 1e-9


def test_margins_raise_what_is_required(case: tuple[Scene, list[ArmSolution]]) -> None:
    scene, points = case
    unknowns = Unknowns.of(scene.cell)
    plain = linearise(scene, unknowns, points, {})
    soft = linearise(scene, unknowns, points, dict.fromkeys(present(scene.model).kinds, 0.01))
    raised = soft.rows.required - plain.rows.required
    assert np.max(raised) == pytest.approx(0.01)
    assert set(np.round(raised, 12)) == {0.0, 0.01}
