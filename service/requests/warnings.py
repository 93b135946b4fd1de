"""What may be a slip in a request that can be carried out: units, tools, grasps, frames; told beside the result."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees, radians

import numpy as np

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.kinematics.branches import path_signs
from duocell.models.kinematics.closed_form import closed_form
from duocell.models.robot.arm import Arm as ModelArm
from duocell.models.robot.joint import in_words
from duocell.optimizer.nlp.program import ArmSolution
from duocell.optimizer.results.layout import Layout
from duocell.optimizer.verification.arm_path import check_arm_path
from duocell.optimizer.verification.words import between
from duocell.service.common.issues import MOST_SHOWN, Issue
from duocell.service.requests.body_warnings import FAR, body_warnings, region_warnings
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation.range_limits import angles_of, lengths_of

WHOLE = 10.0
"""rad; a whole number beyond it is rather one of degrees."""
FAR_GRASP = 2.0
"""m, from the origin of the object; nobody holds a part there."""
ALONG = 1.0 - 1e-6
"""Cosine of the angle between two axes that count as one."""


def warnings_of(request: LayoutRequest, cell: Cell, layout: Layout) -> list[Issue]:
    """Warnings, each with its place in the request.

    Args:
        request: as accepted. cell: that it describes. layout: the answer.
    """
    found = [*_lengths(request), *body_warnings(request), *_angles(request, cell), *region_warnings(cell, layout)]
    for index, (asked, arm) in enumerate(zip(request.arms, cell.arms, strict=True)):
        found += _hand(f"/arms/{index}", asked.tool.position, asked.grasp.position)
        found += _flange(f"/arms/{index}", asked.flange, arm)
        found += _overshoots(f"/arms/{index}/limits", cell, arm, layout)
    return found[:MOST_SHOWN]


def _lengths(request: LayoutRequest) -> Iterator[Issue]:
    """The largest coordinate, if it may be in millimetres."""
    far = [(at, max(values, key=abs)) for at, values in lengths_of(request, FAR)]
    if far:
        pointer, value = max(far, key=lambda one: abs(one[1]))
        yield Issue(pointer, f"{value:g} m is far for a cell. Did you mean {value / 1e3:g} m ({value:g} mm)?")


def _angles(request: LayoutRequest, cell: Cell) -> Iterator[Issue]:
    """Whole numbers that are more likely degrees; one warning for each list."""
    for pointer, values in angles_of(request, [arm.robot.slides for arm in cell.arms]):
        whole = [value for value in values if abs(value) >= WHOLE and value == round(value)]
        if whole:
            value = whole[0]
            meant = f"Did you mean {radians(value):.6g} rad ({value:g}°)?"
            yield Issue(pointer, f"{value:g} rad are {degrees(value):.0f}°. {meant}")


def _hand(pointer: str, tool: list[float], grasp: list[float]) -> Iterator[Issue]:
    """Tools without a length, and grasps far from the part."""
    if not any(tool):
        yield Issue(f"{pointer}/tool", "The tool has no length: the arm holds the part with its bare flange.")
    far = float(np.linalg.norm(grasp))
    if far > FAR_GRASP:
        detail = f"The TCP is {far:.3g} m away from the origin of the object. Is it given in the object frame?"
        yield Issue(f"{pointer}/grasp/position", detail)


def _overshoots(pointer: str, cell: Cell, arm: ModelArm, layout: Layout) -> Iterator[Issue]:
    """Joints that pass their limits by less than what makes a layout unusable, between poses that keep them."""
    whole = len(cell.task)
    placed = [p for p in layout.placements if p.arm == arm.name and layout.usable and len(p.joints) == whole]
    for one in placed:
        form = closed_form(arm.robot)
        signs = None if form is None else path_signs(form, one.joints)
        for excess in check_arm_path(cell, arm, ArmSolution(one.position, one.yaw, one.joints, signs)).excesses:
            detail = (
                f"{excess.joint} passes its limit by {in_words(excess.amount, excess.unit)} "
                f"{between(excess.pose, excess.fraction)}, where the part goes straight. Add a pose there if it has to."
            )
            yield Issue(pointer, detail)


def _flange(pointer: str, name: str | None, arm: ModelArm) -> Iterator[Issue]:
    """Frames of the flange that tools do not expect: z does not point out of it.

    Out is z of the usual frame where the catalogue has one; else the last axis, whose sense says nothing.
    """
    robot = arm.robot
    axis: Floats = robot.flange()[:3, 2] if robot.flanges else robot.flange_placement[:3, :3].T @ robot.joint_axes[-1]
    out = robot.flange(name)[:3, :3].T @ axis
    if (out[2] if robot.flanges else abs(out[2])) < ALONG:
        out = np.round(out, 3) + 0.0
        what = "which points out of it" if robot.flanges else "about which the flange turns"
        detail = (
            f"z of the flange frame {name or robot.flange_names[0]} of {robot.name} does not lie along the axis "
            f"{what}: that is [{out[0]:g}, {out[1]:g}, {out[2]:g}] there. A tool made for another robot is turned here."
        )
        yield Issue(f"{pointer}/robot" if name is None else f"{pointer}/flange", detail)
