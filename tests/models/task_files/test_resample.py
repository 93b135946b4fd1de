"""Poses that are left out stay within the errors asked for, as scipy interpolates between those that are kept."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation, Slerp

from duocell.models.task_files.reading import Resampling, read_task_file
from duocell.models.task_files.resample import chosen_poses, largest_errors


def wavy(count: int) -> tuple[np.ndarray, Rotation]:
    """A smooth way that turns."""
    t = np.linspace(0.0, 3.0, count)
    positions = np.column_stack([t, 0.2 * np.sin(2.0 * t), 0.1 * np.cos(3.0 * t)])
    return positions, Rotation.from_euler("ZYX", np.column_stack([0.5 * np.sin(t), 0.4 * np.cos(2.0 * t), 0.3 * t]))


@pytest.mark.parametrize(("position", "rotation"), [(1e-3, 1.0), (1.0, 1e-2), (1e-3, 1e-2), (1e-5, 1e-4)])
def test_every_pose_is_within_both_errors_of_the_way_that_is_kept(position: float, rotation: float) -> None:
    positions, turns = wavy(400)
    kept = chosen_poses(positions, turns.as_matrix(), position, rotation)
    assert kept[0] == 0
    assert kept[-1] == 399
    assert 2 < len(kept) < 400
    # The share of the way, measured here on its own: scipy interpolates at it.
    steps = np.linalg.norm(np.diff(positions, axis=0), axis=1) / position
    steps += (turns[:-1].inv() * turns[1:]).magnitude() / rotation
    way = np.concatenate([[0.0], np.cumsum(steps)])
    straight = np.column_stack([np.interp(way, way[kept], positions[kept, axis]) for axis in range(3)])
    away = np.linalg.norm(straight - positions, axis=1)
    turned = (Slerp(way[kept], turns[kept])(way).inv() * turns).magnitude()
    assert away.max() <= position * (1.0 + 1e-9)
    assert turned.max() <= rotation * (1.0 + 1e-9)
    found = largest_errors(positions, turns.as_matrix(), kept, position, rotation)
    np.testing.assert_allclose(found, [away.max(), turned.max()], rtol=1e-6, atol=1e-9)


def test_a_straight_line_is_its_ends_and_corners_stay() -> None:
    positions = np.vstack([np.linspace([0, 0, 0], [1, 0, 0], 50), np.linspace([1, 0, 0], [1, 1, 0], 50)[1:]])
    assert chosen_poses(positions, np.tile(np.eye(3), (99, 1, 1)), 1e-6, 1e-6) == [0, 49, 98]


def test_a_part_that_turns_on_the_spot_keeps_its_turns() -> None:
    angles = np.concatenate([np.linspace(0.0, 1.0, 20), np.linspace(1.0, 0.0, 20)[1:]])
    turns = Rotation.from_rotvec(angles[:, None] * np.array([0.0, 0.0, 1.0]))
    kept = chosen_poses(np.zeros((39, 3)), turns.as_matrix(), 1e-3, 1e-3)
    assert kept == [0, 19, 38]


def test_a_part_at_rest_is_two_poses() -> None:
    assert chosen_poses(np.zeros((9, 3)), np.tile(np.eye(3), (9, 1, 1)), 1e-3, 1e-3) == [0, 8]


def test_a_file_is_resampled() -> None:
    positions, turns = wavy(300)
    rows = [",".join(map(str, row)) for row in np.hstack([positions, turns.as_quat()]).tolist()]
    text = "x_m,y_m,z_m,qx,qy,qz,qw\n" + "\n".join(rows)
    found = read_task_file(text.encode(), resampling=Resampling(1e-3, 1e-2))
    assert found.read == 300
    assert 2 < len(found.poses) < 100
    assert 0.0 < found.position_error <= 1e-3
    assert 0.0 < found.rotation_error <= 1e-2
