"""Which file a URDF means by the name of a mesh."""

from __future__ import annotations

from pathlib import Path

import pytest

from duocell.models.base.errors import InvalidInput
from duocell.models.description.urdf_meshes import best_matches, meshes_near, parts_of


@pytest.mark.parametrize(
    ("filename", "parts"),
    [
        ("package://arm/meshes/base.stl", ("arm", "meshes", "base.stl")),
        ("package://arm/meshes/../other/base.stl", ("arm", "other", "base.stl")),
        ("file:///home/me/my%20arm/base.stl", ("home", "me", "my arm", "base.stl")),
        ("../meshes/./base.stl", ("meshes", "base.stl")),
        ("meshes\\base.stl", ("meshes", "base.stl")),
        ("/opt/ros/base.stl", ("opt", "ros", "base.stl")),
    ],
)
def test_parts_of_a_path(filename: str, parts: tuple[str, ...]) -> None:
    assert parts_of(filename) == parts


@pytest.mark.parametrize("filename", ["http://host/base.stl", "ftp://host/x", "", "..", "package://", "/"])
def test_what_names_no_file(filename: str) -> None:
    with pytest.raises(InvalidInput):
        parts_of(filename)


@pytest.mark.parametrize(
    ("filename", "paths", "best"),
    [
        ("package://arm/meshes/base.stl", ["base.stl"], ["base.stl"]),
        ("package://arm/meshes/base.stl", ["base.stl", "meshes/base.stl"], ["meshes/base.stl"]),
        ("package://arm/meshes/base.stl", ["a/base.stl", "b/base.stl"], ["a/base.stl", "b/base.stl"]),
        (
            "package://arm/visual/base.stl",
            ["arm/collision/base.stl", "x/arm/visual/base.stl"],
            ["x/arm/visual/base.stl"],
        ),
        ("base.stl", ["notbase.stl", "base.STL"], []),
        ("base.stl", [], []),
    ],
)
def test_the_longest_common_end_wins(filename: str, paths: list[str], best: list[str]) -> None:
    assert best_matches(filename, paths) == best


def test_meshes_on_disk_are_found_by_package_and_by_relative_path(tmp_path: Path) -> None:
    urdf = tmp_path / "ws" / "arm_description" / "urdf" / "arm.urdf"
    for place in ("arm_description/meshes/base.stl", "other_package/meshes/base.stl", "arm_description/urdf/near.stl"):
        (tmp_path / "ws" / place).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / "ws" / place).write_bytes(place.encode())
    read = meshes_near(urdf)
    assert read("package://arm_description/meshes/base.stl") == b"arm_description/meshes/base.stl"
    assert read("package://other_package/meshes/base.stl") == b"other_package/meshes/base.stl"
    assert read("../meshes/base.stl") == b"arm_description/meshes/base.stl"
    assert read("near.stl") == b"arm_description/urdf/near.stl"
    assert read(f"file://{tmp_path}/ws/arm_description/urdf/near.stl") == b"arm_description/urdf/near.stl"
    with pytest.raises(FileNotFoundError):
        read("package://arm_description/meshes/gone.stl")
    with pytest.raises(InvalidInput):
        read("http://host/base.stl")
