from __future__ import annotations

import numpy as np

from duocell.optimizer.certificate.bounds.boxes import Boxes

ALL = np.ones(8, dtype=bool)


def test_a_grid_covers_the_region_once_per_posture() -> None:
    low, high = np.array([-1.0, 0.5, 0.2]), np.array([1.0, 2.0, 0.2])
    postures = np.array([True, False, False, True, False, False, False, True])
    boxes = Boxes.grid(low, high, 0.3, postures)
    assert set(boxes.posture) == {0, 3, 7}
    area = np.prod(2.0 * boxes.half[:, :2], axis=1)
    for posture in (0, 3, 7):
        assert np.isclose(area[boxes.posture == posture].sum(), 3.0)
    assert np.all(boxes.half[:, 2] == 0.0)
    assert np.all(boxes.centre[:, 2] == 0.2)
    assert np.all(boxes.centre - boxes.half >= low - 1e-12)
    assert np.all(boxes.centre + boxes.half <= high + 1e-12)
    point = np.array([0.31, 1.17, 0.2])
    inside = np.all(np.abs(point - boxes.centre) <= boxes.half, axis=1)
    assert inside.sum() == 3


def test_a_fixed_base_is_one_box_of_no_size() -> None:
    point = np.array([0.3, -0.2, 0.1])
    boxes = Boxes.grid(point, point, 0.1, ALL)
    assert len(boxes) == 8
    assert np.all(boxes.half == 0.0)
    assert np.all(boxes.centre == point)


def test_halves_tile_the_box_and_cut_its_longest_side() -> None:
    boxes = Boxes(
        np.array([[0.0, 0.0, 0.0], [1.0, 2.0, 3.0]]), np.array([[1.0, 2.0, 0.5], [0.3, 0.2, 0.4]]), np.array([1, 6])
    )
    halves = boxes.halved()
    assert halves.posture.tolist() == [1, 6, 1, 6]
    assert halves.half[0].tolist() == [1.0, 1.0, 0.5]
    assert halves.centre[[0, 2], 1].tolist() == [-1.0, 1.0]
    assert np.allclose(halves.half[1], [0.3, 0.2, 0.2])
    assert np.allclose(halves.centre[[1, 3], 2], [2.8, 3.2])
    joined = Boxes.joined([boxes, halves])
    assert len(joined) == 6
    assert joined[2:].half.tolist() == halves.half.tolist()
    assert boxes.sign(0).tolist() == [[1.0], [-1.0]]
