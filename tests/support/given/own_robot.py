"""A robot that is not in the catalogue: six joints, a spherical wrist, and meshes made by hand."""

from __future__ import annotations

import io
import zipfile
from collections.abc import Mapping
from typing import Any

import numpy as np
import trimesh

BASE = "package://own_arm/meshes/collision/base.stl"
UPPER = "package://own_arm/meshes/collision/upper_arm.stl"
WRIST = "../meshes/wrist.obj"

AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
STEPS = ("0 0 0.35", "0.1 0 0.05", "0 0 0.5", "0.2 0 0.05", "0.3 0 0", "0 0 0")
LIMITS = (2.9, 2.0, 2.5, 3.1, 2.1, 4.7)
LINKS = ("base_link", "shoulder", "upper_arm", "elbow", "forearm", "wrist", "hand")

COLLISIONS = {
    "base_link": f'<mesh filename="{BASE}" scale="0.001 0.001 0.001"/>',
    "shoulder": '<box size="0.2 0.2 0.15"/>',
    "upper_arm": f'<mesh filename="{UPPER}"/>',
    "forearm": '<cylinder radius="0.05" length="0.2"/>',
    "wrist": f'<mesh filename="{WRIST}"/>',
}

REQUEST: dict[str, Any] = {
    "task": {
        "line": {
            "start": {"position": [0.6, -0.2, 0.6], "orientation": {"rpy": [0.0, 3.1415926536, 0.0]}},
            "end": {"position": [0.6, 0.2, 0.6], "orientation": {"rpy": [0.0, 3.1415926536, 0.0]}},
            "count": 5,
        }
    },
    "arms": [
        {
            "name": "arm",
            "robot": "own",
            "grasp": {"position": [0.0, 0.0, 0.0], "orientation": {"rpy": [0.0, 0.0, 0.0]}},
            "base": {"x": [-0.5, 0.5], "y": [-0.5, 0.5], "z": 0.0, "yaw": [-3.1416, 3.1416]},
        }
    ],
}
"""A request for a layout with the robot `own`."""


def collision(geometry: str) -> str:
    return f"<collision><geometry>{geometry}</geometry></collision>"


def urdf(collisions: Mapping[str, str] | None = None) -> str:
    """The file; ``collisions``: geometry by link, in the place of our own."""
    shapes = COLLISIONS if collisions is None else collisions
    parts = ['<?xml version="1.0"?><robot name="own arm">']
    for link in LINKS:
        inside = collision(shapes[link]) if link in shapes else ""
        visual = (
            '<visual><geometry><mesh filename="package://own_arm/meshes/visual/never_sent.dae"/></geometry></visual>'
        )
        parts.append(f'<link name="{link}">{visual}{inside}</link>')
    for i, (axis, step, limit) in enumerate(zip(AXES, STEPS, LIMITS, strict=True)):
        parts.append(
            f'<joint name="turn_{i + 1}" type="revolute"><parent link="{LINKS[i]}"/><child link="{LINKS[i + 1]}"/>'
            f'<origin xyz="{step}"/><axis xyz="{axis}"/>'
            f'<limit lower="{-limit}" upper="{limit}" effort="1" velocity="1"/></joint>'
        )
    parts.append(
        '<link name="tool0"/><joint name="flange" type="fixed"><parent link="hand"/><child link="tool0"/>'
        '<origin xyz="0.08 0 0" rpy="0 1.5707963267948966 0"/></joint></robot>'
    )
    return "".join(parts)


def fork() -> trimesh.Trimesh:
    """Two cheeks on a bridge, one piece that is not convex: the upper arm."""
    outline = np.array([[-1, 0], [1, 0], [1, 6], [0.6, 6], [0.6, 1], [-0.6, 1], [-0.6, 6], [-1, 6]]) * [0.1, 0.08]
    flat = [[0, 1, 4], [0, 4, 5], [1, 2, 3], [1, 3, 4], [0, 5, 6], [0, 6, 7]]
    count = len(outline)
    vertices = np.vstack([np.column_stack([np.full(count, x), outline]) for x in (-0.05, 0.05)])
    sides = []
    for i in range(count):
        j = (i + 1) % count
        sides += [[i, j, i + count], [j, j + count, i + count]]
    faces = [face[::-1] for face in flat] + [[v + count for v in face] for face in flat] + sides
    return trimesh.Trimesh(vertices, faces, process=False)


def as_stl(mesh: trimesh.Trimesh) -> bytes:
    data = mesh.export(file_type="stl")
    assert isinstance(data, bytes)
    return data


def as_obj(mesh: trimesh.Trimesh) -> bytes:
    text = mesh.export(file_type="obj")
    assert isinstance(text, str)
    return text.encode()


def meshes() -> dict[str, bytes]:
    """Files of the zip by name; the base is in millimetres, and too long for a file in metres."""
    base = trimesh.creation.cylinder(90.0, 1400.0)
    base.apply_translation([0.0, 0.0, -400.0])
    return {
        "own_arm/meshes/collision/base.stl": as_stl(base),
        "own_arm/meshes/collision/upper_arm.stl": as_stl(fork()),
        "own_arm/meshes/wrist.obj": as_obj(trimesh.creation.icosphere(subdivisions=2, radius=0.06)),
        "own_arm/package.xml": b"<package/>",
    }


def zipped(files: Mapping[str, bytes]) -> bytes:
    """A zip of files."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in files.items():
            archive.writestr(name, data)
    return buffer.getvalue()
