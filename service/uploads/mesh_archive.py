"""The zip with the meshes of a robot: read in memory, never unpacked, and refused if it is built to do harm."""

from __future__ import annotations

import io
import stat
import struct
import zipfile
import zlib
from collections.abc import Sequence
from difflib import get_close_matches
from lzma import LZMAError
from pathlib import PurePosixPath

from duocell.models.base.errors import InvalidInput
from duocell.models.description.urdf_meshes import best_matches
from duocell.service.settings import Limits

SMALL = 1_000_000
"""bytes; what unpacks to less may be packed as tightly as it likes."""

LONGEST_ENTRY = 1000
"""bytes of an entry in the directory of a zip, most of them for its name."""

_END, _LARGE = b"PK\x05\x06", b"PK\x06\x07"

_BROKEN = (zipfile.BadZipFile, zlib.error, LZMAError, EOFError, OSError, NotImplementedError, RuntimeError, ValueError)
"""What `zipfile` raises for damaged, encrypted or exotically packed files."""

_SHOWN = 10


class MeshArchive:
    """Meshes by the ``filename`` of a URDF (a `duocell.models.description.urdf_bodies.MeshSource`).

    Args:
        data: contents of the zip, or None if none was sent.
        limits: how large it may be.

    Raises:
        InvalidInput: no zip, too many or too large entries, or names that lead out of it.
    """

    def __init__(self, data: bytes | None, limits: Limits) -> None:
        self._most = limits.max_unpacked
        self._zip: zipfile.ZipFile | None = None
        self._entries: dict[str, zipfile.ZipInfo] = {}
        self.used: dict[str, str] = {}  # filename of the URDF -> entry
        if data is not None:
            _check_directory(data, limits)
            try:
                self._zip = zipfile.ZipFile(io.BytesIO(data))
            except _BROKEN as error:
                raise InvalidInput(f"this is no readable zip file ({error}). Pack the meshes with `zip -r`.") from error
            _check(self._zip.infolist(), limits)
            self._entries = {_plain(entry): entry for entry in self._zip.infolist() if not entry.is_dir()}

    def __call__(self, filename: str) -> bytes:
        """Contents of a mesh.

        Raises:
            InvalidInput: it is not there, several could be meant, or it cannot be read.
        """
        entry = self.find(filename)
        self.used[filename] = entry
        return self._read(self._entries[entry])

    def find(self, filename: str) -> str:
        """The entry that a URDF means.

        Raises:
            InvalidInput: there is none, or several could be meant.
        """
        if self._zip is None:
            raise InvalidInput("no meshes were sent. Send them packed into one zip, as the part `meshes` of the form.")
        found = best_matches(filename, self._entries)
        if len(found) == 1:
            return found[0]
        if found:
            raise InvalidInput(
                f"it could be any of {_listed(found)}. Keep one of them, or more of the folders that the URDF names."
            )
        near = get_close_matches(PurePosixPath(filename).name, [PurePosixPath(name).name for name in self._entries], 3)
        there = f"the nearest names are {', '.join(near)}" if near else f"it holds {_listed(list(self._entries))}"
        raise InvalidInput(f"it is not in the zip; {there}. Add it.")

    def _read(self, entry: zipfile.ZipInfo) -> bytes:
        """Contents of an entry: never more of them than the limits allow, and as many as it announces."""
        if self._zip is None:
            raise AssertionError("an entry without a zip")
        try:
            with self._zip.open(entry) as file:
                data = file.read(entry.file_size + 1)
        except _BROKEN as error:
            raise InvalidInput(
                f"{_quoted(entry.filename)} in the zip cannot be read ({error}). Pack it anew."
            ) from error
        self._most -= len(data)
        if len(data) != entry.file_size or self._most < 0:
            raise InvalidInput(
                f"{_quoted(entry.filename)} in the zip is not as large as it claims to be. Pack it anew."
            )
        return data


def _check_directory(data: bytes, limits: Limits) -> None:
    """Refuse a directory of entries that is too long to be read, before it is read (APPNOTE.TXT, 4.3.16)."""
    end = data.rfind(_END, max(0, len(data) - 22 - 65535))
    if end < 0 or len(data) - end < 22:
        raise InvalidInput("this is no readable zip file (its end is missing). Pack the meshes with `zip -r`.")
    (length,) = struct.unpack_from("<I", data, end + 12)
    if length > limits.max_entries * LONGEST_ENTRY or data[end - 20 : end].startswith(_LARGE):
        raise InvalidInput(
            f"the zip has too many entries; allowed are {limits.max_entries} (DUOCELL_MAX_ENTRIES), and no format for "
            "more than 4 GB (zip64). Pack only the collision meshes."
        )


def _check(entries: Sequence[zipfile.ZipInfo], limits: Limits) -> None:
    """Refuse what no honest archive holds, before anything is unpacked."""
    if len(entries) > limits.max_entries:
        raise InvalidInput(
            f"the zip has {len(entries)} entries; allowed are {limits.max_entries} (DUOCELL_MAX_ENTRIES). "
            "Pack only the collision meshes."
        )
    seen: set[str] = set()
    for entry in entries:
        _check_name(entry, seen)
        seen.add(_plain(entry))
        if entry.flag_bits & 1:
            raise InvalidInput(f"{_quoted(entry.filename)} in the zip is encrypted. Pack it without a password.")
        if entry.file_size > max(SMALL, limits.max_ratio * entry.compress_size):
            raise InvalidInput(
                f"{_quoted(entry.filename)} in the zip would unpack {entry.compress_size} bytes to {entry.file_size}; "
                f"allowed is a factor of {limits.max_ratio} (DUOCELL_MAX_RATIO). No mesh packs that tightly."
            )
    total = sum(entry.file_size for entry in entries)
    if total > limits.max_unpacked:
        raise InvalidInput(
            f"the zip would unpack to {total} bytes; allowed are {limits.max_unpacked} (DUOCELL_MAX_UNPACKED). "
            "Pack only the collision meshes, simplified."
        )


def _check_name(entry: zipfile.ZipInfo, seen: set[str]) -> None:
    """Refuse names that lead out of the archive, links, and names that two entries share."""
    name = entry.orig_filename.replace("\\", "/")  # zipfile cuts the other name at a zero byte
    outside = name.startswith("/") or name[1:2] == ":" or ".." in name.split("/") or "\0" in name or not name
    if outside:
        raise InvalidInput(f"the entry {_quoted(entry.orig_filename)} leads out of the zip. Pack relative paths.")
    kind = stat.S_IFMT(entry.external_attr >> 16)
    if kind not in (0, stat.S_IFREG, stat.S_IFDIR):
        what = "a symbolic link" if kind == stat.S_IFLNK else "no plain file"
        raise InvalidInput(f"the entry {_quoted(entry.filename)} is {what}. Pack the files themselves.")
    if _plain(entry) in seen:
        raise InvalidInput(f"the zip has two entries {_quoted(entry.filename)}. Keep one.")


def _plain(entry: zipfile.ZipInfo) -> str:
    """Name of an entry with forward slashes, whatever packed it."""
    return entry.filename.replace("\\", "/")


def _quoted(name: str) -> str:
    return repr(name if len(name) <= 80 else name[:79] + "…")


def _listed(names: Sequence[str]) -> str:
    """Names for an error message."""
    more = f" and {len(names) - _SHOWN} more" if len(names) > _SHOWN else ""
    return (", ".join(map(_quoted, names[:_SHOWN])) or "nothing") + more
