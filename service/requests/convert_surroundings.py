"""What stands in a cell besides its arms, as objects of the models."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.floor import Floor as ModelFloor
from duocell.models.cell.surroundings import Clearances, Equipment, Surroundings
from duocell.models.cell.surroundings import Part as ModelPart
from duocell.models.cell.surroundings import Pedestal as ModelPedestal
from duocell.models.geometry.shapes import Body
from duocell.models.robot.robot import Robot
from duocell.service.common.issues import IssueCollector
from duocell.service.library.library import Library
from duocell.service.requests.convert_shapes import NO_MESHES, MeshSource, footprint_of, obstacles_of, solids_of
from duocell.service.schemas.arm import FLOOR_MOUNT, Arm
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.surroundings import Clearance, Floor, Part, Pedestal
from duocell.service.validation.range_limits import as_list

SAME_HEIGHT = 1e-3
"""m by which a pedestal and its base may differ in height: people round to millimetres."""
CONTACT_FORBIDDEN = Clearances(0.0, 0.0, 0.0, 0.0, 0.0)


def surroundings_of(
    request: LayoutRequest, robots: Sequence[Robot | None], library: Library | None, issues: IssueCollector
) -> Surroundings | None:
    """Everything around the arms, and the shape of arms that users brought; None if issues had to be noted.

    Args:
        request: a valid request.
        robots: those of its arms; None for an arm that left an issue.
        library: what users brought.
        issues: where to note what is wrong.
    """
    meshes: MeshSource = NO_MESHES if library is None else library
    before = len(issues.found)
    obstacles = obstacles_of(request.obstacles, meshes, issues)
    part = None if request.part is None else _part(request.part, meshes, issues)
    floor = None if request.floor is None else _floor(request.floor, issues)
    equipment = {
        arm.name: _equipment(arm, _flange(arm, robot), f"/arms/{index}", meshes, issues)
        for index, (arm, robot) in enumerate(zip(request.arms, robots, strict=True))
    }
    if len(issues.found) > before:
        return None
    if library is not None:
        for arm in request.arms:
            links = None if arm.robot_key is None else library.links(arm.robot_key)
            equipment[arm.name] = replace(equipment[arm.name], links=links)
    with issues.at(""):
        return Surroundings(obstacles, part, floor, clearances_of(request), equipment)
    return None


def clearances_of(request: LayoutRequest) -> Clearances:
    """The distances to keep: those asked for; else contact is forbidden as soon as any body is described.

    Classes without any pair of bodies are left out: nothing can be said about them.
    """
    asked: Clearance | None = request.clearance
    if asked is None:
        wanted = CONTACT_FORBIDDEN if _describes_bodies(request) else Clearances()
    else:
        wanted = Clearances(asked.arm_arm, asked.arm_part, asked.arm_obstacle, asked.part_obstacle, asked.self)
    part, obstacles = request.part is not None, bool(request.obstacles)
    return Clearances(
        arm_arm=wanted.arm_arm if len(request.arms) > 1 else None,
        arm_part=wanted.arm_part if part else None,
        arm_obstacle=wanted.arm_obstacle if obstacles else None,
        part_obstacle=wanted.part_obstacle if part and obstacles else None,
        self_collision=wanted.self_collision,
    )


def _describes_bodies(request: LayoutRequest) -> bool:
    """True if the request says how anything looks that an arm could hit or be hit with."""
    equipped = any(arm.tool_shapes or arm.pedestal is not None for arm in request.arms)
    return equipped or bool(request.obstacles) or request.part is not None


def _part(part: Part, meshes: MeshSource, issues: IssueCollector) -> ModelPart | None:
    bodies = solids_of(part.shapes, "part", "/part/shapes", meshes, issues)
    numbered = [Body(f"part {i + 1}" if len(bodies) > 1 else "part", b.pose, b.shape) for i, b in enumerate(bodies)]
    with issues.at("/part"):
        return ModelPart(tuple(numbered), part.grasp_zone)
    return None


def _floor(floor: Floor, issues: IssueCollector) -> ModelFloor | None:
    with issues.at("/floor"):
        allowed = None if floor.allowed is None else np.array(floor.allowed)
        return ModelFloor(allowed, tuple(np.array(corners) for corners in floor.forbidden), floor.margin)
    return None


def _flange(arm: Arm, robot: Robot | None) -> Floats:
    """(4, 4) m, the flange of an arm in the last frame of its robot, which is the one that models attach tools to."""
    if robot is None or (arm.flange is not None and arm.flange not in robot.flange_names):
        return np.eye(4)  # an issue of the arm's own
    return robot.flange(arm.flange)


def _equipment(arm: Arm, flange: Floats, pointer: str, meshes: MeshSource, issues: IssueCollector) -> Equipment:
    solids = solids_of(arm.tool_shapes, "tool", f"{pointer}/tool_shapes", meshes, issues)
    return Equipment(
        tool=tuple(replace(solid, pose=flange @ solid.pose) for solid in solids),
        pedestal=None if arm.pedestal is None else _pedestal(arm, arm.pedestal, f"{pointer}/pedestal", issues),
        footprint=None if arm.footprint is None else footprint_of(arm.footprint, f"{pointer}/footprint", issues),
    )


def _pedestal(arm: Arm, pedestal: Pedestal, pointer: str, issues: IssueCollector) -> ModelPedestal | None:
    footprint = footprint_of(pedestal.footprint, f"{pointer}/footprint", issues)
    found = _upright(arm, pedestal, pointer, issues) if arm.mount == FLOOR_MOUNT else _tilted(pedestal, pointer, issues)
    with issues.at(pointer):
        return None if footprint is None or found is None else ModelPedestal(found[0], footprint, found[1])
    return None


def _tilted(pedestal: Pedestal, pointer: str, issues: IssueCollector) -> tuple[float, None] | None:
    """Height [m] of a pedestal that stands out from a wall, a ceiling or a slope: there it needs one."""
    if pedestal.foot is not None:
        issues.add(f"{pointer}/foot", "The base hangs or leans, so its pedestal has no foot on a floor. Leave it out.")
    elif pedestal.height is None:
        issues.add(f"{pointer}/height", "The base hangs or leans, so the height of its pedestal is not known. Send it.")
    else:
        return pedestal.height, None
    return None


def _upright(arm: Arm, pedestal: Pedestal, pointer: str, issues: IssueCollector) -> tuple[float, float | None] | None:
    """Height and foot [m] of a pedestal on a floor; the foot is None where a height is given, which then has to fit."""
    foot = 0.0 if pedestal.foot is None else pedestal.foot
    low, high = min(as_list(arm.base.z)), max(as_list(arm.base.z))
    if pedestal.height is None:
        if low > foot:
            return high - foot, foot
        where = f"stands at z = {low:g} m" if low == high else f"may stand as low as z = {low:g} m"
        advice = f"Keep z above {foot:g} m, send the foot if it stands lower, or leave the pedestal out."
        detail = f"The pedestal reaches from z = {foot:g} m to the base, which {where}. {advice}"
        issues.add(f"{pointer}/height", detail)
        return None
    top = foot + pedestal.height
    if low == high and abs(low - top) <= SAME_HEIGHT:
        return pedestal.height, None
    where = f"stands at z = {low:g} m" if low == high else f"may stand at z = {low:g} to {high:g} m"
    detail = f"A pedestal of {pedestal.height:g} m that stands at z = {foot:g} m ends at {top:g} m; the base {where}. "
    if low - SAME_HEIGHT <= foot + pedestal.height / 1e3 <= high + SAME_HEIGHT:
        detail += f"Did you mean {pedestal.height / 1e3:g} m ({pedestal.height:g} mm)?"
    elif low < high and low - SAME_HEIGHT <= top <= high + SAME_HEIGHT:
        detail += f"Fix z at {top:g} m, or leave the height out: the pedestal then is as high as the base stands."
    elif low == high and low > pedestal.height:
        detail += f"Leave the height out, or send what it stands on: a foot of {low - pedestal.height:g} m."
    else:
        detail += "Leave the height out: the pedestal then is as high as the base stands."
    issues.add(f"{pointer}/height", detail)
    return None
