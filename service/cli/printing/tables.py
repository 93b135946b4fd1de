"""Tables for people: millimetres and degrees."""

from __future__ import annotations

from math import degrees
from typing import IO, Any

from rich.markup import escape
from rich.table import Table

from duocell.models.base.errors import UnknownRobot
from duocell.models.robot.joint import JointKind
from duocell.service.cli.exit_codes import Exit
from duocell.service.cli.input import complain
from duocell.service.cli.printing.console import (
    NONE,
    console_on,
    in_degrees,
    in_its_unit,
    in_millimetres,
    number,
    table,
)
from duocell.service.cli.printing.findings import print_findings
from duocell.service.common.issues import Issue
from duocell.service.library.library import Library
from duocell.service.library.robots import robot_document, robot_list


def print_layout(resource: dict[str, Any], file: IO[str]) -> None:
    """Where the bases go, how near the joints come to their limits, and why not where not."""
    console, result = console_on(file), resource["result"]
    console.print(f"[bold]{escape(_headline(resource))}[/]")
    if result["arms"]:
        seen = result["outcome"] in ("infeasible", "unknown")
        console.print(_placements(result["arms"], "Nearest placements that were seen" if seen else "Placements"))
        console.print(_margins(result["arms"]))
        for arm in result["arms"]:
            for row in arm.get("linear_margins") or ():  # results of older versions have none
                left = in_degrees(row["margin"])
                console.print(f"{arm['name']}: {row['name']} keeps {left}° to its limits", markup=False)
    if len(result["jobs"]) > 1:
        console.print(_jobs(result["jobs"]))
    print_findings(console, result)
    for reason in result["reasons"]:
        console.print(f"  {reason['detail']}", markup=False)
    for slip in result.get("warnings") or ():  # results of older versions have none
        console.print(f"warning: {slip['pointer']}: {slip['detail']}", markup=False)
    console.print(_evidence(result), markup=False)


def _headline(resource: dict[str, Any]) -> str:
    result = resource["result"]
    name = f"{resource['name']}: " if resource["name"] else ""
    objective = "" if result["objective"] is None else f", objective {result['objective']:.4f}"
    cut = " (cut by time)" if result["search"].get("ended") is False else ""
    return f"{name}{result['outcome']}{cut}{objective}"


def _placements(arms: list[dict[str, Any]], title: str) -> Table:
    headings = ("arm", "x [mm]", "y [mm]", "z [mm]", "yaw [°]", "posture", "objective", "conditioning")
    rows = table(title, headings)
    for arm in arms:
        x, y, z = (f"{1000.0 * value:.2f}" for value in arm["base"]["position"])
        posture = " ".join((arm["posture"] or {}).values()) or NONE
        yaw = f"{degrees(arm['base']['yaw']):.3f}"
        numbers = (number(arm["objective"], 4), number(arm["minimum_conditioning"], 3))
        rows.add_row(escape(arm["name"]), x, y, z, yaw, posture, *numbers)
    return rows


def _margins(arms: list[dict[str, Any]]) -> Table:
    joints = max(len(arm["joint_margins"]) for arm in arms)
    headings = ("arm", *(f"joint {index + 1}" for index in range(joints)), "smallest")
    rows = table("Smallest distance to a joint limit [°]", headings)
    for arm in arms:
        units = arm.get("joint_units") or len(arm["joint_margins"]) * ["rad"]  # older results have none
        margins = [in_its_unit(*pair) for pair in zip(arm["joint_margins"], units, strict=True)]
        empty = [""] * (joints - len(margins))
        rows.add_row(escape(arm["name"]), *margins, *empty, in_degrees(arm["minimum_margin"]))
    return rows


def _jobs(jobs: list[dict[str, Any]]) -> Table:
    rows = table("Jobs", ("job", "poses", "weight", "objective"))
    for job in jobs:
        last = job["first_pose"] + job["poses"] - 1
        poses = f"{job['first_pose']} to {last}"
        rows.add_row(escape(job["name"]), poses, f"{job['weight']:g}", number(job["objective"], 4))
    return rows


