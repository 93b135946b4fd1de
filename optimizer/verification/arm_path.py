r"""Follow one arm between its poses: is there a continuous way, and does every joint keep its limits on it?

The object moves straight from pose to pose and turns the short way; the arm follows it on its branch. The middle of
every step is looked at, and steps are halved again where something may happen between the places known:

- a joint travels far, or might leave its limits. A joint's way is bounded from its chord and from how far its middle
  sags off it, as in `duocell.optimizer.clearance.continuous_collision`;
- a singularity may be touched, the end of reach among them. Where W stands in front of axis 1 (squared) and the cosines
  of elbow and wrist are smooth functions of the place, also where the joints are not. They keep a margin
  (`duocell.models.cell.singular_margins`); where half their sag may use up what is left of it, however little, it is
  looked at.

A joint that still travels far on a part of 2^-20 of a step jumps there: the way passes a singularity. (Where that is
allowed, the wrist may turn in place.) Arms with a
closed form are followed by it, others by Newton's method, as are those that may go through singularities where their
branch leaps.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.pose import inverse
from duocell.models.cell.cell import Cell
from duocell.models.cell.pose_freedom import EQUATIONS
from duocell.models.cell.singular_margins import keeps_margins, margin_terms, violations_at_poses
from duocell.models.cell.task import Task
from duocell.models.kinematics.branches import solve_signed
from duocell.models.kinematics.closed_form import ClosedForm, closed_form
from duocell.models.kinematics.nominal import singular_fifth
from duocell.models.kinematics.wrist_singularity import wrist_distance
from duocell.models.robot.arm import SINGULAR_WRIST, TURN, Arm
from duocell.optimizer.clearance.clearance import Break, LimitExcess
from duocell.optimizer.clearance.continuous_collision import LIMITS as EXACT
from duocell.optimizer.clearance.continuous_collision import SAFETY, Resolution
from duocell.optimizer.clearance.path_samples import STRAY, ObjectPath, flanges_at, follow, keep_inside
from duocell.optimizer.nlp.program import ArmSolution

LIMITS = 1e-6
"""rad; a smaller excess over a limit between two poses is rounding of followed paths."""
OVERSHOOT = np.radians(1.0)
"""rad that a joint may stick out of its limits between two poses where no layout keeps them all the way.

