"""Where the meshes of a URDF file are: its ``filename`` attributes name them in ways that other machines know.

``package://name/path``, ``file:///path`` and relative paths are understood; nothing is ever fetched.
"""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path, PurePosixPath
from urllib.parse import unquote

from duocell.models.base.errors import InvalidInput
from duocell.models.geometry.link_meshes import MeshSource

_SCHEMES = ("package", "file", "model")


def parts_of(filename: str) -> tuple[str, ...]:
    """The names along the path of a mesh, the package first; ``..`` takes away the name before it.

    Raises:
        InvalidInput: a scheme such as http, or nothing that could be a path.
    """
    scheme, separator, rest = filename.partition("://")
    if not separator:
        rest = filename.replace("\\", "/")
    elif scheme.lower() in _SCHEMES:
        rest = unquote(rest)
    else:
        raise InvalidInput(f"meshes are not fetched from {filename[:80]!r}; use package:// or a relative path.")
    parts: list[str] = []
    for part in rest.split("/"):
        if part == "..":
            del parts[-1:]
        elif part not in ("", "."):
            parts.append(part)
    if not parts:
        raise InvalidInput(f"{filename[:80]!r} names no file.")
    return tuple(parts)


def best_matches(filename: str, paths: Iterable[str]) -> list[str]:
    """The paths that agree with a mesh's path in most names, counted from the end; they share at least the last name.

    Args:
        filename: of the URDF.
        paths: with forward slashes.

    Raises:
        InvalidInput: see `parts_of`.
    """
    wanted = parts_of(filename)
    best: list[str] = []
    most = 0
    for path in paths:
        agreeing = 0
        for mine, theirs in zip(reversed(wanted), reversed(PurePosixPath(path).parts), strict=False):
            if mine != theirs:
                break
            agreeing += 1
        if agreeing > most:
            best, most = [], agreeing
        if agreeing == most > 0:
            best.append(path)
    return best


def meshes_near(urdf: Path) -> MeshSource:
    """Meshes of a URDF file on this machine's disk.

    Relative paths start at the file's folder; a package is looked for among the folders above the file and next to
    them, the nearest first.
    """
    folder = urdf.absolute().parent

    def read(filename: str) -> bytes:
        for path in _places(filename, folder):
            if path.is_file():
                try:
                    return path.read_bytes()
                except OSError as error:
                    raise InvalidInput(f"cannot read {path}: {error.strerror}.") from error
        raise FileNotFoundError(filename)

    return read


def _places(filename: str, folder: Path) -> Iterable[Path]:
    """Where a mesh may be, the likeliest first."""
    scheme, separator, _ = filename.partition("://")
    if not separator:
        yield folder / filename.replace("\\", "/")
        return
    package, *inside = parts_of(filename)
    if scheme.lower() == "file":
        yield Path("/", package, *inside)
        return
    for above in (folder, *folder.parents):
        if above.name == package:
            yield above.joinpath(*inside)
        yield above.joinpath(package, *inside)
