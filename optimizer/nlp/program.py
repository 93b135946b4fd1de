"""The nonlinear program of a cell: base placements and all joints of all poses at once (docs/method.md, section 1).

`build_program` is pure: it states the problem and solves nothing. The symbolic part depends on the robots, the number
of poses and the kinds of rows alone, so it is compiled once and shared; a `Program` adds the numbers of one request.

Unknowns, arm after arm: base (x, y, z, yaw), then pose by pose the joints and the parameters that the task leaves open.
Rows, arm after arm: pose rows of every pose (`pose_rows`), then, where asked for, joint steps and conditioning cuts,
and last the linear limits of arms that have such.
Steps from one segment of a task sequence to the next have rows without bounds.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.pose_freedom import PoseFreedom
from duocell.models.cell.singular_margins import MARGIN_FACTOR, Margins, margins_along, margins_at_poses
from duocell.models.kinematics.branches import path_signs
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.kinematics.nominal import posture_form, singular_fifth
from duocell.models.robot.arm import Arm
from duocell.models.robot.freedom import NAMES
from duocell.models.robot.posture import Signs
from duocell.optimizer.nlp.pose_rows import BASE, freedom_numbers
from duocell.optimizer.nlp.structure import LinearRows, Structure, structure_of

POSE_ROWS = ("x", "y", "z", "rotation about x", "rotation about y", "rotation about z")


@dataclass(frozen=True, eq=False, slots=True)
class ArmSolution:
    """One arm's part of a start or a solution of the program.

    Attributes:
        position: (3,) m, base origin. yaw: rad. joints: (m, n) rad.
        signs: posture (shoulder, elbow, wrist) to be kept, or None for arms without postures.
        free: (m, k) m and rad, parameters that the poses leave open (`duocell.models.cell.pose_freedom`), or None for
            their nominal values.
    """

    position: Floats
    yaw: float
    joints: Floats
    signs: Signs | None = None
    free: Floats | None = None


@dataclass(frozen=True, eq=False, slots=True)
class Cuts:
    """Linear rows ``gradient · q_j >= bound``, one per pose, that keep an arm away from singularities.

    Attributes:
        gradients: (m, n). bounds: (m,); -inf where no cut is needed.
    """

    gradients: Floats
    bounds: Floats


@dataclass(frozen=True, eq=False, slots=True)
class Program:
    """One nonlinear program, ready to be solved from a start.

    Attributes:
        arms: the arms in it.
        structure: compiled symbols: unknowns, rows and derivatives.
        parameters: (p,) per arm: targets, weights of the poses, of every measure its weight and numbers, cuts.
        lower: (N,) bounds of the unknowns. upper: (N,).
        rows_lower: (M,) bounds of the rows. rows_upper: (M,).
        max_joint_step: rad.
        scale: what the objective is divided by inside the program, so that tolerances mean the same for all of them.
    """

    arms: tuple[Arm, ...]
    structure: Structure
    parameters: Floats
    lower: Floats
    upper: Floats
    rows_lower: Floats
    rows_upper: Floats
    max_joint_step: float
    scale: float

    def labels(self) -> Iterator[str]:
        """One sentence per row, in order; made on demand, a long task has many thousand."""
        for arm, kind in zip(self.arms, self.structure.kinds, strict=True):
            names = arm.robot.joint_names + tuple(NAMES[i] for i in kind)
            for pose in range(self.structure.poses):
                yield from (f"{arm.name} / flange {name}, pose {pose}" for name in POSE_ROWS)
                if self.structure.keep_shoulder:
                    yield f"{arm.name} / shoulder side, pose {pose}"
            if self.structure.steps:
                for pose in range(1, self.structure.poses):
                    yield from (f"{arm.name} / {name} step to pose {pose}" for name in names)
            if self.structure.cuts:
                yield from (f"{arm.name} / conditioning, pose {pose}" for pose in range(self.structure.poses))
            sums = arm.bounded_names[arm.dof :]
            yield from (f"{arm.name} / {name}, pose {pose}" for pose in range(self.structure.poses) for name in sums)

    def pack(self, points: Sequence[ArmSolution]) -> Floats:
        """(N,) vector of unknowns from one point per arm."""
        parts: list[Floats] = []
        for point, kind in zip(points, self.structure.kinds, strict=True):
            parts += [point.position, np.array([point.yaw]), _with_free(point, len(kind)).ravel()]
        return np.concatenate(parts)

    def unpack(self, unknowns: Floats, points: Sequence[ArmSolution]) -> list[ArmSolution]:
        """Points per arm of a vector of unknowns; postures are those of ``points``."""
        result, at = [], 0
        for index, (arm, point) in enumerate(zip(self.arms, points, strict=True)):
            each = self.structure.of_a_pose(index)
            size = self.structure.poses * each
            base, poses = unknowns[at : at + BASE], unknowns[at + BASE : at + BASE + size].reshape(-1, each)
            free = poses[:, arm.dof :] if each > arm.dof else None
            result.append(ArmSolution(base[:3], float(base[3]), poses[:, : arm.dof], point.signs, free))
            at += BASE + size
        return result


def build_program(
    cell: Cell,
    arms: Sequence[Arm],
    points: Sequence[ArmSolution],
    *,
    keep_shoulder: bool = False,
    steps: bool = False,
    clear: bool = False,
    cuts: Sequence[Cuts] | None = None,
) -> Program:
    """State the program for some arms of a cell.

    Args:
        cell: task and step limit.
        arms: the arms to be placed together (arms that nothing couples may be solved one by one).
        points: one per arm; gives the posture to be kept and the turns of elbow and wrist it lies in.
        keep_shoulder: add the row that keeps the shoulder's side (a bound cannot express it).
        steps: add the rows of the joint steps.
        clear: keep shoulder, elbow and wrist as far from their singularities as ways between the poses need it.
        cuts: one set of conditioning cuts per arm.

    Returns:
        The program.
    """
    poses = len(cell.task)
    mounts = tuple(tuple(float(x) for x in arm.mount.ravel()) for arm in arms)
    robots, linear = tuple(arm.robot for arm in arms), tuple(_linear_rows(arm) for arm in arms)
    freedoms = [cell.freedom(arm) for arm in arms]
    kinds = tuple(freedom.kind for freedom in freedoms)
    structure = structure_of(
        robots, mounts, poses, keep_shoulder, steps, cuts is not None, linear, kinds, cell.objective.measures
    )
    scale = float(np.mean([cell.objective.scale(arm) for arm in arms])) * cell.task.weight_scale
    parts = [
        _arm_numbers(cell, arm, freedom, point, structure, scale, clear)
        for arm, freedom, point in zip(arms, freedoms, points, strict=True)
    ]
    numbers = [part.parameters for part in parts]
    rows_lower, rows_upper = [], []
    for index, part in enumerate(parts):
        rows_lower.append(part.rows_lower)
        rows_upper.append(part.rows_upper)
        if steps:
            allowed = np.append(cell.step_limits(arms[index].robot), freedoms[index].steps)
            most = np.where(cell.task.joined[:, None], allowed, np.inf).ravel()
            rows_lower.append(-most)
            rows_upper.append(most)
        if cuts is not None:
            slopes = np.pad(cuts[index].gradients, ((0, 0), (0, freedoms[index].count)))
            numbers[index] = np.concatenate([numbers[index], slopes.ravel()])
            rows_lower.append(cuts[index].bounds)
            rows_upper.append(np.full(poses, np.inf))
        rows_lower.append(np.tile(arms[index].bounded_lower[arms[index].dof :], poses))
        rows_upper.append(np.tile(arms[index].bounded_upper[arms[index].dof :], poses))
    return Program(
        arms=tuple(arms),
        structure=structure,
        parameters=np.concatenate(numbers),
        lower=np.concatenate([part.lower for part in parts]),
        upper=np.concatenate([part.upper for part in parts]),
        rows_lower=np.concatenate(rows_lower),
        rows_upper=np.concatenate(rows_upper),
        max_joint_step=cell.max_joint_step,
        scale=scale,
    )


def _with_free(point: ArmSolution, count: int) -> Floats:
    """(m, n + k) the unknowns of the poses."""
    if count == 0:
        return point.joints
    if point.free is None:
        raise ValueError("a start of poses with parameters that are open, without values for these")
    return np.concatenate([point.joints, point.free], axis=1)


def _linear_rows(arm: Arm) -> LinearRows:
    """Coefficients of an arm's linear limits."""
    return () if arm.linear_limits is None else tuple(map(tuple, arm.linear_limits.matrix.tolist()))


