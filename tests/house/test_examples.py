"""Every example in examples/ is a request that the service accepts and the optimizer solves."""

import json
from dataclasses import replace
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from bench.judges.dense_check import judge
from duocell.models.base.pose import rotation_angle
from duocell.models.cell.surroundings import Clearances
from duocell.optimizer.optimize import optimize
from duocell.optimizer.results.layout import Layout
from duocell.service.requests.convert import cell_of, settings_of
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate

EXAMPLES = sorted((Path(__file__).parents[2] / "examples").glob("*.json"))


def request(path: Path) -> LayoutRequest:
    return validate(LayoutRequest, json.loads(path.read_text()))


@lru_cache
def solved(path: Path) -> Layout:
    return optimize(cell_of(request(path)), settings_of(request(path), 60.0))


def example(stem: str) -> Path:
    return EXAMPLES[[path.stem for path in EXAMPLES].index(stem)]


def test_the_examples_of_the_readme_are_there() -> None:
    named = {"line.json", "arc.json", "beam_ur10e.json", "family.json", "beam_cell.json"}
    assert {path.name for path in EXAMPLES} >= named


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_solved_and_verified(path: Path) -> None:
    cell = cell_of(request(path))
    layout = solved(path)
    assert layout.usable
    assert layout.search.ended
    assert [placement.arm for placement in layout.placements] == [arm.name for arm in cell.arms]
    assert layout.verification is not None
    assert layout.verification.limits_respected
    assert layout.verification.max_position_error < 1e-6
    for arm, placement in zip(cell.arms, layout.placements, strict=True):
        assert placement.minimum_conditioning >= (arm.min_conditioning or 0.0)


def test_the_arc_turns_the_object_by_a_quarter_on_a_radius_of_900_mm() -> None:
    cell = cell_of(request(example("arc")))
    first, last = cell.task.poses[[0, -1], :3, :3]
    assert np.isclose(rotation_angle(first.T @ last), np.pi / 2)
    assert np.allclose(np.linalg.norm(cell.task.poses[:, :3, 3] - [0.9, 1.1, 0.1], axis=1), 0.9)


def test_the_beam_is_carried_a_stretch_with_a_quarter_turn() -> None:
    cell = cell_of(request(example("beam_ur10e")))
    poses = cell.task.poses
    assert {arm.robot.name for arm in cell.arms} == {"ur10e"}
    assert np.allclose(poses[-1, :2, 3] - poses[0, :2, 3], [0.8, 0.0])
    assert np.isclose(rotation_angle(poses[0, :3, :3].T @ poses[-1, :3, :3]), np.pi / 2)
    grasps = [arm.grasp[:3, 3] for arm in cell.arms]
    assert 0.9 < np.linalg.norm(grasps[0] - grasps[1]) < 1.2  # a beam of 1.2 m, held near its ends


@pytest.mark.parametrize("stem", ["beam_cell", "mirror_cell"])
def test_cells_are_clean_under_the_dense_check(stem: str) -> None:
    verdict = judge(cell_of(request(example(stem))), solved(example(stem)))
    assert verdict.faults == []
    assert set(verdict.nearest) == {"arm_arm", "arm_part", "arm_obstacle", "part_obstacle", "self"}


def test_the_beam_cell_without_clearances_is_better_and_collides() -> None:
    cell = cell_of(request(example("beam_cell")))
    heedless = replace(cell, surroundings=replace(cell.surroundings, clearances=Clearances()))
    layout, careful = optimize(heedless), solved(example("beam_cell"))
    assert layout.objective is not None
    assert careful.objective is not None
    assert layout.objective < careful.objective < 1.05 * layout.objective
    nearest = judge(cell, layout, 0.01, 0.05).nearest["arm_obstacle"]
    assert nearest.distance < -0.03
    assert "portal post" in nearest.second
