"""Where an arm may stand once its couplings with arms already placed are kept: its candidates moved onto them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.coupling import Coupling
from duocell.models.robot.arm import Arm
from duocell.optimizer.coupled.combinations.pool import Member
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed

STEPS = 4
DIFFERENCE = 1e-6
"""m, of the rows' derivatives."""
SAME = 0.04
"""m; places of one posture nearer than about this to each other are tried once."""
AT_ONCE = 2000
"""Places evaluated together."""


def tied(
    arm: Arm,
    couplings: Sequence[Coupling],
    placed: Sequence[tuple[Member, ...]],
    pool: Sequence[Member],
    problem: ReducedProblem | None,
) -> list[tuple[Member, ...]]:
    """Every member of a pool next to every combination of the arms before it.

    Members are moved to the nearest position that keeps the couplings, and get their best path there; their shortfall
    in their surroundings is carried over. Those of arms without a reduced problem stay where they are.

    Args:
        arm: the one to be added. couplings: between it and arms before it. placed: one member per arm before it.
        pool: its candidates. problem: its reduced problem, or None.
    """
    pairs = [(members, member) for members in placed for member in pool]
    if problem is None or not pairs:
        return [(*members, member) for members, member in pairs]
    count = len(placed[0])
    bases = [
        np.array([(*members[a].point.position, members[a].point.yaw) for members, _ in pairs]).T for a in range(count)
    ]
    own = np.array([member.point.position for _, member in pairs])
    yaws = np.array([member.point.yaw for _, member in pairs])
    positions = moved_onto(couplings, bases, own, yaws, arm.base.bounds[:3])
    some = _different(positions, pairs)
    signs = np.array([pairs[i][1].point.signs for i in some])
    grown: list[tuple[Member, ...]] = []
    for at in range(0, len(some), AT_ONCE):
        chunk = some[at : at + AT_ONCE]
        paths = evaluate_signed(problem, positions[chunk], signs[at : at + AT_ONCE])
        for k, i in enumerate(chunk):
            if paths.violation[0, k] == 0.0:
                members, member = pairs[i]
                point = ArmSolution(positions[i], float(paths.yaw[0, k]), paths.joints[:, 0, k].T, member.point.signs)
                grown.append((*members, Member(point, float(paths.objective[0, k]), member.violation)))
    return grown


def _different(positions: Floats, pairs: Sequence[tuple[tuple[Member, ...], Member]]) -> list[int]:
    """Numbers of the pairs that differ in partner, posture or place: ties move many members to one place."""
    seen: set[tuple[object, ...]] = set()
    kept = []
    for i, (cell, (members, member)) in enumerate(zip(np.round(positions / SAME).tolist(), pairs, strict=True)):
        key = (id(members), member.point.signs, *cell)
        if key not in seen:
            seen.add(key)
            kept.append(i)
    return kept


def moved_onto(
    couplings: Sequence[Coupling], bases: Sequence[Floats], positions: Floats, yaws: Floats, region: Floats
) -> Floats:
    """(Q, 3) positions after a few Gauss-Newton steps on the violations of the couplings, inside the region (3, 2)."""
    for _ in range(STEPS):
        violation = tie_violations(couplings, [*bases, np.vstack([positions.T, yaws])])
        slopes = np.stack(
            [
                (tie_violations(couplings, [*bases, np.vstack([(positions + DIFFERENCE * unit).T, yaws])]) - violation)
                / DIFFERENCE
                for unit in np.eye(3)
            ],
            axis=-1,
        )
        step = (np.linalg.pinv(slopes, rcond=1e-6) @ violation[..., None])[..., 0]
        positions = np.clip(positions - step, region[:, 0], region[:, 1])
    return positions


def tie_violations(couplings: Sequence[Coupling], bases: Sequence[Floats]) -> Floats:
    """(..., R) signed distances of the rows' values to their sets, for (4, ...) bases of each arm."""
    columns = []
    for coupling in couplings:
        rows = coupling.rows(bases)
        for value, low, high in zip(rows.values, rows.lower, rows.upper, strict=True):
            columns.append(np.minimum(value - low, 0.0) + np.maximum(value - high, 0.0))
    return np.stack(np.broadcast_arrays(*columns), axis=-1)
