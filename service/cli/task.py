"""`duocell task`: a task from a file that somebody has."""

from __future__ import annotations

import json
import sys
from dataclasses import dataclass
from math import radians
from pathlib import PurePath

from duocell.models.task_files.found import ARC_TOLERANCE, Options
from duocell.models.task_files.reading import Resampling
from duocell.service.cli.exit_codes import Exit
from duocell.service.cli.input import complain, read
from duocell.service.cli.solve import check_writable
from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.schemas.uploads import ImportedTask, UnderstoodFile
from duocell.service.settings import Settings
from duocell.service.uploads.task_import import ANGLE_TOLERANCE, imported


@dataclass(frozen=True, slots=True)
class Given:
    """What is said about the file.

    Attributes:
        format, units, rotation, columns: see `duocell.models.task_files.found.Options`.
        tolerance: mm. angle_tolerance: degrees.
    """

    format: str | None = None
    units: str | None = None
    rotation: str | None = None
    columns: str | None = None
    tolerance: float | None = None
    angle_tolerance: float | None = None


def task(source: str, output: str | None, given: Given) -> int:
    """Print the task in a file as JSON, or write it; what the file was taken for goes to standard error."""
    try:
        check_writable(output)
        options, resampling = _options(given)
        found = imported(read(source), PurePath(source).name, options, resampling, Settings())
    except InvalidRequest as error:
        return complain(error.issues)
    sys.stderr.write(_summary(found.understood))
    text = _text(found)
    if output in (None, "-"):
        sys.stdout.write(text)
    else:
        with open(str(output), "w", encoding="utf-8") as file:
            file.write(text)
    return Exit.SOLVED


def _options(given: Given) -> tuple[Options, Resampling | None]:
    for name, value in (("tolerance", given.tolerance), ("angle-tolerance", given.angle_tolerance)):
        if value is not None and not 0.0 < value < 1e6:
            raise InvalidRequest([Issue("", f"--{name} is {value:g}; a number greater than 0 is needed.")])
    if given.angle_tolerance is not None and given.tolerance is None:
        raise InvalidRequest([Issue("", "--angle-tolerance needs --tolerance.")])
    columns = None if given.columns is None else tuple(name.strip() for name in given.columns.split(","))
    tolerance = None if given.tolerance is None else 1e-3 * given.tolerance
    angle = ANGLE_TOLERANCE if given.angle_tolerance is None else radians(given.angle_tolerance)
    options = Options(given.format, given.units, given.rotation, columns, tolerance or ARC_TOLERANCE)
    return options, None if tolerance is None else Resampling(tolerance, angle)


def _summary(understood: UnderstoodFile) -> str:
    """What the file was taken for, a line each."""
    lines = [
        f"{understood.format}, {understood.units}, rotation {understood.rotation}: {understood.read} way-points, "
        f"{understood.kept} kept"
    ]
    if understood.kept < understood.read:
        lines[0] += f" (within {1e3 * understood.position_error:.3g} mm and {understood.rotation_error:.2g} rad)"
    if understood.free_roll:
        lines.append("free roll: the turn about the z axis of the poses was chosen")
    lines += [f"guessed: {sentence}" for sentence in understood.guessed]
    lines += [f"note: {sentence}" for sentence in understood.notes]
    return "".join(f"{line}\n" for line in lines)


def _text(found: ImportedTask) -> str:
    """JSON with a line for each pose."""
    poses = ",\n".join(f"  {json.dumps(pose)}" for pose in found.task.model_dump(mode="json")["poses"])
    understood = json.dumps(found.understood.model_dump(), indent=1, ensure_ascii=False)
    return f'{{"task": {{"poses": [\n{poses}\n]}},\n"understood": {understood}}}\n'
