"""The floor plan of a layout: a drawing of the cell from above, in metres, as SVG, PDF or PNG.

Drawn are the path of the part with the grasps, every base with its yaw, the arms at the first, the middle and the last
pose of every segment, the region each base could be chosen from, the circle its flange cannot leave, and what else
stands there. The colours stay apart for the colour-blind; names stand beside every base, so that the drawing survives a
black-and-white printer too.
"""

from __future__ import annotations

from collections.abc import Mapping
from io import BytesIO
from math import degrees
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib import rc_context
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Circle, Rectangle
from matplotlib.patheffects import withStroke

from duocell.models.base.arrays import Floats
from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.kinematics.kinematics import carriage_ends, reach_sphere
from duocell.models.kinematics.link_frames import link_frames
from duocell.models.robot.arm import Arm, Interval
from duocell.models.robot.robot import Robot
from duocell.service.figure.figure_surroundings import draw_bodies, draw_floor, draw_obstacles
from duocell.service.library.library import Library
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.evaluate import EvaluateRequest
from duocell.service.schemas.request import LayoutRequest
from duocell.service.validation import validate

COLOURS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#56B4E9", "#E69F00")  # Okabe and Ito, without yellow and black
DASHES: tuple[Any, ...] = ("solid", (0, (5, 1.5)), (0, (1, 1)), (0, (5, 1, 1, 1)))
PART = "#333333"
SHARED = "#777777"
REACH = "reach of the flange at task height"
STYLE: Any = {  # keys of matplotlib's own list
    "font.size": 8.0,
    "axes.linewidth": 0.6,
    "svg.hashsalt": "duocell",  # the same layout gives the same file
    "svg.fonttype": "none",
    "font.family": "sans-serif",
    "text.parse_math": False,  # a dollar sign in a name is a dollar sign
}


def write_figure(resource: Mapping[str, Any], path: Path, library: Library | None = None) -> None:
    """Draw a solved layout into a file; its suffix (.svg, .pdf, .png) chooses the format. See `drawn_figure`."""
    path.write_bytes(drawn_figure(resource, path.suffix.removeprefix("."), library))


def drawn_figure(resource: Mapping[str, Any], form: str, library: Library | None = None) -> bytes:
    """Draw a solved layout.

    Args:
        resource: a layout as `GET /v1/layouts/{id}` answers it: ``request`` and ``result`` are used.
        form: svg, pdf or png.
        library: where robots come from that the catalogue does not hold.

    Returns:
        The file.

    Raises:
        InvalidRequest: the request inside cannot be used.
        KeyError: request or result is missing.
        ValueError: matplotlib does not know the format.

    Not safe to call from several threads at once: matplotlib's settings are global.
    """
    cell = cell_of(_request(resource["request"]), library)
    file = BytesIO()
    with rc_context(STYLE):
        figure = draw_layout(cell, resource["result"])
        # The same layout gives the same file, on any day.
        dated = {"svg": "Date", "pdf": "CreationDate"}.get(form)
        figure.savefig(file, format=form, dpi=160, bbox_inches="tight", metadata={dated: None} if dated else None)
    return file.getvalue()


def _request(document: Mapping[str, Any]) -> LayoutRequest:
    """The request of a layout that was asked for, or of one that was evaluated."""
    evaluated = any("joints" in arm for arm in document["arms"])
    return validate(EvaluateRequest if evaluated else LayoutRequest, document)


def draw_layout(cell: Cell, result: Mapping[str, Any]) -> Figure:
    """The floor plan of a result.

    Args:
        cell: what was asked.
        result: the ``result`` of a layout, see the contract; arms without a placement are drawn by their region only.
    """
    figure = Figure(figsize=(7.2, 7.2))
    axes = figure.add_subplot()
    placed = {arm["name"]: arm for arm in result["arms"]}
    draw_floor(axes, cell)
    draw_obstacles(axes, cell)
    _draw_regions(axes, cell)
    for index, arm in enumerate(cell.arms):
        if arm.name in placed:
            _draw_arm(axes, cell, arm, placed[arm.name], COLOURS[index % len(COLOURS)])
    _draw_part(axes, cell)
    _set_up(axes, cell, result)
    return figure


def arm_points(robot: Robot, joints: Floats, tool: Floats) -> Floats:
    """The points that a stick figure of an arm joins: base origin, joint frames, flange, tool centre point.

    Args:
        robot: the chain.
        joints: (k, n) rad or m.
        tool: (4, 4) tool centre point in the flange frame.

    Returns:
        (k, n + 3, 3) m in the base frame.
    """
    frames = link_frames(robot, joints)
    flange = frames[:, -1] @ robot.flange_placement
    points: Floats = np.concatenate([frames, flange[:, None], (flange @ tool)[:, None]], axis=1)[:, :, :3, 3]
    return points