def _evidence(result: dict[str, Any]) -> str:
    """What speaks for the answer."""
    search, lines = result["search"], []
    lines.append(
        f"search: {search['candidates']} candidates, {search['starts']} starts, {search['basins']} basins, "
        f"{search['wall_time']:.3f} s"
    )
    if (check := result["verification"]) is not None:
        errors = f"{check['max_position_error']:.1e} m, {check['max_orientation_error']:.1e} rad"
        limits = "kept" if check["limits_respected"] else "NOT KEPT"
        step = degrees(check["max_joint_step"])
        shift = check.get("max_prismatic_step")
        along = "" if shift is None else f" and {in_millimetres(shift)} mm of a linear axis"
        lines.append(f"verified: {errors}, largest joint step {step:.1f}°{along}, limits {limits}")
    if (proof := result["certificate"]) is not None and proof["lower_bound"] is not None:
        gap = "" if proof["gap"] is None else f", gap {100.0 * proof['gap']:.2f} %"
        state = "proved" if proof["proved"] else "not proved"
        lines.append(f"certificate: lower bound {proof['lower_bound']:.4f}{gap}, {state}, {proof['wall_time']:.2f} s")
    lines += [
        f"{run['method']}: objective {number(run['objective'], 4)}, {run['wall_time']:.2f} s"
        f"{'' if run['feasible'] else ', not feasible'}"
        for run in result["baselines"]
    ]
    return "\n".join(lines)


def print_robots(library: Library) -> int:
    """All robots."""
    rows = table("", ("name", "model", "joints", "reach up to [mm]"))
    for robot in robot_list(library):
        rows.add_row(robot["name"], escape(robot["title"]), str(robot["dof"]), f"{1000.0 * robot['reach']:.0f}")
    console_on().print(rows)
    return Exit.SOLVED


def print_robot(name: str, library: Library) -> int:
    """One robot."""
    try:
        robot = robot_document(name, library)
    except UnknownRobot as error:
        return complain([Issue("", error.detail, error.code)])
    console = console_on()
    console.print(f"[bold]{robot['name']}[/]: {escape(robot['title'] or NONE)} ({robot['maker'] or NONE})")
    rows = table("", ("joint", "lower [°]", "upper [°]", "reference [°]"))
    for joint in robot["joints"]:
        unit = JointKind(joint["type"]).unit
        rows.add_row(escape(joint["name"]), *(in_its_unit(joint[k], unit) for k in ("lower", "upper", "reference")))
    console.print(rows)
    for label, text in (
        *(("limit between joints", _between(row)) for row in robot["linear_limits"]),
        ("reach", f"{1000.0 * robot['reach']:.0f} mm at most"),
        ("frames", f"{robot['base_frame']} (base) to {robot['flange_frame']} (last frame)"),
        *(("flange", _frame(frame)) for frame in robot["flanges"]),
        ("mounting face", _frame(robot["mounting_face"]) if robot["mounting_face"] else "not known"),
        ("shape of the links", robot["geometry"]),
        ("reference", robot["reference_source"]),
        ("inverse kinematics", robot["inverse_kinematics"]),
        *(
            (f"{key} {word}", meaning)
            for key, words in (robot["postures"] or {}).items()
            for word, meaning in words.items()
        ),
        ("source", robot["source"]),
        ("licence", robot["licence"]),
        *(("note", note) for note in robot["notes"]),
    ):
        console.print(f"{label}: {text}", markup=False)
    return Exit.SOLVED


def _between(row: dict[str, Any]) -> str:
    """A limit between joints in a line."""
    return f"{row['name']} from {in_degrees(row['lower'])}° to {in_degrees(row['upper'])}°"


def _frame(frame: dict[str, Any]) -> str:
    """A named frame in a line: where it is with all joints at zero, and who says so."""
    x, y, z = (f"{1000.0 * value:.1f}" for value in frame["pose"]["position"])
    checked = "" if frame["checked"] is None else f"; {frame['checked']}"
    return f"{frame['name']} at ({x}, {y}, {z}) mm: {frame['source']}{checked}"
