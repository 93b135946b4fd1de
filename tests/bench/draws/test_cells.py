"""The real cells are what they are said to be, and always the same."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from bench.draws.cell_draw import PAIRS
from bench.draws.cells import BLOCKED, CELLS, beam_cell, real_cell
from bench.judges.dense_check import dense_check
from duocell.models.cell.cell import Cell
from duocell.models.geometry.shapes import Body, Shape
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate
from tests.support.present import present


def bodies(cell: Cell) -> list[tuple[str, type[Shape], list[list[float]]]]:
    return [(body.name, type(body.shape), body.pose.tolist()) for body in cell.surroundings.obstacles]


@pytest.mark.parametrize("seed", [79, 43])
def test_a_cell_is_always_the_same(seed: int) -> None:
    first, again = real_cell(seed), real_cell.__wrapped__(seed)
    assert bodies(first.cell) == bodies(again.cell)
    assert (first.cell.task.poses == again.cell.task.poses).all()
    for mine, theirs in zip(first.cell.arms, again.cell.arms, strict=True):
        assert (mine.base.bounds == theirs.base.bounds).all()
        assert (mine.grasp == theirs.grasp).all()
    if first.known is not None:
        assert (first.known.stands == present(again.known).stands).all()


def test_cells_are_what_is_promised() -> None:
    cells = [real_cell(seed) for seed in (37, 43, 45, 53, 79, 91)]  # quickly made ones
    assert [cell.kind for cell in cells] == ["cluttered", "blocked", "open", "blocked", "open", "open"]
    assert (cells[1].why, cells[3].why) == (BLOCKED[4], BLOCKED[0])
    for cell in cells:
        assert len(cell.cell.arms) == 2
        assert 3 <= len(cell.cell.surroundings.obstacles) <= 8
        assert 5 <= len(cell.cell.task) <= 20
        assert cell.cell.surroundings.part is not None
        assert cell.cell.surroundings.clearances.arm_arm
        assert (cell.known is not None) == (cell.kind == "open")
    assert len({len(cell.cell.task) for cell in cells}) > 3
    assert CELLS == 100
    assert {name for pair in PAIRS for name in pair} == {
        *("puma560", "ur5e", "ur10e", "kr6_r900", "kr210_r2700", "lrmate200id", "fanuc_m710ic")
    }


@pytest.mark.parametrize("seed", [79, 91])
def test_known_layouts_of_open_cells_are_clean(seed: int) -> None:
    real = real_cell(seed)
    assert dense_check(real.cell, present(real.known).stands, list(present(real.known).joints), 5e-3, 0.02).faults == []


def test_the_beam_cell_is_the_example() -> None:
    text = (Path(__file__).parents[3] / "examples" / "beam_cell.json").read_text()
    sent = cell_of(validate(LayoutRequest, json.loads(text)))
    mine = beam_cell()
    assert sent.task.poses == pytest.approx(mine.task.poses, abs=1e-12)
    assert sent.surroundings.clearances == mine.surroundings.clearances
    assert sent.max_joint_step == mine.max_joint_step
    for theirs, arm in zip(sent.arms, mine.arms, strict=True):
        assert theirs.name == arm.name
        assert theirs.grasp == pytest.approx(arm.grasp, abs=1e-12)
        assert theirs.tool == pytest.approx(arm.tool, abs=1e-12)
        assert theirs.base.bounds == pytest.approx(arm.base.bounds)
        assert np.allclose(theirs.weights, arm.weights)
        brought, own = sent.surroundings.of(arm.name), mine.surroundings.of(arm.name)
        assert present(brought.pedestal).height == present(own.pedestal).height
        assert present(brought.pedestal).footprint.corners == pytest.approx(present(own.pedestal).footprint.corners)
        same_bodies(brought.tool, own.tool)
    same_bodies(sent.surroundings.obstacles, mine.surroundings.obstacles)
    same_bodies(present(sent.surroundings.part).bodies, present(mine.surroundings.part).bodies)
    assert present(sent.surroundings.part).grasp_zone == present(mine.surroundings.part).grasp_zone
    assert present(sent.surroundings.floor).allowed == pytest.approx(present(mine.surroundings.floor).allowed)
    for pit, polygon in zip(
        present(sent.surroundings.floor).forbidden, present(mine.surroundings.floor).forbidden, strict=True
    ):
        assert pit == pytest.approx(polygon)
    assert present(sent.surroundings.floor).margin == present(mine.surroundings.floor).margin


def same_bodies(first: tuple[Body, ...], second: tuple[Body, ...]) -> None:
    for one, other in zip(first, second, strict=True):
        assert one.pose == pytest.approx(other.pose, abs=1e-12)
        assert type(one.shape) is type(other.shape)
        for name in ("size", "radius", "length"):
            if hasattr(one.shape, name):
                assert getattr(one.shape, name) == pytest.approx(getattr(other.shape, name))
