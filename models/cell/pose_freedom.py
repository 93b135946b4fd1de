"""The one object that knows what the poses of a task ask of an arm, and what they leave open.

Search, program, refinement and proofs ask it: how many equations a pose has, which parameters are open within which
ranges, where the flange has to be for given parameters, and by what it moves with them. Without a tolerance a pose is
six equations and nothing is open.

A flange target is ``A · D(s) · B``: D the displacement (`duocell.models.robot.freedom`), A and B constants of the pose.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from duocell.models.base.arrays import Bools, Floats, Ints
from duocell.models.base.pose import inverse, transform
from duocell.models.cell.displacement import displaced, displacement_twists
from duocell.models.robot.freedom import LENGTHS, NAMES, SIZE, TILT, Frame, Freedom

EQUATIONS = 6
"""Of a pose: what its flange target takes from an arm."""


@dataclass(frozen=True, eq=False)
class PoseFreedom:
    """What m poses ask of the flange of one arm, with k parameters that are open.

    Attributes:
        before: (m, 4, 4) A, in the world. after: (m, 4, 4) B, ending at the flange.
        given: (m, 8) values of all parameters; those that are open at their nominal values, nearest to no displacement.
        which: (k,) of the parameters, those that are open; where any is, also those that are given and not 0.
        lower: (m, k) m and rad. upper: (m, k), equal where a parameter is given at a pose.
        steps: (k,) m and rad from pose to pose.
        cone: (m,) rad, see `duocell.models.robot.freedom`.
    """

    before: Floats
    after: Floats
    given: Floats
    which: Ints
    lower: Floats
    upper: Floats
    steps: Floats
    cone: Floats

    @property
    def count(self) -> int:
        """k, parameters that are open at some pose."""
        return len(self.which)

    @property
    def exact(self) -> bool:
        """True if nothing is open: every pose is given in all six coordinates."""
        return self.count == 0

    @property
    def names(self) -> tuple[str, ...]:
        """Of the open parameters."""
        return tuple(NAMES[i] for i in self.which)

    @property
    def kind(self) -> tuple[int, ...]:
        """Which parameters are open, as a key of what is compiled for them."""
        return tuple(int(i) for i in self.which)

    @property
    def equations(self) -> int:
        """Rows that a pose has in a program."""
        return EQUATIONS

    def nullspace(self, dof: int) -> int:
        """Motions that leave an arm of so many joints at a pose: its own, and those along the parameters."""
        return dof + self.count - EQUATIONS

    @cached_property
    def nominal(self) -> Floats:
        """(m, k) the parameters nearest to no displacement."""
        return self.given[:, self.which]

    def all_values(self, values: Floats | None = None) -> Floats:
        """(..., m, 8) of all parameters, from the open ones (..., m, k); nominal without any, or where none is open."""
        if values is None or self.exact:
            return self.given
        full = np.broadcast_to(self.given, (*values.shape[:-1], SIZE)).copy()
        full[..., self.which] = values
        return full

    @cached_property
    def _nominal_targets(self) -> Floats:
        return self._targets(self.given) if np.any(self.given) else self.before @ self.after

    def _targets(self, full: Floats) -> Floats:
        found: Floats = self.before @ displaced(full, self.cone) @ self.after
        return found

    def targets(self, values: Floats | None = None) -> Floats:
        """(..., m, 4, 4) flange targets in the world for parameters (..., m, k), nominal without any."""
        given = values is None or self.exact
        return self._nominal_targets if given else self._targets(self.all_values(values))

    def twists(self, values: Floats) -> Floats:
        """(m, 6, k) by what the flange moves per unit of the parameters (m, k): m, then rad, in the world.

        The linear part is that of the flange's origin.
        """
        full = self.all_values(values)
        linear, angular = displacement_twists(full, self.cone, self.after[:, :3, 3])
        axes = self.before[:, :3, :3]
        both = np.concatenate([axes @ linear, axes @ angular], axis=1)
        moved: Floats = both[:, :, self.which]
        return moved

    def turned(self) -> Floats:
        """(m,) rad by which a displacement may turn the hand at most, either way from the nominal one."""
        spans = self._spans()
        tilt = np.where(np.any(spans[:, TILT] > 0.0, axis=1), 2.0 * self.cone, 0.0)
        turn: Floats = np.minimum(tilt + np.sum(spans[:, TILT.stop :], axis=1), np.pi)
        return turn

    def moved(self, point: Floats) -> Floats:
        """(m,) m by which a displacement may move a point (3,) of the flange at most, from where it is nominally."""
        spans, places = self._spans(), (self.after @ np.append(point, 1.0))[:, :3]
        about_z = np.all(spans[:, TILT.start : -1] == 0.0, axis=1) & (
            np.max(np.abs(self.given[:, TILT.start :])) == 0.0
        )
        lever = np.where(about_z, np.linalg.norm(places[:, :2], axis=1), np.linalg.norm(places, axis=1))
        shift: Floats = np.linalg.norm(spans[:, :LENGTHS], axis=1) + 2.0 * np.sin(0.5 * self.turned()) * lever
        return shift

    def _spans(self) -> Floats:
        """(m, 8) by how much parameters may differ from their nominal values; infinite where they may be anything."""
        spans = np.zeros((len(self.given), SIZE))
        spans[:, self.which] = np.maximum(self.upper - self.nominal, self.nominal - self.lower)
        return spans

    def excess(self, values: Floats) -> Floats:
        """(m, k) m and rad by which parameters lie beyond their ranges; negative: what is left."""
        beyond: Floats = np.maximum(self.lower - values, values - self.upper)
        return beyond

    def step_excess(self, values: Floats, joined: Bools) -> float:
        """m or rad by which the parameters (m, k) change more than they may between poses; negative: what is left.

        ``joined`` (m - 1,) says where the next pose is one of the same segment.
        """
        change = np.abs(np.diff(values, axis=0))[joined]
        return float(np.max(change - self.steps, initial=-np.inf))


def pose_freedom(poses: Floats, grasps: Floats, tool: Floats, freedom: Freedom | None) -> PoseFreedom:
    """What poses ask of an arm.

    Args:
        poses: (m, 4, 4) T_W^C. grasps: (m, 4, 4) TCP in the frame of the part. tool: (4, 4) TCP in the flange frame.
        freedom: of the poses, or None: nothing is open.
    """
    m, to_flange = len(poses), inverse(tool)
    if freedom is None:
        nothing = np.zeros((m, 0))
        return PoseFreedom(
            before=poses @ grasps @ to_flange,
            after=np.broadcast_to(np.eye(4), (m, 4, 4)),
            given=np.zeros((m, SIZE)),
            which=np.zeros(0, dtype=np.int64),
            lower=nothing,
            upper=nothing,
            steps=np.zeros(0),
            cone=np.zeros(m),
        )
    before, after = _frames(poses, grasps, freedom)
    given = np.clip(0.0, freedom.lower, freedom.upper)
    used = freedom.open | np.any(given != 0.0, axis=0)
    which = np.flatnonzero(used if np.any(freedom.open) else freedom.open)
    return PoseFreedom(
        before=before,
        after=after @ to_flange,
        given=given,
        which=which,
        lower=freedom.lower[:, which],
        upper=freedom.upper[:, which],
        steps=freedom.steps[which],
        cone=freedom.cone,
    )


def _frames(poses: Floats, grasps: Floats, freedom: Freedom) -> tuple[Floats, Floats]:
    """(m, 4, 4) what stands before and after the displacement of a TCP."""
    axes = transform(freedom.axes, np.zeros(3))
    hands = poses @ grasps
    upright = transform(np.eye(3), hands[:, :3, 3])
    turned = transform(hands[:, :3, :3], np.zeros(3))
    unmoved = np.broadcast_to(np.eye(4), poses.shape)
    pairs = {Frame.TOOL: (hands, unmoved), Frame.PART: (poses, grasps), Frame.WORLD: (upright, turned)}
    chosen = (np.stack([pairs[frame][side] for frame in Frame]) for side in (0, 1))
    before, after = (one[freedom.frames, np.arange(len(poses))] for one in chosen)
    return before @ axes, inverse(axes) @ after