The poses are asked for, the straight way between them is not: a part that leaves it by some millimetres, or one more
pose, undoes so little. What is more than rounding is told with the layout.
"""
OVERRUN = 1e-3
"""m, the same of a joint that shifts; a carriage that runs farther past its end meets a stop."""
FAR = 0.5
"""rad; a joint that may travel more on an interval is looked at more closely."""
LEVELS = 20
"""Times that a step is halved before a joint that still travels far there counts as jumping."""
MOST = 4000
"""Configurations looked at."""
REACHED = 1e-6
"""m; a place that is missed by less counts as reached."""


@dataclass(frozen=True, slots=True)
class ArmPathCheck:
    """What one arm meets between its poses.

    Attributes:
        breaks: empty if the arm follows the object between all poses.
        excesses: the largest excess of each joint over its limits between the poses, for joints that have one; and
            of the sums of linear limits, likewise.
        samples: configurations looked at.
    """

    breaks: tuple[Break, ...]
    excesses: tuple[LimitExcess, ...]
    samples: int

    @property
    def beyond(self) -> tuple[LimitExcess, ...]:
        """The excesses that count: those of more than `OVERSHOOT`, or `OVERRUN` of a joint that shifts."""
        return tuple(one for one in self.excesses if one.amount > (OVERSHOOT if one.unit == "rad" else OVERRUN))

    @property
    def free(self) -> bool:
        """True if the arm can go the whole way inside its limits."""
        return not self.breaks and not self.excesses

    @property
    def tolerable(self) -> bool:
        """True if it can go the whole way, but for joints that overshoot a little."""
        return not self.breaks and not self.beyond


@dataclass(frozen=True, eq=False, slots=True)
class _Intervals:
    """Parts of steps: ``step`` (I,) is the pose before, [start, end] (I,) fractions, before and after (I, n) rad."""

    step: Ints
    start: Floats
    end: Floats
    before: Floats
    after: Floats

    def __len__(self) -> int:
        return len(self.step)

    def __getitem__(self, rows: Bools) -> _Intervals:
        return _Intervals(self.step[rows], self.start[rows], self.end[rows], self.before[rows], self.after[rows])

    @property
    def middle(self) -> Floats:
        """(I,) fractions halfway."""
        return 0.5 * (self.start + self.end)

    def halves(self, joints: Floats) -> _Intervals:
        """All first halves, then all second ones, with the arm at ``joints`` (I, n) in the middles."""
        middle = self.middle
        return _Intervals(
            np.concatenate([self.step, self.step]),
            np.concatenate([self.start, middle]),
            np.concatenate([middle, self.end]),
            np.concatenate([self.before, joints]),
            np.concatenate([joints, self.after]),
        )


Follower = Callable[[Floats, _Intervals], tuple[Floats, Bools]]
"""From flange poses (I, 4, 4) in the world: joints (I, n) rad in the middles, and (I,) True where there are any."""


def check_arm_path(cell: Cell, arm: Arm, point: ArmSolution, resolution: Resolution | None = None) -> ArmPathCheck:
    """Follow an arm along its path.

    Args:
        cell: task.
        arm: the arm.
        point: base and joints at the poses, as accurate as `duocell.optimizer.verification.verify` asks for.
        resolution: where to stop looking for limits; default 1 mm and 0.5°.
    """
    resolution = resolution or Resolution(most_samples=MOST)
    path, watched = _object_path(cell.task), keeps_margins(arm)
    follower = _follower(arm, point)
    joints, joined = point.joints, cell.task.joined
    touching, relief = _at_poses(arm, cell.task, joints)
    step = np.setdiff1d(np.flatnonzero(joined), [touching - 1, touching])
    zero = np.zeros(len(step))
    open_ = _Intervals(step, zero, zero + 1.0, joints[step], joints[step + 1])
    breaks = [
        Break(arm.name, k, 0.0) if np.any(joined[k : k + 1]) else Break(arm.name, k - 1, 1.0)
        for k in map(int, touching)
    ]
    beyond: dict[int, LimitExcess] = {}
    samples = len(joints)
    for level in range(LEVELS + 1):
        if not len(open_) or samples + len(open_) > resolution.most_samples:
            break
        objects = path.at(open_.step, open_.middle)
        found, arrived = follower(flanges_at(cell, arm, objects, open_.step, open_.middle, point.free), open_)
        samples += len(open_)
        sag, far = _travel(open_, found)
        if level == LEVELS:
            arrived &= ~far | _turns_in_place(arm, found)
        if watched:
            arrived &= np.all(margin_terms(arm, found) + relief[open_.step] >= 0.0, axis=-1)
        if not np.all(arrived):
            lost = open_[~arrived]
            breaks += [Break(arm.name, int(s), float(f)) for s, f in zip(lost.step, lost.middle, strict=True)]
            open_, found, sag, far = open_[arrived], found[arrived], sag[arrived], far[arrived]
        _note(beyond, arm, open_, found)
        halves = open_.halves(found)
        close = _may_leave_limits(arm, halves, sag) & np.tile(_long(path, open_, resolution), 2)
        if watched:
            terms = margin_terms(arm, np.stack([open_.before, found, open_.after])) + relief[open_.step]
            close |= _may_touch(terms)
        open_ = halves[close | np.tile(far, 2)]
    return ArmPathCheck(tuple(breaks), tuple(beyond[i] for i in sorted(beyond)), samples)


@lru_cache(maxsize=4)
def _object_path(task: Task) -> ObjectPath:
    """The object's way, the same for all arms."""
    return ObjectPath(task.poses)


# --- where the arm is in the middle -----------------------------------------------------------------------------------


def _follower(arm: Arm, point: ArmSolution) -> Follower:
    """How an arm finds its joints in the middles of intervals."""
    form, base, signs = closed_form(arm.robot), arm.base_in_world(point.position, point.yaw), point.signs
    if form is None or signs is None:
        return lambda flanges, at: _continued(arm, base, flanges, at)
    if arm.avoid_singularities:
        return lambda flanges, at: _branch(form, np.array([signs]), inverse(base) @ flanges, at)
    return lambda flanges, at: _either(
        arm, base, flanges, at, _branch(form, np.array([signs]), inverse(base) @ flanges, at)
    )


def _continued(arm: Arm, base: Floats, flanges: Floats, at: _Intervals) -> tuple[Floats, Bools]:
    """Newton's method from the middles of the chords; a redundant arm gives way to its limits."""
    joints, arrived = follow(arm.robot, base, flanges, at.before, at.after)
    beyond = np.any(arm.limit_excess(joints) > 0.0, axis=1) & arrived
    if arm.dof > EQUATIONS and np.any(beyond):
        inside, good = keep_inside(arm, base, flanges[beyond], joints[beyond])
        joints[beyond] = np.where(good[:, None], inside, joints[beyond])
    return joints, arrived


