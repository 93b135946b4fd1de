"""What a proof of infeasibility met, as reasons for people."""

from __future__ import annotations

from duocell.models.cell.cell import Cell
from duocell.models.cell.surroundings import PairClass
from duocell.models.robot.arm import Arm
from duocell.optimizer.certificate.cell_proof import ArmPart, CellProof
from duocell.optimizer.certificate.exclusion.causes import Cause
from duocell.optimizer.certificate.leaves import excluded_shares
from duocell.optimizer.certificate.pairs.pair_tree import PairTree
from duocell.optimizer.reasons.meant_contact import if_meant
from duocell.optimizer.reasons.reasons import explain_proof, linear_names
from duocell.optimizer.results.layout import Reason

MOST = 3
"""Reasons per arm."""
KINDS = {
    "reach": "out_of_reach",
    "limit": "joint_limit",
    "linear": "joint_limit",
    "path": "joint_step",
    "singularity": "singularity",
    "floor": "floor",
    "conditioning": "conditioning",
}
"""Words of the contract for the kinds of causes; all others are collisions."""


def reasons_of(cell: Cell, proof: CellProof) -> tuple[Reason, ...]:
    """Why a cell has no layout; empty where that is not proved."""
    if not proof.infeasible:
        return ()
    lost = [(arm, part) for arm, part in zip(cell.arms, proof.arms, strict=True) if part.infeasible]
    if lost:
        return tuple(reason for arm, part in lost for reason in reasons_of_arm(cell, arm, part))
    return tuple(_of_pair(cell, pair) for pair in proof.pairs if pair.lower == float("inf"))


def reasons_of_arm(cell: Cell, arm: Arm, part: ArmPart) -> tuple[Reason, ...]:
    """Why an arm has no layout even by itself, largest share first."""
    shares = excluded_shares(part.tree)
    if all(cause.kind in ("reach", "limit", "path", "singularity", "linear") for cause, _ in shares):
        return explain_proof(cell, arm, part.tree.cause_shares.causes())
    reasons = []
    for cause, share in shares[:MOST]:
        joint = None if cause.joint is None else arm.robot.joint_names[cause.joint]
        joint = linear_names(arm) if cause.kind == "linear" else joint
        detail = (
            f"{arm.name}: proved impossible from every allowed base in any one posture; {_what(cause, joint)} in "
            f"{100.0 * share:.0f} % of all places and postures"
            f"{if_meant(PairClass.ARM_PART) if cause.kind == 'part' else ''}"
        )
        reasons.append(Reason(arm.name, KINDS.get(cause.kind, "collision"), (), detail, joint))
    return tuple(reasons)


def _what(cause: Cause, joint: str | None) -> str:
    """What is wrong, as a clause."""
    return {
        "reach": "a pose is out of reach",
        "limit": f"{joint} would have to exceed its limits",
        "linear": f"{joint} would have to exceed its limits",
        "path": f"{joint} cannot follow within the largest step",
        "singularity": f"the wrist is too near to its singularity at {joint}",
        "floor": "the base would not stand on the allowed floor",
        "conditioning": "the smallest conditioning is not kept",
        "obstacle": f"the arm does not keep its distance from {cause.name!r}",
        "part": "the arm does not keep its distance from the part",
        "self": f"{cause.name} come too near to each other",
    }.get(cause.kind, "no yaw is left to the base among floor and obstacles")


def _of_pair(cell: Cell, pair: PairTree) -> Reason:
    one, other = (cell.arms[arm].name for arm in pair.arms)
    kind = "coupling" if pair.untied > pair.apart else "collision"
    detail = (
        f"proved impossible: {one} and {other} each have a place by themselves, but no two places go together "
        f"({pair.looked_at} pairs of regions were looked at; couplings exclude {pair.untied}, contact {pair.apart})"
    )
    return Reason("", kind, (), detail)
