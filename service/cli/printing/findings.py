"""Tables of what was found out about a layout in a real cell."""

from __future__ import annotations

from math import degrees
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Table

from duocell.service.cli.printing.console import NONE, in_degrees, in_millimetres, number, table


def print_findings(console: Console, result: dict[str, Any]) -> None:
    """Clearances, alternatives, tolerance and explanation, as far as a result has them."""
    if any(result["clearances"].values()):
        console.print(_clearances(result["clearances"]))
    if result["alternatives"]:
        console.print(_alternatives(result["alternatives"]))
        for index, alternative in enumerate(result["alternatives"]):
            console.print(f"  {index + 1}: {alternative['note']}", markup=False)
    for line in [*_tolerance(result["tolerance"]), *_explanation(result["explanation"])]:
        console.print(line, markup=False)


def _clearances(clearances: dict[str, Any]) -> Table:
    headings = ("class", "required [mm]", "smallest [mm]", "at least [mm]", "nearest pair", "where")
    rows = table("Clearances along the whole path", headings)
    for kind, found in clearances.items():
        if found is not None:
            lengths = (in_millimetres(found[key]) for key in ("required", "distance", "lower_bound"))
            where = f"pose {found['pose'] + found['fraction']:.2f}" + ("" if found["certain"] else " (not certain)")
            rows.add_row(kind, *lengths, escape(" and ".join(found["pair"])), where)
    return rows


def _alternatives(alternatives: list[dict[str, Any]]) -> Table:
    headings = ("layout", "objective", "arm", "x [mm]", "y [mm]", "z [mm]", "yaw [°]", "posture", "margin [°]")
    rows = table("Other layouts", headings)
    for index, alternative in enumerate(alternatives):
        for place, arm in enumerate(alternative["arms"]):
            first = (str(index + 1), number(alternative["objective"], 4)) if place == 0 else ("", "")
            x, y, z = (f"{1000.0 * value:.2f}" for value in arm["base"]["position"])
            yaw = f"{degrees(arm['base']['yaw']):.3f}"
            posture = " ".join((arm["posture"] or {}).values()) or NONE
            rows.add_row(*first, escape(arm["name"]), x, y, z, yaw, posture, in_degrees(arm["minimum_margin"]))
    return rows


def _tolerance(tolerance: dict[str, Any] | None) -> list[str]:
    """What installation errors leave."""
    if tolerance is None:
        return []
    off = f"{in_millimetres(tolerance['position'])} mm and {degrees(tolerance['angle']):.2f}°"
    share = f"{100.0 * tolerance['feasible']:.0f} % of {tolerance['samples']} samples"
    left = f"margin at least {in_degrees(tolerance['margin'])}°"
    largest = f"feasible up to {number(tolerance['largest'], 2)} times that"
    return [f"tolerance: bases off by up to {off}: {share} feasible, {left}; {largest}. {tolerance['note']}"]


def _explanation(explanation: dict[str, Any] | None) -> list[str]:
    """What blocks the cell, and what would help."""
    if explanation is None:
        return []
    needed = "each of them is needed for that" if explanation["irreducible"] else "not all may be needed"
    lines = [f"these by themselves leave no layout ({needed}):", *(f"  {one}" for one in explanation["blocking"])]
    if explanation.get("behind"):
        lines += ["and without them these would not either:", *(f"  {one}" for one in explanation["behind"])]
    if explanation["relaxations"]:
        lines.append("what would help:")
    lines += [
        f"  {change['what']} ({change['pointer']}): objective {number(change['objective'], 4)}"
        for change in explanation["relaxations"]
    ]
    return lines