def _either(
    arm: Arm, base: Floats, flanges: Floats, at: _Intervals, branch: tuple[Floats, Bools]
) -> tuple[Floats, Bools]:
    """The branch; where it strays from its neighbours, as in a singularity, Newton's method if that arrives."""
    joints, arrived = branch
    apart = np.max(np.abs(at.after - at.before), axis=1)
    far = np.max(np.abs(joints - 0.5 * (at.before + at.after)), axis=1) > 0.5 * apart + STRAY
    if np.any(far):
        some = at[far]
        near, good = follow(arm.robot, base, flanges[far], some.before, some.after)
        joints[far] = np.where(good[:, None], near, joints[far])
        arrived[far] |= good
    return joints, arrived


def _branch(form: ClosedForm, signs: Ints, targets: Floats, at: _Intervals) -> tuple[Floats, Bools]:
    """The branch of one posture, every joint on the turn nearest to the middle of its chord."""
    found = solve_signed(form, targets[:, :3, :3], targets[None, :, :3, 3], signs)
    joints: Floats = found.joints[:, 0, 0].T
    joints = joints + TURN * np.round((0.5 * (at.before + at.after) - joints) / TURN)
    return joints, found.missing[0, 0] < REACHED


# --- what may happen elsewhere ----------------------------------------------------------------------------------------


def _travel(at: _Intervals, joints: Floats) -> tuple[Floats, Bools]:
    """(I, n) rad by which the middles lie off the chord, and (I,) True where a joint travels far on a half."""
    sag = np.abs(joints - 0.5 * (at.before + at.after))
    travel = 0.5 * SAFETY * (np.abs(at.after - at.before) + 4.0 * sag)
    return sag, np.max(travel, axis=1, initial=0.0) > FAR


def _turns_in_place(arm: Arm, joints: Floats) -> Bools:
    """(I,) True where the wrist is singular and may be: there joints 4 and 6 turn while the hand stands still."""
    singular = singular_fifth(arm.robot)
    if singular is None or arm.avoid_singularities:
        return np.zeros(len(joints), dtype=np.bool_)
    turns: Bools = wrist_distance(singular, joints[:, 4]) < SINGULAR_WRIST
    return turns


def _note(beyond: dict[int, LimitExcess], arm: Arm, at: _Intervals, joints: Floats) -> None:
    """Keep the largest excess of each joint over its limits."""
    excess = arm.limit_excess(joints)
    for i in np.flatnonzero(np.max(excess, axis=0, initial=-np.inf) > LIMITS):
        k = int(np.argmax(excess[:, i]))
        amount = float(excess[k, i])
        if int(i) not in beyond or amount > beyond[int(i)].amount:
            name = arm.bounded_names[int(i)]
            beyond[int(i)] = LimitExcess(
                arm.name, name, int(at.step[k]), float(at.middle[k]), amount, arm.bounded_units[int(i)]
            )


def _may_leave_limits(arm: Arm, halves: _Intervals, sag: Floats) -> Bools:
    """(2 I,) True where a joint, or a sum of them, may leave its limits on a half though it keeps them at both ends."""
    ends = arm.bounded(halves.before), arm.bounded(halves.after)
    high, low = np.maximum(*ends), np.minimum(*ends)
    reach = arm.bounded_sizes(np.tile(0.5 * sag, (2, 1)))  # a parabola's sag, of each half, is a quarter
    inside = (high <= arm.bounded_upper + EXACT) & (low >= arm.bounded_lower - EXACT)
    sure = (high + reach <= arm.bounded_upper + EXACT) & (low - reach >= arm.bounded_lower - EXACT)
    unsure: Bools = np.any(inside & ~sure, axis=1)
    return unsure


def _at_poses(arm: Arm, task: Task, joints: Floats) -> tuple[Ints, Floats]:
    """Poses too near a singularity to pass, and the violations steps are allowed; see `violations_at_poses`."""
    if not keeps_margins(arm):
        return np.zeros(0, dtype=np.int64), np.zeros((len(joints) - 1, 1))
    touching, relief = violations_at_poses(arm, task, joints)
    return np.flatnonzero(touching), relief


def _may_touch(terms: Floats) -> Bools:
    """(2 I,) True where a singularity may be too near on a half, from margin terms (3, I, k) at three places."""
    before, middle, after = terms
    bowed = 0.5 * SAFETY * np.abs(middle - 0.5 * (before + after))
    doubtful: Bools = np.any(np.concatenate([np.minimum(end, middle) <= bowed for end in (before, after)]), axis=-1)
    return doubtful


def _long(path: ObjectPath, at: _Intervals, resolution: Resolution) -> Bools:
    """(I,) True where the object still moves by more than the resolution on a half."""
    share = 0.5 * (at.end - at.start)
    shift = share * np.linalg.norm(path.shifts[at.step], axis=1)
    turn = share * np.linalg.norm(path.turns[at.step], axis=1)
    long: Bools = (shift > resolution.length) | (turn > resolution.angle)
    return long
