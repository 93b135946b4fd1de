import numpy as np
import pytest
from numpy.typing import ArrayLike

from duocell.models.base.pose import transform
from duocell.models.catalogue.catalogue import robot
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.robot.arm import Arm, BaseRegion, Interval, equal_weights
from duocell.optimizer.baselines.reach import reach_range
from duocell.optimizer.baselines.starts import LEFT, RIGHT, source_start
from tests.support.given.arms import form_of

ANYWHERE = Interval(-5.0, 5.0)
ON_THE_FLOOR = BaseRegion(ANYWHERE, ANYWHERE, Interval(0.0, 0.0))


def _cell(points: ArrayLike, region: BaseRegion = ON_THE_FLOOR) -> Cell:
    puma = robot("puma560")
    arm = Arm(
        "main",
        puma,
        np.eye(4),
        np.eye(4),
        region,
        puma.lower,
        puma.upper,
        puma.reference,
        equal_weights(puma.lower, puma.upper),
    )
    return Cell(Task(transform(np.eye(3), np.array(points, dtype=float))), (arm,))


def test_starts_of_example_one() -> None:
    """Printed starts: (481.1, 978.6) mm at -45° and (1347, 71.3) mm at 135°, about a path along (0.724, 0.690)."""
    middle, along = np.array([0.914, 0.525, 0.1]), np.array([0.724, 0.690, 0.0])
    cell = _cell([middle - 0.25 * along, middle + 0.25 * along])
    main, follower = (source_start(cell, cell.arms[0], side) for side in (LEFT, RIGHT))
    assert main[:2] == pytest.approx([0.4811, 0.9786], abs=0.015)
    assert follower[:2] == pytest.approx([1.347, 0.0713], abs=0.015)
    assert np.degrees([main[3], follower[3]]) == pytest.approx([-45.0, 135.0], abs=2.0)


def test_the_base_looks_at_the_middle_of_the_path_from_its_bisector() -> None:
    points = [[0.2, -0.3, 0.5], [0.9, 0.4, 0.6], [0.5, 0.8, 0.3]]
    cell = _cell(points)
    middle = 0.5 * (np.array(points[0]) + points[-1])[:2]
    for side in (LEFT, RIGHT):
        x, y, z, yaw = source_start(cell, cell.arms[0], side)
        away = middle - [x, y]
        assert np.linalg.norm(away) == pytest.approx(
            0.5 * sum(reach_range(robot("puma560"), form_of(robot("puma560"))))
        )
        assert away / np.linalg.norm(away) == pytest.approx([np.cos(yaw), np.sin(yaw)])
        assert away @ (np.array(points[-1]) - points[0])[:2] == pytest.approx(0.0, abs=1e-12)
        assert z == 0.0


def test_fixed_components_are_kept_and_a_free_height_starts_in_the_middle() -> None:
    region = BaseRegion(Interval(0.3, 0.3), ANYWHERE, Interval(0.2, 0.8), Interval(1.0, 1.5))
    start = source_start(_cell([[0, 0, 0], [1, 0, 0]], region), _cell([[0, 0, 0], [1, 0, 0]], region).arms[0], RIGHT)
    assert (start[0], start[2]) == (0.3, 0.5)
    assert start[3] == pytest.approx(1.5)  # faces +y, 90°, as far as allowed


@pytest.mark.parametrize("points", [[[0, 0, 0], [1, 0, 0.2], [0, 0, 0]], [[0, 0, 0], [0, 0, 1]]])
def test_closed_and_vertical_paths_have_starts_too(points: list[list[float]]) -> None:
    cell = _cell(points)
    left, right = (source_start(cell, cell.arms[0], side) for side in (LEFT, RIGHT))
    assert np.isfinite(left).all()
    assert np.linalg.norm(left[:2] - right[:2]) > 1.0
