"""Points of links stay within the ball, and within the first-order expansion, that a box of bases leaves them."""

from __future__ import annotations

import numpy as np
import pytest

from duocell.models.base.arrays import Bools, Floats
from duocell.models.kinematics.link_frames import link_frames
from duocell.optimizer.certificate.bounds.angles.joints import Kinematics
from duocell.optimizer.certificate.bounds.angles.targets import Targets
from duocell.optimizer.certificate.bounds.boxes import Boxes
from duocell.optimizer.certificate.exclusion.motion import motion
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed
from tests.support.given.boxes import boxes_around, members, random_problem


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("name", ["puma560", "ur10e", "irb6700", "oblique"])
def test_points_stay_where_they_may_be(name: str, seed: int) -> None:
    rng = np.random.default_rng([seed, 11])
    boxes = None
    while boxes is None:  # some draws leave nothing within reach
        problem = random_problem(name, rng, mounted=seed % 2 == 1)
        boxes = boxes_around(problem, 30, rng)
    boxes = boxes[np.max(boxes.half, axis=1) < 0.1]
    moved = motion(problem.arm, Kinematics.of(Targets.of(problem)), _targets(problem), boxes)
    count, m = moved.joints.shape[:2]
    box, pose = (index.ravel() for index in np.indices((count, m)))
    seen = 0
    for number in range(6):
        places = members(boxes, rng, number)
        frames, usable = _frames(problem, boxes, places)
        use = np.repeat(usable, m)
        for link in range(1, 7):
            own = 0.3 * rng.normal(size=3)
            points, then = (
                f.reshape(-1, 4, 4)[:, :3] @ [*own, 1.0] for f in (moved.frames[:, :, link], frames[:, :, link])
            )
            ball, gradient, rest = moved.linear(box, pose, points, np.full(len(box), link))
            assert np.all(np.linalg.norm(then - points, axis=1)[use] <= ball[use] + 1e-9)
            step = (places - boxes.centre)[:, : moved.half.shape[1]][box]
            off = np.linalg.norm(then - points - np.einsum("qaK,qK->qa", gradient, step), axis=1)
            known = use & np.isfinite(rest)
            assert np.all(off[known] <= rest[known] + 1e-9)
            seen += int(known.sum())
            if link == 6:
                assert np.all(ball[use & (moved.error[box, pose] < 1e-9)] < 1e-8)  # the task holds it
    assert seen or not np.any(moved.regular)


def _targets(problem: ReducedProblem) -> Floats:
    targets = np.tile(np.eye(4), (len(problem.positions), 1, 1))
    targets[:, :3, :3] = problem.arm.mount @ problem.rotations
    targets[:, :3, 3] = problem.positions
    return targets


def _frames(problem: ReducedProblem, boxes: Boxes, places: Floats) -> tuple[Floats, Bools]:
    """(N, m, 7, 4, 4) links with bases at places; (N,) True where every pose is reached."""
    paths = evaluate_signed(problem, places, boxes.signs)
    joints = np.moveaxis(paths.joints[:, 0], 0, -1)
    bases = problem.arm.base_in_world(places, paths.yaw[0])
    links = link_frames(problem.arm.robot, joints.reshape(-1, 6)).reshape(*joints.shape[:2], 7, 4, 4)
    return bases[:, None, None] @ links, paths.missing[0] == 0.0
