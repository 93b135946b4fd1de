"""What is wrong with a given layout: for every rule that it breaks a reason with the place and the amount."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.base.kept import KEPT
from duocell.models.cell.cell import Cell
from duocell.models.cell.one_place import NEAREST, in_one_place
from duocell.models.collision.collision import Contact
from duocell.models.robot.arm import Arm
from duocell.optimizer.clearance.clearance import ClassClearance, PathClearance
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.reasons.meant_contact import if_meant
from duocell.optimizer.reasons.reasons import explain_path
from duocell.optimizer.results.layout import Reason
from duocell.optimizer.verification.scene import world_yaw
from duocell.optimizer.verification.verify import LIMITS, ORIENTATION, POSITION, SIDE, ArmCheck
from duocell.optimizer.verification.words import arm_path_faults, between, poses_at

SLACK = KEPT
"""m or rad, of floor, couplings and limits between the poses: what a solver leaves, and rounding."""

TOUCHING = 0.05
"""mm, on either side."""


def arm_faults(cell: Cell, arm: Arm, point: ArmSolution, check: ArmCheck) -> tuple[Reason, ...]:
    """What an arm by itself breaks where it stands."""
    if check.usable and (point.signs is None or arm.posture.admits(point.signs)):
        return ()
    found = (
        *_pose_errors(arm, check),
        *explain_path(cell, arm, point.joints, np.zeros(len(point.joints)), "from this base"),
        *_posture(arm, point, check),
        *_conditioning(arm, check),
    )
    return found or (Reason(arm.name, "posture", (), f"{arm.name}: no usable path from this base"),)


def _pose_errors(arm: Arm, check: ArmCheck) -> tuple[Reason, ...]:
    """Joints that do not take the tool to where the part is."""
    reasons = []
    if check.position_error > POSITION:
        amount = check.position_error
        detail = f"{arm.name}: the joints take the TCP to a place {amount:.3g} m off its grasp at some pose"
        reasons.append(Reason(arm.name, "pose_error", (), detail, amount=amount, unit="m"))
    if check.orientation_error > ORIENTATION:
        amount = check.orientation_error
        detail = f"{arm.name}: the joints turn the TCP {np.degrees(amount):.3g}° off its grasp at some pose"
        reasons.append(Reason(arm.name, "pose_error", (), detail, amount=amount, unit="rad"))
    return tuple(reasons)


def _posture(arm: Arm, point: ArmSolution, check: ArmCheck) -> tuple[Reason, ...]:
    if np.isinf(check.posture) or (point.signs is not None and not arm.posture.admits(point.signs)):
        return (Reason(arm.name, "posture", (), f"{arm.name}: this is not the posture asked for"),)
    if check.posture > SIDE:
        detail = f"{arm.name}: the posture changes along the path, which passes a singularity"
        return (Reason(arm.name, "posture", (), detail),)
    return ()


def _conditioning(arm: Arm, check: ArmCheck) -> tuple[Reason, ...]:
    if check.conditioning <= LIMITS or arm.min_conditioning is None:
        return ()
    detail = (
        f"{arm.name}: from this base the conditioning falls to {arm.min_conditioning - check.conditioning:.3f}; "
        f"{arm.min_conditioning:g} is asked for"
    )
    return (Reason(arm.name, "conditioning", (), detail, amount=check.conditioning),)


# --- the floor and the other bases ------------------------------------------------------------------------------------


def floor_faults(cell: Cell, places: Sequence[Floats]) -> tuple[Reason, ...]:
    """Bases on floor that is not free.

    Args:
        cell: arms and floor.
        places: (4,) x, y, z [m], yaw [rad] of every arm.
    """
    floor, reasons = cell.surroundings.floor, []
    for arm, place in zip(cell.arms, places, strict=True):
        if floor is None:
            return ()
        footprint = cell.surroundings.footprint(arm.name)
        line = floor.half_plane(place[:2], footprint, float(world_yaw(arm, place[3])))
        if line is not None and line.distance < -SLACK:
            away = f"({line.normal[0]:z.2f}, {line.normal[1]:z.2f})"
            detail = (
                f"{arm.name}: its footprint and margin reach {-line.distance:.3f} m into {line.piece}; moving it that "
                f"far along {away} frees it"
            )
            reasons.append(Reason(arm.name, "floor", (), detail, amount=-line.distance, unit="m"))
    return tuple(reasons)


def coupling_faults(cell: Cell, places: Sequence[Floats]) -> tuple[Reason, ...]:
    """Couplings that the bases do not keep; arguments as for `floor_faults`."""
    reasons = []
    for coupling in cell.couplings:
        rows = coupling.rows([[float(value) for value in place] for place in places])
        names = [cell.arms[index].name for index in coupling.arms]
        for value, low, high, label in zip(rows.values, rows.lower, rows.upper, rows.labels, strict=True):
            amount = max(low - float(value), float(value) - high)
            if amount > SLACK:
                unit = "rad" if "yaw" in label else "m"
                allowed = f"{low:g}" if low == high else f"{low:g} to {high:g}"
                detail = (
                    f"{' and '.join(names)}: coupling {coupling.kind} ({label}) is {float(value):.4g} {unit}; "
                    f"allowed is {allowed}"
                )
                reasons.append(Reason(names[0], "coupling", (), detail, amount=amount, unit=unit))
    return tuple(reasons)


def place_faults(cell: Cell, places: Sequence[Floats]) -> tuple[Reason, ...]:
    """Arms that stand in one place; arguments as for `floor_faults`."""
    return tuple(
        Reason(
            cell.arms[first].name,
            "collision",
            (),
            f"{cell.arms[first].name} and {cell.arms[second].name} stand in one place: their bases are "
            f"{1e3 * apart:.1f} mm apart, and two bases need {1e3 * NEAREST:g} mm at least",
            amount=NEAREST - apart,
            unit="m",
        )
        for first, second, apart in in_one_place(cell.arms, [place[:3] for place in places])
    )


# --- the way between the poses ----------------------------------------------------------------------------------------


def path_faults(cell: Cell, path: PathClearance) -> tuple[Reason, ...]:
    """Bodies that come too near to each other, ways that cannot be followed, limits exceeded between the poses."""
    reasons = [_collision(cell, found) for found in path.classes if not found.clear]
    worst = path.worst_limit
    beyond = (worst,) if worst.amount > SLACK and 0.0 < worst.fraction < 1.0 else ()
    reasons += arm_path_faults(path.breaks, beyond)
    return tuple(reasons)


def _collision(cell: Cell, found: ClassClearance) -> Reason:
    """The closest pair of a class that is too near."""
    contact, gap = found.contact, 1e3 * found.distance
    how = f"come within {gap:.1f} mm of each other" if gap > 0.0 else f"penetrate by {-gap:.1f} mm"
    how = how if abs(gap) >= TOUCHING else "touch"
    wanted = f"; {1e3 * found.required:g} mm are asked for" if found.required > 0.0 else ""
    where = between(found.pose, found.fraction)
    detail = f"{contact.first} and {contact.second} {how} {where}{wanted}{if_meant(found.kind)}"
    poses = poses_at(found.pose, found.fraction)
    return Reason(_to_blame(cell, contact), "collision", poses, detail, None, found.required - found.distance, "m")


def _to_blame(cell: Cell, contact: Contact) -> str:
    """Name of the first arm concerned; "" where part and obstacles meet."""
    arms = [owner.arm for owner in (contact.first_owner, contact.second_owner) if owner.arm is not None]
    return cell.arms[arms[0]].name if arms else ""
