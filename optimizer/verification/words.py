"""What is wrong between two poses, as reasons."""

from __future__ import annotations

from duocell.models.robot.joint import in_words
from duocell.optimizer.clearance.clearance import Break, LimitExcess
from duocell.optimizer.results.layout import Reason


def arm_path_faults(breaks: tuple[Break, ...], beyond: tuple[LimitExcess, ...]) -> tuple[Reason, ...]:
    """Reasons for ways that cannot be followed, one per arm and step, and for limits exceeded between poses."""
    lost = {(one.arm, one.pose): one for one in reversed(breaks)}
    followed = [
        Reason(
            one.arm,
            "joint_step",
            poses_at(one.pose, one.fraction),
            f"{one.arm}: cannot follow the part {between(one.pose, one.fraction)}: the straight way leaves its "
            f"reach, or touches a singularity of shoulder, elbow or wrist; add a pose between "
            f"{one.pose} and {one.pose + 1}, or move or turn the task",
        )
        for one in reversed(lost.values())
    ]
    return (*followed, *(_beyond(one) for one in beyond))


def _beyond(one: LimitExcess) -> Reason:
    detail = (
        f"{one.arm}: {one.joint} is beyond its limit by {in_words(one.amount, one.unit)} "
        f"{between(one.pose, one.fraction)}"
    )
    return Reason(one.arm, "joint_limit", poses_at(one.pose, one.fraction), detail, one.joint, one.amount, one.unit)


def poses_at(pose: int, fraction: float) -> tuple[int, ...]:
    """The poses at or between which something is."""
    if fraction <= 0.0:
        return (pose,)
    return (pose + 1,) if fraction >= 1.0 else (pose, pose + 1)


def between(pose: int, fraction: float) -> str:
    """Where on the path, in words."""
    poses = poses_at(pose, fraction)
    if len(poses) == 1:
        return f"at pose {poses[0]}"
    return f"between poses {poses[0]} and {poses[1]} ({100.0 * fraction:.0f} % of the way)"
