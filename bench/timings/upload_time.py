"""How long an upload of a robot takes whose seven links have meshes of 5,000 triangles, and the next ones.

    python -m bench.timings.upload_time

One server of our own on loopback. Prints wall time and pieces per link for the robot, for the same meshes under another
URDF, and what is said about the error of the shapes.
"""

from __future__ import annotations

import io
import zipfile
from time import perf_counter, process_time

import httpx2
import numpy as np
import trimesh

from bench.timings.server import serving
from duocell.models.base.arrays import Floats
from duocell.service.settings import Limits
from duocell.service.uploads.robot_import import RobotFiles, robot_from_files

LINKS = ("base_link", "shoulder", "upper_arm", "elbow", "forearm", "wrist", "hand")
AXES = ("0 0 1", "0 1 0", "0 1 0", "1 0 0", "0 1 0", "1 0 0")
STEPS = ("0 0 0.35", "0.1 0 0.05", "0 0 0.5", "0.2 0 0.05", "0.3 0 0", "0.1 0 0")
TRIANGLES = 5000


def link_mesh(number: int) -> bytes:
    """A bent tube with bulges, dents and ribs, and flanges at its ends: about 5,000 triangles, never convex."""
    around, along = 50, TRIANGLES // 100
    draws = np.random.default_rng(number)
    bend, bulges = draws.uniform(0.5, 1.5), draws.uniform(0.1, 0.3, 3)
    turn, way = np.meshgrid(np.linspace(0.0, 2.0 * np.pi, around, endpoint=False), np.linspace(0.0, 1.0, along))
    radius = 0.06 * (1.0 + bulges[0] * np.sin(9.0 * way) + bulges[1] * np.cos(2.0 * turn + 5.0 * way))
    radius += 0.008 * (np.sin(40.0 * way) > 0.6) + 0.03 * ((way < 0.06) | (way > 0.94))
    centre = 0.4 / bend * np.stack([1.0 - np.cos(bend * way), np.zeros_like(way), np.sin(bend * way)])
    out = np.stack([np.cos(turn) * np.cos(bend * way), np.sin(turn), -np.cos(turn) * np.sin(bend * way)])
    points: Floats = (centre + radius * out).reshape(3, -1).T
    ends = np.array([centre[:, 0, 0], centre[:, -1, 0]])
    grid = np.arange(around * along).reshape(along, around)
    a, b, c, d = grid[:-1], np.roll(grid, -1, 1)[:-1], grid[1:], np.roll(grid, -1, 1)[1:]
    faces = [np.stack([a, b, d], -1).reshape(-1, 3), np.stack([a, d, c], -1).reshape(-1, 3)]
    for index, ring in ((len(points), grid[0][::-1]), (len(points) + 1, grid[-1])):
        faces.append(np.stack([np.full(around, index), ring, np.roll(ring, -1)], -1))
    mesh = trimesh.Trimesh(np.vstack([points, ends]), np.vstack(faces), process=False)
    exported = mesh.export(file_type="stl")
    assert isinstance(exported, bytes)
    return exported


def urdf(name: str) -> str:
    """Seven links of one mesh each."""
    parts = [f'<robot name="{name}">']
    for link in LINKS:
        mesh = f'<geometry><mesh filename="package://own/{link}.stl"/></geometry>'
        parts.append(f'<link name="{link}"><collision>{mesh}</collision></link>')
    for number, (axis, step) in enumerate(zip(AXES, STEPS, strict=True)):
        parts.append(
            f'<joint name="turn_{number}" type="revolute"><parent link="{LINKS[number]}"/>'
            f'<child link="{LINKS[number + 1]}"/><origin xyz="{step}"/><axis xyz="{axis}"/>'
            '<limit lower="-2.5" upper="2.5" effort="1" velocity="1"/></joint>'
        )
    return "".join([*parts, "</robot>"])


def _cost(packed: bytes) -> float:
    """s of processor time that the robot takes in this process."""
    began = process_time()
    robot_from_files(RobotFiles("own", "own.urdf", urdf("own").encode(), packed), Limits())
    return process_time() - began


def main() -> None:
    """Measure and print."""
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w", zipfile.ZIP_DEFLATED) as archive:
        for number, link in enumerate(LINKS):
            archive.writestr(f"{link}.stl", link_mesh(number))
    triangles = [(len(link_mesh(k)) - 84) // 50 for k in range(len(LINKS))]  # of a binary STL
    print(f"triangles of the links: {triangles}; the zip has {len(packed.getvalue()) / 1e6:.1f} MB")
    print(f"processor time of the meshes alone: {_cost(packed.getvalue()):.1f} s")
    with serving() as server:
        for name in ("first", "second"):
            files: dict[str, tuple[str, bytes | str]] = {
                "urdf": (f"{name}.urdf", urdf(name)),
                "meshes": ("meshes.zip", packed.getvalue()),
            }
            began = perf_counter()
            answer = httpx2.post(f"{server.url}/v1/robots", data={"name": name}, files=files, timeout=200.0)
            seconds = perf_counter() - began
            robot = answer.json()
            pieces = [body["pieces"] for body in robot.get("bodies", [])]
            print(f"{name}: {answer.status_code} after {seconds:.1f} s, pieces {pieces}")
        print("\n".join(robot.get("notes", [str(robot)])))


if __name__ == "__main__":
    main()
