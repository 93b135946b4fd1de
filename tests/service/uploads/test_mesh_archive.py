"""The zip with meshes: what is found in it, and what it is refused for."""

from __future__ import annotations

import io
import struct
import warnings
import zipfile
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.models.base.errors import InvalidInput
from duocell.service.settings import Limits
from duocell.service.uploads.mesh_archive import MeshArchive
from tests.support.given.own_robot import zipped

LIMITS = Limits(max_entries=20, max_unpacked=3_000_000)
LINK, SOCKET = 0o120777, 0o140777


def entry(name: str, mode: int = 0o100644) -> zipfile.ZipInfo:
    info = zipfile.ZipInfo(name)
    info.external_attr = mode << 16
    return info


def packed(*entries: tuple[zipfile.ZipInfo | str, bytes], packing: int = zipfile.ZIP_DEFLATED) -> bytes:
    buffer = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # duplicate names
        with zipfile.ZipFile(buffer, "w", packing) as archive:
            for info, data in entries:
                archive.writestr(info, data, packing)
    return buffer.getvalue()


def patched(data: bytes, signature: bytes, offset: int, value: bytes) -> bytes:
    """``data`` with bytes replaced behind the first header of a kind."""
    at = data.index(signature) + offset
    return data[:at] + value + data[at + len(value) :]


def lying(size: int) -> bytes:
    """A zip whose only entry announces another size than it has, in both headers."""
    data = packed(("base.stl", b"0123456789" * 100), packing=zipfile.ZIP_STORED)
    announced = struct.pack("<I", size)
    return patched(patched(data, b"PK\x01\x02", 24, announced), b"PK\x03\x04", 22, announced)


def test_meshes_are_found_by_the_end_of_their_path() -> None:
    archive = MeshArchive(zipped({"x/meshes/base.stl": b"one", "x/visual/base.stl": b"two", "readme": b""}), LIMITS)
    assert archive("package://arm/meshes/base.stl") == b"one"
    assert archive.used == {"package://arm/meshes/base.stl": "x/meshes/base.stl"}


def test_names_with_backslashes_are_paths_too() -> None:
    info = entry("here")
    info.filename = "meshes\\base.stl"
    archive = MeshArchive(packed((info, b"one"), ("other/base.stl", b"two")), LIMITS)
    assert archive("package://arm/meshes/base.stl") == b"one"


def test_what_could_be_meant_is_named() -> None:
    archive = MeshArchive(zipped({"left/base.stl": b"one", "right/base.stl": b"two"}), LIMITS)
    with pytest.raises(InvalidInput, match=r"'left/base\.stl', 'right/base\.stl'"):
        archive("package://arm/meshes/base.stl")


def test_what_is_missing_is_told_with_what_is_there() -> None:
    archive = MeshArchive(zipped({"meshes/base.STL": b"one"}), LIMITS)
    with pytest.raises(InvalidInput, match=r"not in the zip.*base\.STL"):
        archive("package://arm/meshes/base.stl")
    with pytest.raises(InvalidInput, match="no meshes were sent"):
        MeshArchive(None, LIMITS)("base.stl")


REFUSED: dict[str, tuple[Callable[[], bytes], str]] = {
    "nothing": (lambda: b"", "no readable zip"),
    "another format": (lambda: b"\x1f\x8b" + b"x" * 100, "no readable zip"),
    "cut off": (lambda: zipped({"base.stl": b"x" * 1000})[:-30], "no readable zip"),
    "too many entries": (lambda: zipped({f"{i}.stl": b"" for i in range(21)}), "21 entries"),
    "very many entries": (lambda: zipped({f"{i:06}.stl": b"" for i in range(500)}), "too many entries"),
    "a format for more than 4 GB": (
        lambda: patched(zipped({"a.stl": b""}), b"PK\x05\x06", -20, b"PK\x06\x07"),
        "zip64",
    ),
    "a bomb": (lambda: zipped({"base.stl": b"\0" * 2_000_000}), "factor of 100"),
    "much that is little each": (lambda: zipped({f"{i}.stl": b"\0" * 900_000 for i in range(4)}), "3600000 bytes"),
    "a path upwards": (lambda: packed((entry("../base.stl"), b"x")), "leads out"),
    "a path upwards inside": (lambda: packed((entry("meshes/../../base.stl"), b"x")), "leads out"),
    "an absolute path": (lambda: packed((entry("/etc/passwd"), b"x")), "leads out"),
    "a drive": (lambda: packed((entry("C:/base.stl"), b"x")), "leads out"),
    "backslashes upwards": (lambda: zipped({"..\\base.stl": b"x"}), "leads out"),
    "a symbolic link": (lambda: packed((entry("base.stl", LINK), b"/etc/passwd")), "symbolic link"),
    "a socket": (lambda: packed((entry("base.stl", SOCKET), b"")), "no plain file"),
    "the same name twice": (lambda: packed(("base.stl", b"one"), ("base.stl", b"two")), "two entries"),
    "a password": (
        lambda: patched(zipped({"base.stl": b"x"}), b"PK\x01\x02", 8, struct.pack("<H", 1)),
        "encrypted",
    ),
}


@pytest.mark.parametrize("name", REFUSED)
def test_refused_before_anything_is_unpacked(name: str) -> None:
    make, words = REFUSED[name]
    with pytest.raises(InvalidInput, match=words):
        MeshArchive(make(), LIMITS)


@pytest.mark.parametrize("size", [10, 999, 1001, 100_000])
def test_an_entry_that_lies_about_its_size_is_refused(size: int) -> None:
    with pytest.raises(InvalidInput, match="Pack it anew"):
        MeshArchive(lying(size), LIMITS)("base.stl")


def test_a_method_of_packing_that_nobody_knows_is_refused() -> None:
    data = zipped({"base.stl": b"x" * 100})
    for signature, offset in ((b"PK\x01\x02", 10), (b"PK\x03\x04", 8)):
        data = patched(data, signature, offset, struct.pack("<H", 97))
    with pytest.raises(InvalidInput, match="Pack it anew"):
        MeshArchive(data, LIMITS)("base.stl")


@given(st.data())
def test_damaged_zips_are_read_right_or_refused(data: Any) -> None:
    """Any single byte may be wrong: the contents are right all the same, or it is refused."""
    good = zipped({"meshes/base.stl": b"solid contents " * 10, "b.stl": b"other"})
    at = data.draw(st.integers(0, len(good) - 1))
    bad = good[:at] + bytes([data.draw(st.integers(0, 255))]) + good[at + 1 :]
    try:
        contents = MeshArchive(bad, LIMITS)("package://arm/meshes/base.stl")
    except InvalidInput:
        return
    assert contents in (b"solid contents " * 10,)
