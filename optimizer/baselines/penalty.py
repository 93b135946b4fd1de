"""The source's way to a layout: sequential unconstrained minimisation with penalties.

Interior penalty ``Φ = E - r' Σ 1/g`` (8.27) or ``E - r' Σ log(-g)`` (8.28) with r' shrinking by 0.3 a cycle, exterior
penalty ``Φ = E + r Σ max(0, g)²`` (8.25) with r growing, each Φ minimised by Fletcher-Reeves conjugate gradients. A
baseline to compare with, so built with care: exact gradients, a strong-Wolfe line search, steps out of the domain
backtracked. Ours, and told in trace and notes: the rows of reach and joint steps, and the reach phase for starts
without an inverse-kinematics solution. An infeasible start goes through an exterior phase before the interior one.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import inf
from time import perf_counter

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.pose import inverse, rotation_angle, rotation_z, transform
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.kinematics import characteristic_length, conditioning, flange_poses
from duocell.models.objective.objective import JOINT_AVAILABILITY
from duocell.models.robot.arm import Arm
from duocell.models.robot.posture import ALL_SIGNS, Signs, name_signs
from duocell.optimizer.baselines.gradient import Followed, PostureFunction, paths_at
from duocell.optimizer.baselines.penalty_cycles import Cycles, PenaltySettings
from duocell.optimizer.baselines.penalty_rows import INVERSE_BARRIER, LOG_BARRIER, Barrier, ConstrainedPosture
from duocell.optimizer.baselines.reach_phase import approach
from duocell.optimizer.baselines.starts import LEFT, RIGHT, source_start
from duocell.optimizer.reduction.reduced import ReducedProblem, reduced_problem
from duocell.optimizer.results.layout import Baseline, BaselineArm, PenaltyCycle
from duocell.optimizer.settings import Settings

METHODS: dict[str, Barrier | None] = {
    "interior-penalty": INVERSE_BARRIER,
    "interior-penalty-log": LOG_BARRIER,
    "exterior-penalty": None,
}
"""Names of the methods, and the barrier of the interior ones."""

POSITION_TOLERANCE, ANGLE_TOLERANCE = 1e-6, 1e-6
"""m and rad: what Pinocchio's kinematics may differ from the task."""
LIMIT_TOLERANCE = 1e-9
"""rad and m: what counts as on the limit."""


@dataclass(frozen=True, eq=False, slots=True)
class PenaltyRun:
    """What one method made of one start.

    Attributes:
        start: (4,) x, y, z [m], yaw [rad].
        posture: signs kept.
        placement: (4,) last point. joints: (m, 6) rad there, or None where not every pose is reached.
        objective: E there, or None without joints.
        feasible: True if the path keeps every constraint and Pinocchio's kinematics agree with it.
        trace: every cycle. note: remarks.
    """

    start: Floats
    posture: Signs
    placement: Floats
    joints: Floats | None
    objective: float | None
    feasible: bool
    trace: tuple[PenaltyCycle, ...]
    note: str

    @property
    def evaluations(self) -> int:
        """Of Φ with its gradient, all cycles together."""
        return sum(cycle.evaluations for cycle in self.trace)


