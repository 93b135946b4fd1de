"""From a file of any known kind to the poses of a task."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from duocell.models.base.arrays import Floats, set_frozen
from duocell.models.base.pose import transform
from duocell.models.task_files.conventions import ROTATIONS, UNITS, positions_of, rotations_of
from duocell.models.task_files.errors import InvalidTaskFile, quoted
from duocell.models.task_files.formats import (
    abb,
    apt,
    csv_table,
    fanuc,
    gcode,
    json_list,
    kuka,
    ros_yaml,
    ur_script,
)
from duocell.models.task_files.found import Found, Options
from duocell.models.task_files.resample import chosen_poses, largest_errors
from duocell.models.task_files.text import decoded


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file.

    Attributes:
        title: what it is called. suffixes: of file names, lower case.
        looks_like: whether a text may be one. read: its way-points.
    """

    title: str
    suffixes: tuple[str, ...]
    looks_like: Callable[[str], bool]
    read: Callable[[str, Options], Found]


FORMATS: dict[str, Format] = {
    "json": Format("JSON list", (".json",), json_list.looks_like, json_list.read),
    "fanuc": Format("FANUC TP program", (".ls",), fanuc.looks_like, fanuc.read),
    "abb": Format("ABB RAPID module", (".mod", ".modx", ".prg"), abb.looks_like, abb.read),
    "kuka": Format("KUKA KRL file", (".dat", ".src"), kuka.looks_like, kuka.read),
    "ur": Format("URScript", (".script", ".urscript"), ur_script.looks_like, ur_script.read),
    "ros": Format("ROS or MoveIt YAML", (".yaml", ".yml"), ros_yaml.looks_like, ros_yaml.read),
    "apt": Format("APT or CL file", (".apt", ".cls", ".cl", ".aptsource"), apt.looks_like, apt.read),
    "gcode": Format("G-code", (".nc", ".gcode", ".ngc", ".tap", ".cnc", ".mpf"), gcode.looks_like, gcode.read),
    "csv": Format("table", (".csv", ".tsv"), csv_table.looks_like, csv_table.read),
}
"""Kinds of files by name, in the order in which a text is tried."""


@dataclass(frozen=True, eq=False)
class TaskFile:
    """A task that was read from a file.

    Attributes:
        poses: (m, 4, 4) in m, those that were kept.
        format: name in `FORMATS`. units, rotation: what the numbers were taken for.
        columns: of a table, as they were read.
        free_roll: True if the turn about the z axis of every pose was chosen, not given.
        read: way-points of the file.
        position_error, rotation_error: m, rad, by which a way-point that was left out is off at most.
        guessed: sentences about what the file does not say. notes: about what was left out or needs to be known.
    """

    poses: Floats
    format: str
    units: str
    rotation: str
    columns: tuple[str, ...]
    free_roll: bool
    read: int
    position_error: float
    rotation_error: float
    guessed: tuple[str, ...]
    notes: tuple[str, ...]

    def __post_init__(self) -> None:
        set_frozen(self, "poses", self.poses, (None, 4, 4))


@dataclass(frozen=True, slots=True)
class Resampling:
    """How far the way between the kept poses may be from the way-points.

    Attributes:
        position: m, above 0. rotation: rad, above 0.
    """

    position: float
    rotation: float


def read_task_file(
    data: bytes, file: str = "", options: Options | None = None, resampling: Resampling | None = None
) -> TaskFile:
    """The task in a file.

    Args:
        data: its contents. file: its name, "" if it has none; the suffix tells the kind of file.
        options: what is known about it.
        resampling: which way-points may be left out; None: all are kept.

    Raises:
        InvalidTaskFile: it cannot be understood; the detail says where, what is allowed and what to do.
    """
    options = options or Options()
    _check(options)
    text = decoded(data)
    name = options.format or format_of(text, file)
    found = FORMATS[name].read(text, options)
    if len(found.positions) < 2:
        raise InvalidTaskFile(
            f"as {FORMATS[name].title} the file has {len(found.positions)} way-points; a task needs at least two. If "
            f"it is another kind of file, say so with `format`: {', '.join(FORMATS)}."
        )
    positions = positions_of(found.units, found.positions, found.lines)
    rotations = rotations_of(found.rotation, found.orientations, found.lines)
    kept, errors = list(range(len(positions))), (0.0, 0.0)
    if resampling is not None:
        kept = chosen_poses(positions, rotations, resampling.position, resampling.rotation)
        errors = largest_errors(positions, rotations, kept, resampling.position, resampling.rotation)
    return TaskFile(
        poses=transform(rotations[kept], positions[kept]),
        format=name,
        units=found.units,
        rotation=found.rotation,
        columns=found.columns,
        free_roll=ROTATIONS[found.rotation].free_roll,
        read=len(positions),
        position_error=errors[0],
        rotation_error=errors[1],
        guessed=tuple(found.guessed),
        notes=tuple(found.notes),
    )


def format_of(text: str, file: str) -> str:
    """The kind of a file, by its suffix, or by what stands in it.

    Raises:
        InvalidTaskFile: no kind is known that it may be.
    """
    suffix = "." + file.rsplit(".", 1)[-1].lower() if "." in file else ""
    for name, kind in FORMATS.items():
        if suffix in kind.suffixes:
            return name
    for name, kind in FORMATS.items():
        if kind.looks_like(text):
            return name
    titles = ", ".join(f"{name} ({kind.title})" for name, kind in FORMATS.items())
    raise InvalidTaskFile(f"it is no kind of file that is known. Say which with `format`: {titles}.")


def _check(options: Options) -> None:
    """Refuse words that are not known."""
    for what, word, allowed in (
        ("format", options.format, FORMATS),
        ("units", options.units, UNITS),
        ("rotation", options.rotation, ROTATIONS),
    ):
        if word is not None and word not in allowed:
            raise InvalidTaskFile(f"{what} is {quoted(word)}; it must be one of {', '.join(allowed)}.")
