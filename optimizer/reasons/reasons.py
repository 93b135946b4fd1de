"""Why an arm cannot do its part of the task: which poses, which joints, by how much."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.batch_kinematics import conditioning_of
from duocell.models.kinematics.branches import solve_signed
from duocell.models.kinematics.chain import chain_of
from duocell.models.kinematics.kinematics import characteristic_length
from duocell.models.kinematics.wrist_singularity import wrist_shortfall
from duocell.models.robot.arm import SINGULAR_WRIST, Arm
from duocell.models.robot.joint import in_words
from duocell.optimizer.reduction.box import reach_windows, search_box
from duocell.optimizer.reduction.layers import LayeredPath
from duocell.optimizer.reduction.reduced import ReducedProblem, evaluate_signed, reduced_problem, seen_from
from duocell.optimizer.reduction.screening import Candidate, screen
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.results.proof import InfeasibilityCause

FAR_OFF = 5.0
"""m; no arm, no tool and no shift of a base makes up for more: something is in other units or another frame."""
MOST_POSES = 16
"""Poses of a long task that are looked at one by one."""


def explain_reach(cell: Cell, arm: Arm, first: int = 0) -> tuple[Reason, ...]:
    """Reasons where no base of the region reaches every pose, whatever the joint limits; certain.

    Args:
        cell: the task.
        arm: the arm.
        first: number of the cell's first pose, for a segment that is looked at by itself.
    """
    windows = reach_windows(cell, arm)
    region = arm.base.bounds[:3]
    short = np.maximum(windows[:, :, 0] - region[:, 1], region[:, 0] - windows[:, :, 1])
    alone = first + np.flatnonzero(np.max(short, axis=1) > 0.0)
    if len(alone):
        missing = float(np.max(short))
        remedy = _remedy(missing, "enlarge the base region towards the task or choose a longer robot or tool")
        return (
            Reason(
                arm.name,
                "out_of_reach",
                tuple(int(j) for j in alone),
                f"{arm.name}: {_poses(alone)} out of reach from every allowed base, at least {missing:.3f} m are "
                f"missing; {remedy}",
                amount=missing,
                unit="m",
            ),
        )
    low, high = np.max(windows[:, :, 0], axis=0), np.min(windows[:, :, 1], axis=0)
    low, high = np.maximum(low, region[:, 0]), np.minimum(high, region[:, 1])
    axis = int(np.argmax(low - high))
    pair = (first + int(np.argmax(windows[:, axis, 0])), first + int(np.argmin(windows[:, axis, 1])))
    missing = float((low - high)[axis])
    remedy = _remedy(missing, "shorten the path, enlarge the base region or choose a longer robot")
    return (
        Reason(
            arm.name,
            "out_of_reach",
            tuple(sorted(set(pair))),
            f"{arm.name}: no allowed base reaches poses {pair[0]} and {pair[1]} both: along {'xyz'[axis]} at least "
            f"{missing:.3f} m are missing; {remedy}",
            amount=missing,
            unit="m",
        ),
    )


def _remedy(missing: float, usual: str) -> str:
    """What helps where so many metres are missing."""
    if missing <= FAR_OFF:
        return usual
    return (
        "no robot is so long: see that every length is in metres, that the grasp is given in the frame of the object, "
        "and that the base region lies by the task"
    )


def explain_reduced(
    cell: Cell, problem: ReducedProblem, box: Floats, candidates: list[Candidate], seed: int, first: int = 0
) -> tuple[Reason, ...]:
    """Reasons for an arm with a reduced problem: poses that are impossible alone, else what the nearest path breaks.

    A task sequence is explained by the segments that are impossible alone, else by that.
    """
    if len(problem.starts) > 1:
        return explain_segments(cell, problem.arm, seed)
    if problem.arm.min_conditioning is not None:
        blocked = _conditioning(cell, problem, box, seed)
        if blocked:
            return blocked
    alone = _impossible_alone(problem, box, seed, first)
    if alone:
        return tuple(alone)
    if not candidates:
        return (_excluded(problem.arm),)
    nearest = min(candidates, key=lambda c: c.violation)
    if not np.isfinite(nearest.violation):
        return (_excluded(problem.arm),)
    signs = np.array([nearest.signs])
    paths = evaluate_signed(problem, nearest.position[None, :], signs)
    seen = solve_signed(problem.form, problem.rotations, seen_from(problem, nearest.position[None]), signs)
    reasons = explain_path(cell, problem.arm, paths.joints[:, 0, 0].T, seen.missing[0, 0], first=first)
    return reasons or (_no_posture(problem.arm),)


def explain_segments(cell: Cell, arm: Arm, seed: int) -> tuple[Reason, ...]:
    """Reasons for a task sequence: those of the segments for which no base is found even if the others are
    forgotten.
    """
    reasons: list[Reason] = []
    for index, segment in enumerate(cell.task.segments):
        alone, own = cell.alone(index), arm.in_segment(index)
        problem, box = reduced_problem(alone, own), search_box(alone, own)
        if np.any(box[:, 0] > box[:, 1]):
            reasons += explain_reach(alone, own, segment.start)
        elif problem is not None:
            seen = screen(problem, box, seed).candidates
            if not any(candidate.violation == 0.0 for candidate in seen):
                reasons += explain_reduced(alone, problem, box, seen, seed, segment.start)
    return tuple(reasons) or (_no_common_base(arm),)


def name_segments(task: Task, reasons: tuple[Reason, ...]) -> tuple[Reason, ...]:
    """Reasons that say which segments of a task sequence their poses belong to; poses are counted through all
    segments.
    """
    if len(task.starts) == 1:
        return reasons
    named = []
    for reason in reasons:
        segments = np.unique(task.segment_of[list(reason.poses)])
        words = ", ".join(task.names[segment] or str(segment) for segment in segments)
        suffix = f" [job{'s' if len(segments) > 1 else ''} {words}]" if len(segments) else ""
        named.append(replace(reason, detail=reason.detail + suffix))
    return tuple(named)


def explain_proof(cell: Cell, arm: Arm, causes: tuple[InfeasibilityCause, ...]) -> tuple[Reason, ...]:
    """What a proof of infeasibility met, the three largest causes; of a task sequence, first which segments are to
    blame.
    """
    reasons = list(explain_segments(cell, arm, 0)) if len(cell.task.starts) > 1 else []
    for cause in causes[:3]:
        joint = None if cause.joint is None else arm.robot.joint_names[cause.joint]
        what = {
            "out_of_reach": "are out of reach",
            "joint_limit": f"need {joint} beyond its limits",
            "joint_step": "cannot be joined without too long a joint step",
            "singularity": f"bring the wrist within {np.degrees(SINGULAR_WRIST):.3f}° of its singularity at {joint}",
            "linear_limit": f"need {linear_names(arm)} beyond its limits",
            "conditioning": f"leave a conditioning below {arm.min_conditioning}",
        }[cause.kind]
        detail = (
            f"{arm.name}: proved impossible from every allowed base in any one posture; {_poses(cause.poses)} "
            f"{what} in {100.0 * cause.share:.0f} % of all places and postures"
        )
        sums = cause.kind == "linear_limit"
        kind, joint = ("joint_limit", linear_names(arm)) if sums else (cause.kind, joint)
        reasons.append(Reason(arm.name, kind, cause.poses, detail, joint))
    return tuple(reasons)


def linear_names(arm: Arm) -> str:
    """The linear limits of an arm, as one name."""
    return " or ".join(arm.bounded_names[arm.dof :])


def explain_general(
    cell: Cell, arm: Arm, paths: list[LayeredPath], unreached: tuple[int, ...] = ()
) -> tuple[Reason, ...]:
    """Reasons for an arm without a reduced problem.

    Args:
        cell: the task. arm: the arm. paths: the nearest that were found.
        unreached: poses that were not reached even by themselves, where there are no paths.
    """
    whole = [path for path in paths if len(path.joints)]
    if not whole:
        unreached = unreached or tuple(range(len(cell.task)))
        return (
            Reason(
                arm.name,
                "out_of_reach",
                unreached,
                f"{arm.name}: no posture was found that reaches {_poses(unreached)} from the best base tried; "
                "enlarge the base region, change the grasp or choose a longer robot",
            ),
        )
    nearest = min(whole, key=lambda path: path.violation)
    return explain_path(cell, arm, nearest.joints, np.zeros(len(nearest.joints))) or (_no_posture(arm),)


def _conditioning(cell: Cell, problem: ReducedProblem, box: Floats, seed: int) -> tuple[Reason, ...]:
    """The reason, if the task is possible as soon as its conditioning is not asked for."""
    arm = problem.arm
    free = reduced_problem(cell, replace(arm, min_conditioning=None))
    usable = [] if free is None else [c for c in screen(free, box, seed).candidates if c.violation == 0.0]
    if free is None or not usable:
        return ()
    paths = evaluate_signed(free, np.array([c.position for c in usable]), np.array([c.signs for c in usable]))
    joints = paths.joints[:, 0].reshape(arm.dof, -1).T
    values = conditioning_of(chain_of(arm.robot), arm.tool, joints, characteristic_length(arm.robot))
    best = float(np.max(np.min(values.reshape(len(usable), -1), axis=1)))
    wanted = arm.min_conditioning
    detail = (
        f"{arm.name}: the task is possible, but no placement with a conditioning of {wanted:g} was found; the best "
        f"seen keeps {best:.3f}; ask for less, or turn the grasp or the task"
    )
    return (Reason(arm.name, "conditioning", (), detail),)


def _impossible_alone(problem: ReducedProblem, box: Floats, seed: int, first: int) -> list[Reason]:
    """One reason per kind for poses that no base found can take, even if the rest of the task is forgotten."""
    arm = problem.arm
    count = len(problem.positions)
    far: dict[int, float] = {}
    stuck: dict[int, float] = {}
    for j in np.unique(np.linspace(0, count - 1, min(count, MOST_POSES)).round().astype(int)):
        single = problem.only(np.array([j])).stricter(np.inf)
        candidates = screen(single, box, seed).candidates
        if not candidates or any(c.violation == 0.0 for c in candidates):
            continue
        nearest = min(candidates, key=lambda c: c.violation)
        missing = float(evaluate_signed(single, nearest.position[None], np.array([nearest.signs])).missing[0, 0])
        (far if missing > 0.0 else stuck)[first + int(j)] = missing or nearest.violation
    reasons = []
    if far:
        worst = max(far.values())
        detail = (
            f"{arm.name}: {_poses(list(far))} out of reach from every base tried, about {worst:.3f} m are missing; "
            "enlarge the region, change the grasp or choose a longer robot"
        )
        reasons.append(Reason(arm.name, "out_of_reach", tuple(far), detail, amount=worst, unit="m"))
    if stuck:
        worst = max(stuck.values())
        detail = (
            f"{arm.name}: {_poses(list(stuck))} within reach, but from every base tried each posture breaks a joint "
            f"limit, at best by up to {np.degrees(worst):.2f}°; turn the grasp, widen the yaw or allow other postures"
        )
        reasons.append(Reason(arm.name, "joint_limit", tuple(stuck), detail, amount=worst, unit="rad"))
    return reasons


def explain_path(
    cell: Cell,
    arm: Arm,
    joints: Floats,
    missing: Floats,
    where: str = "at the nearest placement found",
    first: int = 0,
) -> tuple[Reason, ...]:
    """What a path breaks, largest first within each kind.

    Args:
        cell: step limit.
        arm: the arm.
        joints: (m, n) rad.
        missing: (m,) m by which reach is too short.
        where: words for the placement.
        first: number of the cell's first pose, for a segment that is looked at by itself.
    """
    reasons: list[Reason] = []
    far = first + np.flatnonzero(missing > 0.0)
    if len(far):
        amount = float(np.max(missing))
        detail = f"{arm.name}: {where} {_poses(far)} out of reach by up to {amount:.3f} m"
        reasons.append(Reason(arm.name, "out_of_reach", tuple(map(int, far)), detail, amount=amount, unit="m"))
    beyond = arm.limit_excess(joints)
    for i in np.argsort(-np.max(beyond, axis=0)):
        poses = first + np.flatnonzero(beyond[:, i] > 1e-9)
        if len(poses):
            amount, name, unit = float(np.max(beyond[:, i])), arm.bounded_names[i], arm.bounded_units[i]
            excess = in_words(amount, unit)
            detail = f"{arm.name}: {where} {name} is beyond its limit by up to {excess} at {_poses(poses)}"
            reasons.append(Reason(arm.name, "joint_limit", tuple(map(int, poses)), detail, name, amount, unit))
    reasons += _singular(arm, joints, where, first)
    limits = np.where(cell.task.joined[:, None], cell.step_limits(arm.robot), np.inf)
    steps = np.abs(np.diff(joints, axis=0)) - limits
    for i in np.argsort(-np.max(steps, axis=0, initial=0.0)):
        poses = first + np.flatnonzero(steps[:, i] > 1e-9) + 1
        if len(poses):
            amount, name = float(np.max(steps[:, i])), arm.robot.joint_names[i]
            unit = arm.bounded_units[i]
            move, why = (
                ("turn", "the path passes a singularity") if unit == "rad" else ("go", "the poses are far apart")
            )
            detail = (
                f"{arm.name}: {where} {name} would have to {move} {in_words(amount, unit, 1)} more than max_joint_step "
                f"allows on the way to {_poses(poses)}: {why}; add poses there, or move or turn the task"
            )
            reasons.append(Reason(arm.name, "joint_step", tuple(map(int, poses)), detail, name, amount, unit))
    return tuple(reasons)


def _singular(arm: Arm, joints: Floats, where: str, first: int) -> list[Reason]:
    """The reason, if the wrist is too near to its singularity somewhere."""
    amounts = wrist_shortfall(arm, joints.T[..., None])
    poses = first + np.flatnonzero(amounts > 0.0)
    if not len(poses):
        return []
    detail = (
        f"{arm.name}: {where} the wrist is within {np.degrees(SINGULAR_WRIST):.3f}° of its singularity at "
        f'{_poses(poses)}; move or turn the task or the grasp, or allow singularities ("singularities": "allow")'
    )
    amount, name = float(np.max(amounts)), arm.robot.joint_names[4]
    return [Reason(arm.name, "singularity", tuple(map(int, poses)), detail, name, amount, "rad")]


def _no_posture(arm: Arm) -> Reason:
    detail = (
        f"{arm.name}: every pose can be reached by itself, but no single posture inside all limits was found for the "
        "whole path; split the path, relax the posture or the conditioning asked for, or enlarge the base region"
    )
    return Reason(arm.name, "posture", (), detail)


def _no_common_base(arm: Arm) -> Reason:
    detail = (
        f"{arm.name}: every job can be done by itself, but no base was found that serves all of them in one posture; "
        "enlarge the base region, relax the posture, or give a job another grasp"
    )
    return Reason(arm.name, "jobs", (), detail)


def _excluded(arm: Arm) -> Reason:
    return Reason(arm.name, "posture", (), f"{arm.name}: no branch of {arm.robot.name} has the posture asked for")


def _poses(indices: Floats | list[int] | tuple[int, ...] | np.ndarray) -> str:
    """Indices as text, "pose 3" or "poses 2, 3, 4", shortened to what a person can read."""
    numbers = [int(j) for j in indices]
    if len(numbers) == 1:
        return f"pose {numbers[0]}"
    if len(numbers) > 3 and numbers == list(range(numbers[0], numbers[-1] + 1)):
        return f"poses {numbers[0]} to {numbers[-1]}"
    shown = ", ".join(map(str, numbers[:8])) + (f" and {len(numbers) - 8} more" if len(numbers) > 8 else "")
    return f"poses {shown}"