def _shown_poses(task: Task) -> list[int]:
    """First, middle and last of every segment."""
    return sorted(
        {
            pose
            for segment in task.segments
            for pose in (segment.start, (segment.start + segment.stop) // 2, segment.stop - 1)
        }
    )


def _draw_regions(axes: Axes, cell: Cell) -> None:
    """The rectangles the bases could be chosen from, once for arms that share one; none where x and y are fixed."""
    shared: dict[tuple[Interval, Interval], list[int]] = {}
    for index, arm in enumerate(cell.arms):
        if not (arm.base.x.fixed and arm.base.y.fixed):
            shared.setdefault((arm.base.x, arm.base.y), []).append(index)
    for (x, y), arms in shared.items():
        dash = DASHES[arms[0] % len(DASHES)]
        colour = COLOURS[arms[0] % len(COLOURS)] if len(arms) == 1 else SHARED
        label = f"allowed for the base of {', '.join(cell.arms[index].name for index in arms)}"
        axes.add_patch(Rectangle((x.low, y.low), x.width, y.width, fill=False, ec=colour, lw=0.8, ls=dash, label=label))


def _draw_arm(axes: Axes, cell: Cell, arm: Arm, placed: Mapping[str, Any], colour: str) -> None:
    """Base, yaw, reach and the arm at some poses."""
    position, yaw = np.array(placed["base"]["position"]), float(placed["base"]["yaw"])
    base_in_world = arm.base_in_world(position, yaw)
    joints = np.array(placed["joints"])
    shown = _shown_poses(cell.task)
    middles = [(segment.start + segment.stop) // 2 for segment in cell.task.segments]
    points_in_base = arm_points(arm.robot, joints[shown], arm.tool)
    points = points_in_base @ base_in_world[:3, :3].T + position
    for index, line in zip(shown, points, strict=True):
        middle = index in middles
        style: dict[str, Any] = (
            {"lw": 2.6, "alpha": 0.95, "ms": 3.4} if middle else {"lw": 1.3, "alpha": 0.4, "ms": 2.0}
        )
        label = f"{arm.name}: {arm.robot.name}" if index == middles[0] else None
        axes.plot(*line[:, :2].T, color=colour, marker="o", solid_capstyle="round", zorder=4, label=label, **style)
    _draw_reach(axes, cell, arm, base_in_world, colour)
    pedestal = cell.surroundings.of(arm.name).pedestal
    if pedestal is not None:
        draw_bodies(axes, [pedestal.under(float(position[2])).body], base_in_world, colour, alpha=0.3, zorder=3)
    _draw_base(axes, base_in_world, colour)
    _draw_numbers(axes, cell, arm, base_in_world, yaw, colour)


def _draw_base(axes: Axes, base_in_world: Floats, colour: str) -> None:
    """A disc with a cross at the origin of the base frame, and the direction of its x axis."""
    x, y = base_in_world[:2, 3]
    axes.add_patch(Circle((x, y), 0.075, fc="white", ec=colour, lw=1.6, zorder=5))
    tip = (x + 0.26 * base_in_world[0, 0], y + 0.26 * base_in_world[1, 0])
    arrow = {"arrowstyle": "-|>", "color": colour, "lw": 1.4, "shrinkA": 0.0, "shrinkB": 0.0}
    axes.annotate("", xy=tip, xytext=(x, y), arrowprops=arrow, zorder=8)
    axes.plot([x], [y], marker="+", ms=7.0, color=colour, zorder=8)


def _draw_numbers(axes: Axes, cell: Cell, arm: Arm, base_in_world: Floats, yaw: float, colour: str) -> None:
    """What one needs to drill the holes: above or below the base, whichever looks away from the task."""
    position = base_in_world[:3, 3]
    up = 1.0 if position[1] > np.mean(cell.task.poses[:, 1, 3]) else -1.0
    clear_of_arrow = 36.0 if up * base_in_world[1, 0] > 0.3 else 15.0  # points
    x, y, z = position
    axes.annotate(
        f"{arm.name}\nx {x:.3f}  y {y:.3f}  z {z:.3f} m\nyaw {degrees(yaw):.1f}°",
        xy=(x, y),
        xytext=(0.0, up * clear_of_arrow),
        textcoords="offset points",
        ha="center",
        va="bottom" if up > 0.0 else "top",
        bbox={"fc": "white", "ec": colour, "lw": 0.5, "alpha": 0.85, "pad": 2.5},
        zorder=7,
    )


def _draw_reach(axes: Axes, cell: Cell, arm: Arm, base_in_world: Floats, colour: str) -> None:
    """Where the flange's ball of reach cuts the mean height of the poses its flange takes; on a linear axis from both
    of its ends, with the way of the carriage between them.
    """
    centre, radius = reach_sphere(arm.robot)
    feet = np.zeros((1, 3))
    turned = base_in_world[:3, :3]
    if arm.robot.slides:
        feet = carriage_ends(arm.robot, arm.travel)
        way = feet @ turned.T + base_in_world[:3, 3]
        axes.plot(*way[:, :2].T, color=colour, lw=6.0, alpha=0.25, solid_capstyle="butt", zorder=2)
        turned = turned @ arm.robot.joint_placements[0][:3, :3]
    for foot in feet:
        x, y, z = base_in_world[:3, :3] @ foot + turned @ centre + base_in_world[:3, 3]
        height = float(np.mean(cell.flange_targets(arm)[:, 2, 3])) - z
        ring = float(np.sqrt(max(radius**2 - height**2, 0.0)))
        named = any(patch.get_label() == REACH for patch in axes.patches)
        label = None if named else REACH
        axes.add_patch(Circle((x, y), ring, fc=colour, ec="none", alpha=0.05, zorder=0))
        axes.add_patch(Circle((x, y), ring, fill=False, ec=colour, lw=0.6, ls=(0, (1, 3)), zorder=1, label=label))


def _draw_part(axes: Axes, cell: Cell) -> None:
    """The way of the object's origin in every segment, and what the grasps span at some poses."""
    poses = cell.task.poses
    grasps = np.stack([poses @ cell.grasps(arm) for arm in cell.arms])[:, :, :2, 3]  # (arms, m, 2)
    for index in _shown_poses(cell.task):
        held = np.concatenate([grasps[:1, index], poses[None, index, :2, 3], grasps[1:, index]])
        axes.plot(*held.T, color=PART, lw=5.0, alpha=0.25, solid_capstyle="round", zorder=3)
        if cell.surroundings.part is not None:
            draw_bodies(axes, cell.surroundings.part.bodies, poses[index], PART, alpha=0.2, zorder=3)
    for segment in cell.task.segments:
        x, y = poses[segment, 0, 3], poses[segment, 1, 3]
        label = "part: poses of its origin" if segment.start == 0 else None
        axes.plot(x, y, color=PART, lw=1.0, marker="o", ms=2.6, zorder=8, label=label)
        for index, neighbour in ((0, 1), (-1, -2)):
            _number_pose(axes, segment, np.stack([x, y], axis=-1), index, neighbour)


def _number_pose(axes: Axes, segment: slice, places: Floats, index: int, neighbour: int) -> None:
    """The number of an end of a segment (m, 2), written beyond it."""
    outward = places[index] - places[neighbour]
    length = float(np.linalg.norm(outward))
    offset = 9.0 * outward / length if length > 0.0 else np.array([9.0, 9.0]) * (1.0 if index else -1.0)
    axes.annotate(
        str(segment.start + index % len(places)),  # counted from 0 through all segments, as reasons and joints are
        (places[index, 0], places[index, 1]),
        xytext=(offset[0], offset[1]),
        textcoords="offset points",
        ha="center",
        va="center",
        color=PART,
        zorder=9,
        path_effects=[withStroke(linewidth=2.0, foreground="white")],
    )


def _set_up(axes: Axes, cell: Cell, result: Mapping[str, Any]) -> None:
    """Scale, grid, title, legend."""
    placed = {arm["name"] for arm in result["arms"]}
    _choose_view(axes, [arm for arm in cell.arms if arm.name not in placed])
    axes.set_axisbelow(True)
    axes.grid(visible=True, color="#dddddd", lw=0.4)
    axes.set_xlabel("x [m]")
    axes.set_ylabel("y [m]")
    value = "" if result.get("objective") is None else f", E = {result['objective']:.2f}"
    axes.set_title(f"{cell.name or 'layout'}: {result['outcome']}{value}  (from above)", loc="left", fontsize=9.5)
    columns = max(1, min(3, len(cell.arms) + 1))
    axes.legend(loc="upper left", bbox_to_anchor=(0.0, -0.09), ncols=columns, frameon=False, fontsize=7.0)


def _choose_view(axes: Axes, unplaced: list[Arm]) -> None:
    """A square around the task, the placed arms with their reach, and the regions in which an arm found no place.

    The region of a placed arm may run out of the picture.
    """
    patches = [patch for patch in axes.patches if isinstance(patch, Circle)]
    rings = [np.asarray(p.get_extents().transformed(axes.transData.inverted()).get_points()) for p in patches]
    regions = [arm.base.bounds[:2].T for arm in unplaced]
    points = np.vstack([*rings, *regions, *(np.asarray(line.get_xydata()) for line in axes.lines)])
    low, high = points.min(axis=0), points.max(axis=0)
    middle, half = 0.5 * (low + high), 0.54 * max(float(np.max(high - low)), 0.5)
    axes.set_xlim(middle[0] - half, middle[0] + half)
    axes.set_ylim(middle[1] - half, middle[1] + half)
    axes.set_aspect("equal", adjustable="box")