@dataclass(frozen=True, eq=False, slots=True)
class _ArmNumbers:
    parameters: Floats
    lower: Floats
    upper: Floats
    rows_lower: Floats
    rows_upper: Floats


def _arm_numbers(
    cell: Cell, arm: Arm, freedom: PoseFreedom, point: ArmSolution, structure: Structure, scale: float, clear: bool
) -> _ArmNumbers:
    """Parameters, bounds and row bounds of one arm."""
    poses = structure.poses
    segments = cell.task.segments
    margins = margins_along(arm, MARGIN_FACTOR) if clear else margins_at_poses(arm)
    sides = [joint_bounds(arm, replace(point, joints=point.joints[segment]), margins) for segment in segments]
    lengths = [segment.stop - segment.start for segment in segments]
    low, high = (np.repeat([side[end] for side in sides], lengths, axis=0) for end in (0, 1))
    low, high = np.concatenate([low, freedom.lower], axis=1), np.concatenate([high, freedom.upper], axis=1)
    base = arm.base.bounds.copy()
    if arm.base.yaw_free:
        base[3] = -np.inf, np.inf  # the reported yaw is brought back into the interval afterwards
    rows_low, rows_high = np.zeros((poses, structure.pose_rows)), np.zeros((poses, structure.pose_rows))
    if structure.keep_shoulder and point.signs is not None:
        rows_low[:, -1] = margins.shoulder if point.signs[0] > 0 else -np.inf
        rows_high[:, -1] = np.inf if point.signs[0] > 0 else -margins.shoulder
    return _ArmNumbers(
        parameters=np.concatenate(
            [
                freedom_numbers(freedom).T.ravel(),
                cell.task.weights,
                *(
                    number
                    for term in cell.objective.terms
                    for number in ([term.weight / scale], term.measure.numbers(arm))
                ),
            ]
        ),
        lower=np.concatenate([base[:, 0], low.ravel()]),
        upper=np.concatenate([base[:, 1], high.ravel()]),
        rows_lower=rows_low.ravel(),
        rows_upper=rows_high.ravel(),
    )


