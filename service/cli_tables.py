"""Tables for people: millimetres and degrees."""

from __future__ import annotations

from collections.abc import Sequence
from math import degrees
from typing import IO, Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from models.errors import UnknownRobot
from service.cli import Exit
from service.cli_input import complain
from service.issues import Issue
from service.robots import robot_document, robot_list

NONE = "-"
PLAIN_WIDTH = 160
"""Columns where the output is no terminal."""


def console_on(file: IO[str] | None = None) -> Console:
    """A console that does not fold tables in files and pipes."""
    console = Console(file=file, highlight=False, soft_wrap=False)
    return console if console.is_terminal else Console(file=file, highlight=False, width=PLAIN_WIDTH)


def print_layout(resource: dict[str, Any], file: IO[str]) -> None:
    """Where the bases go, how near the joints come to their limits, and why not where not."""
    console, result = console_on(file), resource["result"]
    console.print(f"[bold]{escape(_headline(resource))}[/]")
    if result["arms"]:
        console.print(_placements(result["arms"]))
        console.print(_margins(result["arms"]))
    if len(result["jobs"]) > 1:
        console.print(_jobs(result["jobs"]))
    for reason in result["reasons"]:
        console.print(f"  {reason['detail']}", markup=False)
    console.print(_evidence(result), markup=False)


def _headline(resource: dict[str, Any]) -> str:
    result = resource["result"]
    name = f"{resource['name']}: " if resource["name"] else ""
    objective = "" if result["objective"] is None else f", objective {result['objective']:.4f}"
    proof = " (proved)" if result["proved"] else ""
    return f"{name}{result['outcome']}{proof}{objective}"


WORDS = ("arm", "posture", "name", "model", "joint", "job")
"""Headings of columns that hold words; the others hold numbers."""


def _table(title: str, headings: Sequence[str]) -> Table:
    """A table without rows."""
    table = Table(title=escape(title) or None, title_justify="left")
    for heading in headings:
        table.add_column(escape(heading), justify="left" if heading in WORDS else "right")
    return table


def _placements(arms: list[dict[str, Any]]) -> Table:
    headings = ("arm", "x [mm]", "y [mm]", "z [mm]", "yaw [°]", "posture", "objective", "conditioning")
    table = _table("Placements", headings)
    for arm in arms:
        x, y, z = (f"{1000.0 * value:.2f}" for value in arm["base"]["position"])
        posture = " ".join((arm["posture"] or {}).values()) or NONE
        yaw = f"{degrees(arm['base']['yaw']):.3f}"
        numbers = (_number(arm["objective"], 4), _number(arm["minimum_conditioning"], 3))
        table.add_row(escape(arm["name"]), x, y, z, yaw, posture, *numbers)
    return table


def _margins(arms: list[dict[str, Any]]) -> Table:
    joints = max(len(arm["joint_margins"]) for arm in arms)
    headings = ("arm", *(f"joint {index + 1}" for index in range(joints)), "smallest")
    table = _table("Smallest distance to a joint limit [°]", headings)
    for arm in arms:
        margins = [_degrees(margin) for margin in arm["joint_margins"]]
        empty = [""] * (joints - len(margins))
        table.add_row(escape(arm["name"]), *margins, *empty, _degrees(arm["minimum_margin"]))
    return table


def _jobs(jobs: list[dict[str, Any]]) -> Table:
    table = _table("Jobs", ("job", "poses", "weight", "objective"))
    for job in jobs:
        last = job["first_pose"] + job["poses"] - 1
        poses = f"{job['first_pose']} to {last}"
        table.add_row(escape(job["name"]), poses, f"{job['weight']:g}", _number(job["objective"], 4))
    return table


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
        lines.append(f"verified: {errors}, largest joint step {step:.1f}°, limits {limits}")
    if (proof := result["certificate"]) is not None and proof["lower_bound"] is not None:
        gap = "" if proof["gap"] is None else f", gap {100.0 * proof['gap']:.2f} %"
        state = "proved" if proof["proved"] else "not proved"
        lines.append(f"certificate: lower bound {proof['lower_bound']:.4f}{gap}, {state}, {proof['wall_time']:.2f} s")
    lines += [
        f"{run['method']}: objective {_number(run['objective'], 4)}, {run['wall_time']:.2f} s"
        f"{'' if run['feasible'] else ', not feasible'}"
        for run in result["baselines"]
    ]
    return "\n".join(lines)


def print_robots() -> int:
    """All robots."""
    table = _table("", ("name", "model", "joints", "reach up to [mm]"))
    for robot in robot_list():
        table.add_row(robot["name"], robot["title"], str(robot["dof"]), f"{1000.0 * robot['reach']:.0f}")
    console_on().print(table)
    return Exit.SOLVED


def print_robot(name: str) -> int:
    """One robot."""
    try:
        robot = robot_document(name)
    except UnknownRobot as error:
        return complain([Issue("", error.detail, error.code)])
    console = console_on()
    console.print(f"[bold]{robot['name']}[/]: {robot['title'] or NONE} ({robot['maker'] or NONE})")
    table = _table("", ("joint", "lower [°]", "upper [°]", "reference [°]"))
    for joint in robot["joints"]:
        table.add_row(joint["name"], *(_degrees(joint[key]) for key in ("lower", "upper", "reference")))
    console.print(table)
    for label, text in (
        ("reach", f"{1000.0 * robot['reach']:.0f} mm at most"),
        ("frames", f"{robot['base_frame']} (base) to {robot['flange_frame']} (flange)"),
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


def _degrees(value: float | None) -> str:
    return NONE if value is None else f"{degrees(value):.1f}"


def _number(value: float | None, digits: int) -> str:
    return NONE if value is None else f"{value:.{digits}f}"
