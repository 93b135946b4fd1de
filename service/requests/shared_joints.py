"""Arms of one machine that share a joint: a torso cannot turn two ways at once."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations

from duocell.models.robot.arm import Arm
from duocell.service.common.issues import IssueCollector


def check_shared_joints(arms: Sequence[Arm | None], issues: IssueCollector) -> None:
    """Refuse two arms that are different chains of one URDF file and have a joint in common.

    Arms of the same chain are two machines of one kind and share nothing.

    Args:
        arms: as converted, in the order of the request; None where one could not be.
        issues: where to note what is wrong.
    """
    for (_, first), (index, second) in combinations(enumerate(arms), 2):
        if first is None or second is None or not first.robot.description:
            continue
        one, other = first.robot, second.robot
        shared = [name for name in one.joint_names if name in other.joint_names]
        if one.description == other.description and shared and one.joint_names != other.joint_names:
            issues.add(
                f"/arms/{index}/robot",
                f"{second.name} and {first.name} are two arms of one machine ({one.source}) that share joint "
                f"{', '.join(shared)}, which cannot turn two ways at once. Bring both robots with a `base_link` behind "
                "it; it then stays at zero.",
            )