def joint_bounds(arm: Arm, point: ArmSolution, margins: Margins | None = None) -> tuple[Floats, Floats]:
    """Limits in force, narrowed so that elbow and wrist keep their side; both (n,) rad.

    A side of the elbow is half a turn of joint 3, a side of the wrist half a turn of joint 5, less the ``margins`` to
    their singularities at either end (default: those of poses); which half turn is the one the start lies in. ``point``
    is a path of one segment: others may be on other turns.
    """
    low, high = arm.lower.copy(), arm.upper.copy()
    form, singular = posture_form(arm.robot), singular_fifth(arm.robot)
    signs = point.signs
    if signs is None and form is not None and closed_form(arm.robot) is None:
        signs = path_signs(form, point.joints)  # those of the drawing
    if form is None or singular is None or signs is None:
        return low, high
    shoulder, elbow, wrist = signs
    bend = -shoulder * elbow  # sign of the turn from upper arm to forearm
    turn = form.turns[2] * bend
    straight = -form.turns[2] * form.planar.elbow_angle
    margins = margins or margins_at_poses(arm)
    sides = (2, straight, turn, margins.elbow), (4, singular, float(wrist), margins.wrist)
    for joint, zero, side, inside in sides:
        mean = float(np.mean(point.joints[:, joint]))
        start = zero + (np.pi * (side - 1.0) / 2.0)
        start += 2.0 * np.pi * np.round((mean - (start + np.pi / 2.0)) / (2.0 * np.pi))
        low[joint], high[joint] = max(low[joint], start + inside), min(high[joint], start + np.pi - inside)
    return low, high


def describe(program: Program) -> str:
    """A few lines for a person who inspects a program."""
    structure = program.structure
    kinds = ", ".join(
        word
        for word, there in (
            ("shoulder rows", structure.keep_shoulder),
            ("step rows", structure.steps),
            ("conditioning cuts", structure.cuts),
        )
        if there
    )
    arms = "; ".join(f"{arm.name}: {arm.robot.name}" for arm in program.arms)
    return f"{len(program.lower)} unknowns, {len(program.rows_lower)} rows, {structure.poses} poses ({arms})" + (
        f"; with {kinds}" if kinds else ""
    )