def minimise_from(
    problem: ReducedProblem,
    start: Floats,
    posture: Signs | None,
    method: str,
    rules: PenaltySettings | None = None,
    deadline: float = inf,
) -> PenaltyRun:
    """Run one method from one start.

    Args:
        problem: the arm.
        start: (4,) x, y, z [m], yaw [rad]; fixed components hold their fixed values.
        posture: signs to keep, or None for the posture nearest to the reference at the start.
        method: a key of `METHODS`.
        rules: schedule.
        deadline: `time.perf_counter` value at which the method ends with what it has.

    Returns:
        The run; infeasible ones tell where they stopped.
    """
    trace: list[PenaltyCycle] = []
    notes: list[str] = []
    placement, signs = start, nearest_posture(problem, start, posture)
    if signs is None:
        placement, nearest = _reach_phase(problem, start, posture, trace)
        signs = nearest_posture(problem, placement, posture)
        notes.append("no inverse-kinematics solution at the start: reach phase first")
        if signs is None:
            notes.append("it found none either")
            return PenaltyRun(start, nearest, placement, None, None, False, tuple(trace), "; ".join(notes))
    function = PostureFunction(problem, signs)
    path = function.begin(placement)
    if path is None:
        raise AssertionError("the posture was chosen because it reaches every pose from here")
    cycles = Cycles(ConstrainedPosture(function), rules or PenaltySettings(), deadline, trace)
    path = _phases(cycles, path, METHODS[method], notes)
    feasible = cycles.worst(path) <= LIMIT_TOLERANCE and reproduces(problem, path)
    if feasible and not _well_conditioned(problem.arm, path):
        feasible = False
        notes.append("worse conditioned than allowed, which the method knows no constraint for")
    objective = function.objective(path)
    return PenaltyRun(start, signs, path.placement, path.joints, objective, feasible, tuple(trace), "; ".join(notes))


def _phases(cycles: Cycles, path: Followed, barrier: Barrier | None, notes: list[str]) -> Followed:
    """The phases of a method, from a start that reaches every pose."""
    rules, worst = cycles.rules, cycles.worst(path)
    if barrier is None:
        return cycles.outside(path, rules.margin, 0.0)
    if worst >= 0.0:
        notes.append(f"infeasible start (worst constraint {worst:+.2g}): exterior phase first")
        path = cycles.outside(path, rules.phase_margin, -0.5 * rules.phase_margin)
        worst = cycles.worst(path)
    if worst >= 0.0:
        notes.append(f"the exterior phase ended infeasible (worst constraint {worst:+.2g})")
        return path
    return cycles.inside(path, barrier)


def nearest_posture(problem: ReducedProblem, placement: Floats, asked: Signs | None = None) -> Signs | None:
    """The posture with the smallest E among those that reach every pose from ``placement`` (4,); None if none does.

    This is how the source's reference steers: the limits are not looked at.
    """
    paths = paths_at(problem, placement)
    able = _admitted(problem, asked) & (paths.missing[:, 0] == 0.0)
    return ALL_SIGNS[int(np.argmin(np.where(able, paths.objective[:, 0], np.inf)))] if able.any() else None


def _admitted(problem: ReducedProblem, asked: Signs | None) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    """(8,) the postures to choose from."""
    return problem.postures if asked is None else np.array([signs == asked for signs in ALL_SIGNS])


def _reach_phase(
    problem: ReducedProblem, start: Floats, asked: Signs | None, trace: list[PenaltyCycle]
) -> tuple[Floats, Signs]:
    """Bring the posture that is least out of reach into reach; (placement, posture)."""
    missing = np.where(_admitted(problem, asked), paths_at(problem, start).missing[:, 0], np.inf)
    nearest = ALL_SIGNS[int(np.argmin(missing))]
    end = approach(PostureFunction(problem, nearest), start)
    trace.append(
        PenaltyCycle(
            phase="reach",
            parameter=0.0,
            penalised=end.penalised,
            objective=None,
            placement=end.placement,
            worst=end.worst,
            iterations=end.descent.iterations,
            evaluations=end.descent.evaluations + 1,
        )
    )
    return end.placement, nearest


def reproduces(problem: ReducedProblem, path: Followed) -> bool:
    """True if Pinocchio's flange stands where the task wants it, at every pose."""
    x, y, z, yaw = path.placement
    base_in_world = transform(rotation_z(yaw), np.array([x, y, z]))
    wanted = inverse(base_in_world) @ transform(problem.rotations, problem.positions)
    reached = flange_poses(problem.arm.robot, path.joints)
    distance = np.linalg.norm(reached[:, :3, 3] - wanted[:, :3, 3], axis=1)
    angle = rotation_angle(np.swapaxes(wanted[:, :3, :3], 1, 2) @ reached[:, :3, :3])
    return bool(np.max(distance) <= POSITION_TOLERANCE and np.max(angle) <= ANGLE_TOLERANCE)


