"""Task files of every kind, written with scipy from poses that are known."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.spatial.transform import Rotation

from duocell.models.base.arrays import Floats


@dataclass(frozen=True, eq=False)
class Way:
    """Poses: (m, 3) m, and the rotations."""

    positions: Floats
    turns: Rotation


def drawn_way(rng: np.random.Generator, count: int) -> Way:
    """Random poses within a metre or two; angles stay off the singularity of three angles."""
    angles = np.column_stack(
        [rng.uniform(-np.pi, np.pi, count), rng.uniform(-1.3, 1.3, count), rng.uniform(-np.pi, np.pi, count)]
    )
    return Way(rng.uniform(-2.0, 2.0, (count, 3)), Rotation.from_euler("ZYX", angles))


def csv_text(way: Way) -> str:
    """A table in metres with ROS quaternions."""
    rows = np.hstack([way.positions, way.turns.as_quat()])
    return "x,y,z,qx,qy,qz,qw\n" + _lines(",".join(f"{value:.9f}" for value in row) for row in rows)


def json_text(way: Way) -> str:
    """Poses as requests have them."""
    poses = [
        {"position": position.tolist(), "orientation": {"matrix": matrix.tolist()}}
        for position, matrix in zip(way.positions, way.turns.as_matrix(), strict=True)
    ]
    return json.dumps({"poses": poses})


def ros_text(way: Way) -> str:
    """A PoseArray as `ros2 topic echo` prints it."""
    parts = ["header:\n  stamp:\n    sec: 0\n  frame_id: world\nposes:\n"]
    for (x, y, z), (qx, qy, qz, qw) in zip(way.positions, way.turns.as_quat(), strict=True):
        parts.append(
            f"- position:\n    x: {x:.9f}\n    y: {y:.9f}\n    z: {z:.9f}\n"
            f"  orientation:\n    x: {qx:.9f}\n    y: {qy:.9f}\n    z: {qz:.9f}\n    w: {qw:.9f}\n"
        )
    return "".join(parts) + "---\n"


def ur_text(way: Way) -> str:
    """A URScript program."""
    rows = np.hstack([way.positions, way.turns.as_rotvec()])
    moves = (f"  movel(p[{', '.join(f'{value:.9f}' for value in row)}], a=1.2, v=0.25)" for row in rows)
    return "def weld():\n  set_tcp(p[0,0,0.1,0,0,0])\n" + _lines(moves) + "end\n"


def kuka_text(way: Way) -> str:
    """The .dat file of a KRL program and the program behind it."""
    declared, moves = [], []
    for index, (position, turned) in enumerate(_mm_and_degrees(way, "ZYX")):
        (x, y, z), (a, b, c) = position, turned
        fields = f"X {x:.6f},Y {y:.6f},Z {z:.6f},A {a:.6f},B {b:.6f},C {c:.6f},S 6,T 50,E1 0.0,E2 0.0"
        declared.append(f"DECL E6POS XP{index}={{{fields}}}")
        moves.append(f"LIN XP{index} C_DIS")
    return "DEFDAT WELD\n" + _lines(declared) + "ENDDAT\nDEF WELD()\nPTP XHOME\n" + _lines(moves) + "END\n"


def abb_text(way: Way) -> str:
    """A RAPID module."""
    rest = "[-1,0,-1,0],[9E+09,9E+09,9E+09,9E+09,9E+09,9E+09]"
    declared, moves = [], []
    quaternions = way.turns.as_quat(scalar_first=True)
    for index, (position, q) in enumerate(zip(1e3 * way.positions, quaternions, strict=True)):
        where, turned = (",".join(f"{value:.9f}" for value in values) for values in (position, q))
        declared.append(f"  CONST robtarget p{index}:=[[{where}],[{turned}],{rest}];")
        moves.append(f"    MoveL p{index},v100,z10,tWeld\\WObj:=wobj0;")
    return "MODULE Weld\n" + _lines(declared) + "  PROC main()\n" + _lines(moves) + "  ENDPROC\nENDMODULE\n"


def fanuc_text(way: Way) -> str:
    """A TP program as text."""
    points, moves = [], []
    for index, (position, turned) in enumerate(_mm_and_degrees(way, "xyz"), 1):
        (x, y, z), (w, p, r) = position, turned
        points.append(
            f"P[{index}]{{\n   GP1:\n\tUF : 0, UT : 1,\t\tCONFIG : 'N U T, 0, 0, 0',\n"
            f"\tX = {x:.6f}  mm,\tY = {y:.6f}  mm,\tZ = {z:.6f}  mm,\n"
            f"\tW = {w:.6f} deg,\tP = {p:.6f} deg,\tR = {r:.6f} deg\n}};"
        )
        moves.append(f"{index:4d}:L P[{index}] 100mm/sec CNT100    ;")
    return "/PROG  WELD\n/MN\n" + _lines(moves) + "/POS\n" + _lines(points) + "/END\n"


def apt_text(way: Way) -> str:
    """A CL file: tips and axes, which point against the z axes of the poses."""
    axes = -way.turns.as_matrix()[:, :, 2]
    rows = np.hstack([1e3 * way.positions, axes])
    points = (f"GOTO/{','.join(f'{value:.8f}' for value in row)}" for row in rows)
    return "PARTNO WELD\nUNITS/MM\nMULTAX/ON\n" + _lines(points) + "FINI\n"


def gcode_text(way: Way) -> str:
    """A program of a mill with three axes; the rotations are not in it."""
    points = (f"G1 X{x:.6f} Y{y:.6f} Z{z:.6f} F600" for x, y, z in 1e3 * way.positions)
    return "%\nO1000\nG21 G90 G17\n" + _lines(points) + "M30\n%\n"


WRITERS: dict[str, Callable[[Way], str]] = {
    "csv": csv_text,
    "json": json_text,
    "ros": ros_text,
    "ur": ur_text,
    "kuka": kuka_text,
    "abb": abb_text,
    "fanuc": fanuc_text,
    "apt": apt_text,
    "gcode": gcode_text,
}
"""By the names of `duocell.models.task_files.reading.FORMATS`."""


def _lines(lines: Iterable[str]) -> str:
    return "".join(f"{line}\n" for line in lines)


def _mm_and_degrees(way: Way, sequence: Literal["xyz", "ZYX"]) -> Iterable[tuple[Floats, Floats]]:
    return zip(1e3 * way.positions, way.turns.as_euler(sequence, degrees=True), strict=True)
