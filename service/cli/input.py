"""What the commands read, and how they complain about it."""

from __future__ import annotations

import sys
from collections.abc import Iterable
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from duocell.service.cli.exit_codes import Exit
from duocell.service.common.issues import MOST_SHOWN, InvalidRequest, Issue

if TYPE_CHECKING:
    from duocell.models.description.urdf_bodies import MissingMeshes
    from duocell.service.library.library import Library


def read(source: str) -> bytes:
    """A file, or standard input for "-".

    Raises:
        InvalidRequest: it cannot be read.
    """
    if source == "-":
        return sys.stdin.buffer.read()
    try:
        return Path(source).read_bytes()
    except OSError as error:
        raise InvalidRequest([Issue("", f"{source} cannot be read: {error.strerror}. Check the path.")]) from error


@dataclass(frozen=True, slots=True)
class RobotUrdfs:
    """Robots of the command line.

    Attributes:
        options: NAME=FILE[:BASE[:TIP]] each.
        missing_meshes: what becomes of links whose mesh is missing: "refuse" or "estimate".
    """

    options: tuple[str, ...] = ()
    missing_meshes: MissingMeshes = "refuse"


def library_from(data_dir: Path, urdfs: RobotUrdfs) -> Library:
    """What users brought to the service, and robots of the command line.

    Raises:
        InvalidRequest: an option or its file cannot be used.
    """
    from duocell.models.base.errors import InvalidInput
    from duocell.service.library.library import Library
    from duocell.service.uploads.urdf_on_disk import robot_on_disk

    robots = {}
    for option in urdfs.options:
        name, _, rest = option.partition("=")
        if not name or not rest or "@" in name:
            raise InvalidRequest(
                [Issue("", f"--robot-urdf {option!r}: NAME=FILE[:BASE[:TIP]] is needed, without @ in NAME.")]
            )
        path, base, tip = (*rest.split(":"), "", "")[:3]
        try:
            warn = partial(_warn, option)
            follow = partial(_show_link, option)
            robots[name] = robot_on_disk(
                name, Path(path), base or None, tip or None, warn, urdfs.missing_meshes, follow
            )
        except InvalidInput as error:
            raise InvalidRequest([Issue("", f"--robot-urdf {option}: {error.detail}", error.code)]) from error
    return Library(data_dir, given=robots, deleted=True)


def _warn(option: str, detail: str) -> None:
    sys.stderr.write(f"warning: --robot-urdf {option}: {detail}\n")


def _show_link(option: str, link: str, done: int, total: int) -> None:
    """One line a link, which takes about a second; nothing where nobody watches."""
    if sys.stderr.isatty():
        sys.stderr.write(f"--robot-urdf {option}: the shape of link {link} ({done + 1} of {total})\n")


def complain(issues: Iterable[Issue]) -> int:
    """Print issues the way the service lists them; returns the exit code for bad input."""
    found = list(issues)
    for issue in found[:MOST_SHOWN]:
        sys.stderr.write(f"{issue.pointer + ': ' if issue.pointer else ''}{issue.detail}\n")
    if len(found) > MOST_SHOWN:
        sys.stderr.write(f"... and {len(found) - MOST_SHOWN} more\n")
    return Exit.BAD_INPUT
