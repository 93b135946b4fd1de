"""What an arm on a linear axis can do from a base: places of the carriage, and all branches of the arm from each.

The arm by itself has a closed form, so nothing has to be iterated: every pose has its postures from every place of the
carriage. For one base that is as good as a search over all paths, but for the distance of the places.
"""

from __future__ import annotations

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.sampling import even_points
from duocell.models.kinematics.branches import solve_branches
from duocell.models.kinematics.closed_form import ClosedForm
from duocell.models.kinematics.nominal import posture_form
from duocell.optimizer.single_arm.redundant.unreduced_problem import UnreducedProblem, seen_from_bases

NEARLY = 2e-3
"""m that a branch may lack: what comes after brings it onto the task."""


def carried_form(problem: UnreducedProblem) -> ClosedForm | None:
    """The closed form of the arm on the carriage, or of the drawing of it; None for other arms."""
    carried = problem.arm.robot.carried
    return None if carried is None else posture_form(carried)


def carriage_nodes(problem: UnreducedProblem, form: ClosedForm, base: Floats, count: int) -> list[Floats]:
    """Postures (n, k_j) of every pose from one base (4,), for ``count`` places of the carriage; angles modulo 2π."""
    robot = problem.arm.robot
    columns, positions = seen_from_bases(problem, base[None])
    start = robot.joint_placements[0]
    places = np.linspace(problem.lower[0], problem.upper[0], count)
    along = places[:, None, None] * robot.joint_axes[0]
    rotations = start[:3, :3].T @ columns.transpose(2, 1, 0)
    found = solve_branches(form, rotations, (positions.T - start[:3, 3]) @ start[:3, :3] - along)
    shape = found.missing.shape  # 8, places, poses
    joints = np.concatenate([np.broadcast_to(places[:, None], shape)[None], found.joints]).reshape(
        robot.dof, -1, shape[2]
    )
    reached = found.missing.reshape(-1, shape[2]) < NEARLY
    return [joints[:, reached[:, j], j] for j in range(shape[2])]


def spread_bases(problem: UnreducedProblem, count: int, seed: int) -> Floats:
    """(K, 4) bases spread over the region; the one there is where it is fixed."""
    low, high = problem.base_lower.copy(), problem.base_upper.copy()
    if problem.arm.base.yaw_free:
        low[3], high[3] = -np.pi, np.pi
    points = even_points(4, count if len(problem.free) else 1, seed)
    bases: Floats = low + points * (high - low)
    return bases
