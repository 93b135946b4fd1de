"""What a certificate says about one arm."""

from __future__ import annotations

from dataclasses import dataclass

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.robot.posture import Signs


@dataclass(frozen=True, eq=False)
class InfeasibilityCause:
    """Something that rules out base positions on its own.

    Attributes:
        kind: out_of_reach | joint_limit | joint_step (no path within limits and step from pose to pose) |
            singularity (the wrist is too near to its own) | linear_limit (of a sum of joints) | conditioning.
        joint: index of the joint, or None for reach, sums of joints and conditioning.
        share: fraction of what was searched (base region times postures) that it was seen to rule out. Shares
            overlap; reach is looked at first, joints only where reach rules nothing out.
        pose_shares: (m,) the same fraction for every single pose.
    """

    kind: str
    joint: int | None
    share: float
    pose_shares: Floats

    def __post_init__(self) -> None:
        set_frozen(self, "pose_shares", self.pose_shares, (None,))

    @property
    def poses(self) -> tuple[int, ...]:
        """The poses that matter most: those with at least half of the largest share."""
        most = float(self.pose_shares.max(initial=0.0))
        return tuple(j for j, share in enumerate(self.pose_shares) if share > 0.0 and share >= 0.5 * most)


@dataclass(frozen=True, eq=False)
class Incumbent:
    """A usable path found on the way.

    Attributes:
        position: (3,) m, base origin in the world.
        signs: shoulder, elbow, wrist.
        yaw: rad.
        objective: E of the arm.
    """

    position: Floats
    signs: Signs
    yaw: float
    objective: float

    def __post_init__(self) -> None:
        set_frozen(self, "position", self.position, (3,))


@dataclass(frozen=True, eq=False)
class ArmProof:
    """No base in the arm's region scores less than ``lower_bound`` in any admitted posture.

    Attributes:
        lower_bound: None if the arm is proved infeasible, or if there is no proof (``note`` says why).
        objective: the better of the incumbent given and the one found; None if there is neither.
        gap: ``(objective - lower_bound) / max(objective, 1e-9)``; None without both.
        proved: True if the requested gap is reached, or infeasibility is shown.
        infeasible: True if no base in the region allows any path in one posture.
        boxes: boxes bounded.
        wall_time: s.
        causes: what rules base positions out, largest share first.
        found: the best usable path met, if it is better than the incumbent given.
        note: what a reader should know.
    """

    lower_bound: float | None
    objective: float | None
    gap: float | None
    proved: bool
    infeasible: bool
    boxes: int
    wall_time: float
    causes: tuple[InfeasibilityCause, ...] = ()
    found: Incumbent | None = None
    note: str = ""


def relative_gap(objective: float, lower_bound: float) -> float:
    """``(objective - lower_bound) / max(objective, 1e-9)``, never below 0 through rounding."""
    return max(float(objective) - float(lower_bound), 0.0) / max(float(objective), 1e-9)
