"""Search nets of arms without a reduced problem: paths are real ones, and the freedom to place them is used."""

from __future__ import annotations

import numpy as np
import pytest

from models.pose import rotation_x
from optimizer.box import search_box
from optimizer.continuation import continue_paths
from optimizer.general import different, screen_general
from optimizer.layers import LayeredPath
from tests.support.answers import reached
from tests.support.tasks import possible

CASES = [("iiwa14", np.eye(3)), ("fanuc_crx10ia", np.eye(3)), ("yumi_left", np.eye(3)), ("iiwa14", rotation_x(2.0))]


def real(task, path: LayeredPath) -> None:
    """A path stands in its region and reaches every pose, or says by how much it breaks a limit."""
    arm, bounds = task.arm, task.arm.base.bounds
    assert np.all(path.position >= bounds[:3, 0] - 1e-9)
    assert np.all(path.position <= bounds[:3, 1] + 1e-9)
    assert bounds[3, 0] - 1e-9 <= path.yaw <= bounds[3, 1] + 1e-9
    for pose, q in zip(task.cell.task.poses, path.joints, strict=True):
        assert np.abs(reached(arm, path.position, path.yaw, q) - pose).max() < 1e-3
    out = np.maximum(arm.lower - path.joints.min(0), 0) + np.maximum(path.joints.max(0) - arm.upper, 0)
    step = np.abs(np.diff(path.joints, axis=0)).max()
    assert path.violation == pytest.approx(out.sum() + max(step - task.cell.max_joint_step, 0.0), abs=1e-8)
    assert path.objective == pytest.approx(np.sum(arm.weights * (path.joints - arm.reference) ** 2))


@pytest.mark.parametrize(("name", "mount"), CASES, ids=lambda v: v if isinstance(v, str) else "")
def test_paths_reach_every_pose_and_come_in_order(name, mount):
    task = possible(name, np.random.default_rng(2), poses=4, step=0.06, half=(0.2, 0.2, 0.0, 0.5), mount=mount)
    found = screen_general(task.cell, task.arm, search_box(task.cell, task.arm), 0)
    whole = [path for path in found.paths if len(path.joints)]
    assert any(path.violation == 0.0 for path in whole)
    for path in whole:
        real(task, path)
    usable = [path.objective for path in whole if path.violation == 0.0]
    assert [path.objective for path in whole[: len(usable)]] == sorted(usable)
    assert found.evaluated > 0


def test_continued_paths_reach_every_pose_and_are_repeatable():
    task = possible("franka_panda", np.random.default_rng(3), poses=6, step=0.05, half=(0.3, 0.3, 0.1, np.pi))
    area = np.concatenate([search_box(task.cell, task.arm), [[0.0, 0.0]]])
    first, second = (continue_paths(task.cell, task.arm, area, 5, 64) for _ in range(2))
    assert len(first) > 5
    for a, b in zip(first, second, strict=True):
        real(task, a)
        assert np.array_equal(a.joints, b.joints)


def test_like_paths_count_once():
    def path(x: float, q: float) -> LayeredPath:
        return LayeredPath(np.array([x, 0.0, 0.0]), 0.0, np.full((3, 7), q), 1.0, 0.0)

    a, near, far, bent = path(0.0, 0.0), path(0.05, 0.1), path(0.5, 0.0), path(0.0, 1.0)
    assert different([a, near, far, bent]) == [a, far, bent]