def _well_conditioned(arm: Arm, path: Followed) -> bool:
    """True if the arm asks for no conditioning, or the path keeps it."""
    if arm.min_conditioning is None:
        return True
    found = conditioning(arm.robot, arm.tool, path.joints, characteristic_length(arm.robot))
    return float(found.min()) >= arm.min_conditioning


# --- the whole cell ---------------------------------------------------------------------------------------------------


def run_baseline(method: str, cell: Cell, settings: Settings) -> Baseline:
    """One method from the source's starts, for both assignments of the arms to the sides of the path.

    Args:
        method: a key of `METHODS`.
        cell: the problem. Arms without a closed form or a vertical first axis are left out, which makes the baseline
            infeasible; the note names them.
        settings: `time_limit` is kept.

    Returns:
        The better assignment (a feasible one first, then the smaller E), with a note on the other.
    """
    began = perf_counter()
    deadline = began + settings.time_limit
    asked, cell = cell.objective, replace(cell, objective=JOINT_AVAILABILITY)
    sides: list[tuple[BaselineArm, BaselineArm]] = []
    notes: list[str] = []
    for index, arm in enumerate(cell.arms):
        problem = reduced_problem(cell, arm)
        if problem is None:
            notes.append(
                f"no baseline for {arm.name}: it needs closed-form inverse kinematics and a vertical first axis"
            )
            continue
        left, right = (_run_arm(method, cell, problem, side, deadline) for side in (LEFT, RIGHT))
        # Arms alternate between the sides in the order of the request; the other assignment exchanges the sides.
        sides.append((left, right) if index % 2 == 0 else (right, left))
    assignments = [tuple(pair[first] for pair in sides) for first in (0, 1)]
    best = 0 if _rank(assignments[0]) <= _rank(assignments[1]) else 1
    arms = assignments[best]
    if arms:
        notes.append(f"the other assignment of the arms to the sides ends {_describe(assignments[1 - best])}")
    if not asked.bounded:
        notes.append(f"the method minimises {cell.objective.name}, as its source does, not {asked.name}")
    complete = len(arms) == len(cell.arms)
    feasible = complete and all(arm.feasible for arm in arms)
    objective = _total(arms) if complete else None
    return Baseline(method, objective, perf_counter() - began, feasible, arms, "; ".join(notes))


def _run_arm(method: str, cell: Cell, problem: ReducedProblem, side: int, deadline: float) -> BaselineArm:
    """One arm from one side."""
    arm = problem.arm
    run = minimise_from(problem, source_start(cell, arm, side), None, method, deadline=deadline)
    return BaselineArm(
        arm=arm.name,
        position=run.placement[:3],
        yaw=arm.base.yaw_in_interval(float(run.placement[3])),
        objective=run.objective,
        feasible=run.feasible,
        start=run.start,
        posture=name_signs(run.posture),
        trace=run.trace,
        note=run.note,
        mount=arm.mount,
    )


def _total(arms: tuple[BaselineArm, ...]) -> float | None:
    """Sum of E, or None where an arm has none."""
    values = [arm.objective for arm in arms if arm.objective is not None]
    return sum(values) if len(values) == len(arms) else None


def _rank(arms: tuple[BaselineArm, ...]) -> tuple[bool, float]:
    """Smaller is better: feasible ones first, then by E."""
    total = _total(arms)
    return not all(arm.feasible for arm in arms), inf if total is None else total


def _describe(arms: tuple[BaselineArm, ...]) -> str:
    infeasible = [arm.arm for arm in arms if not arm.feasible]
    return f"infeasible for {', '.join(infeasible)}" if infeasible else f"at E = {_total(arms):.6g}"
