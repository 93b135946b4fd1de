"""Every kind of file, written by scipy from poses that are known, is read as these poses."""

from __future__ import annotations

from math import cos, pi, sin

import numpy as np
import pytest
from numpy.typing import ArrayLike
from scipy.spatial.transform import Rotation

from bench.draws.task_file_draw import WRITERS, Way, drawn_way
from duocell.models.base.arrays import Floats
from duocell.models.task_files.found import Options
from duocell.models.task_files.reading import FORMATS, TaskFile, read_task_file


def read(text: str, **options: object) -> TaskFile:
    return read_task_file(text.encode(), "", Options(**options))  # type: ignore[arg-type]


def expect(found: TaskFile, positions: ArrayLike, turns: Rotation, tolerance: float = 2e-8) -> None:
    np.testing.assert_allclose(found.poses[:, :3, 3], np.array(positions), rtol=0.0, atol=tolerance)
    np.testing.assert_allclose(found.poses[:, :3, :3], turns.as_matrix(), rtol=0.0, atol=10.0 * tolerance)


@pytest.mark.parametrize("name", [name for name in WRITERS if not name.startswith(("apt", "gcode"))])
def test_what_was_written_is_read(name: str) -> None:
    way = drawn_way(np.random.default_rng(1), 30)
    found = read(WRITERS[name](way))
    assert (found.format, found.read, found.free_roll) == (name, 30, False)
    expect(found, way.positions, way.turns)


@pytest.mark.parametrize("name", ["apt", "gcode"])
def test_a_tool_path_gives_the_axis_and_turns_as_little_as_it_can(name: str) -> None:
    way = drawn_way(np.random.default_rng(2), 30)
    found = read(WRITERS[name](way))
    assert (found.format, found.rotation, found.free_roll) == (name, "tool_axis", True)
    axes = way.turns.as_matrix()[:, :, 2] if name == "apt" else np.tile([0.0, 0.0, -1.0], (30, 1))
    np.testing.assert_allclose(found.poses[:, :3, 3], way.positions, rtol=0.0, atol=1e-8)
    np.testing.assert_allclose(found.poses[:, :3, 2], axes, rtol=0.0, atol=1e-7)
    np.testing.assert_allclose(np.linalg.det(found.poses[:, :3, :3]), 1.0, rtol=0.0, atol=1e-12)
    for before, after in zip(found.poses[:-1, :3, 0], found.poses[1:, :3, :3], strict=True):
        # Of all directions across the axis the next x axis is the nearest to the one before.
        nearest = max(
            (cos(a) * after[:, 0] + sin(a) * after[:, 1] for a in np.linspace(0.0, 2.0 * pi, 721)), key=before.dot
        )
        assert before @ after[:, 0] >= before @ nearest - 1e-12


def test_every_kind_of_file_has_a_writer() -> None:
    assert WRITERS.keys() == FORMATS.keys()


@pytest.mark.parametrize(
    ("rotation", "written"),
    [
        ("axis_angle", lambda turns: turns.as_rotvec()),
        ("axis_angle_deg", lambda turns: turns.as_rotvec(degrees=True)),
        ("rpy", lambda turns: turns.as_euler("xyz")),
        ("rpy_deg", lambda turns: turns.as_euler("xyz", degrees=True)),
        ("abc_deg", lambda turns: turns.as_euler("ZYX", degrees=True)),
        ("wpr_deg", lambda turns: turns.as_euler("xyz", degrees=True)),
        ("euler_zyz", lambda turns: turns.as_euler("ZYZ")),
        ("euler_zyz_deg", lambda turns: turns.as_euler("ZYZ", degrees=True)),
        ("quaternion", lambda turns: turns.as_quat()),
        ("quaternion_wxyz", lambda turns: turns.as_quat(scalar_first=True)),
        ("matrix", lambda turns: turns.as_matrix().reshape(-1, 9)),
    ],
)
def test_lists_of_numbers_in_every_convention(rotation: str, written: object) -> None:
    way = drawn_way(np.random.default_rng(3), 12)
    numbers: Floats = written(way.turns)  # type: ignore[operator]
    rows = np.hstack([way.positions, numbers]).tolist()
    expect(read(f'{{"waypoints": {rows}}}', rotation=rotation), way.positions, way.turns, 1e-12)


def test_transforms_row_by_row() -> None:
    way = drawn_way(np.random.default_rng(4), 5)
    poses = np.tile(np.eye(4), (5, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = way.turns.as_matrix(), way.positions
    for some in (poses, poses[:, :3], poses.reshape(5, 16), poses[:, :3].reshape(5, 12)):
        expect(read(str(some.tolist())), way.positions, way.turns, 1e-12)


TABLES = {
    "spreadsheet": ("X [mm];Y [mm];Z [mm];A;B;C", "100,5;200;{z};90;0;180", "mm", "abc_deg"),
    "blanks": ("# a comment\nx y z roll pitch yaw", "100.5  200 {z} 180.0 0 90", "mm", "rpy_deg"),
    "metres": ("pos_x_m,pos_y_m,pos_z_m,w,p,r,speed", ".1005,.2,.{z},180,0,90,fast", "m", "wpr_deg"),
    "tabs": ("x\ty\tz\tq1\tq2\tq3\tq4", "100.5\t200\t{z}\t0\t.70710678\t.70710678\t0", "mm", "quaternion_wxyz"),
    "millimetres": ("x_mm,y_mm,z_mm,roll_rad,pitch_rad,yaw_rad", "100.5,200,{z},3.14159265,0,1.57079633", "mm", "rpy"),
    "centimetres": ("x_cm,y_cm,z_cm,rx_deg,ry_deg,rz_deg", "10.05,20,{z}e-1,180,0,90", "cm", "rpy_deg"),
}


@pytest.mark.parametrize("name", TABLES)
def test_tables_tell_units_and_convention(name: str) -> None:
    head, row, units, rotation = TABLES[name]
    text = "\n".join([head, row.format(z="300"), row.format(z="301")])
    found = read(text, rotation="rpy_deg") if "rx" in text else read(text)
    assert (found.units, found.rotation) == (units, rotation)
    turn = Rotation.from_euler("xyz", [[180.0, 0.0, 90.0]] * 2, degrees=True)
    expect(found, [[0.1005, 0.2, 0.3], [0.1005, 0.2, 0.301]], turn, 1e-8)


def test_what_is_guessed_is_told() -> None:
    found = read("x,y,z,roll,pitch,yaw\n1,2,3,0,0,1\n1,2,4,0,0,1.5")
    assert (found.units, found.rotation) == ("m", "rpy")
    assert [word in sentence for word, sentence in zip(("unit is m,", "radians"), found.guessed, strict=True)] == [
        True
    ] * 2
    assert read("x_m,y_m,z_m,qx,qy,qz,qw\n1,2,3,0,0,0,1\n1,2,4,0,0,0,1").guessed == ()


def test_columns_may_be_named_by_the_sender() -> None:
    columns = ("number", "x", "y", "z", "qx", "qy", "qz", "qw")
    found = read("7 100 200 300 0 0 0 1\n8 100 200 310 0 0 0 1", columns=columns)
    expect(found, [[0.1, 0.2, 0.3], [0.1, 0.2, 0.31]], Rotation.identity(2))
    assert "'number'" in found.notes[0]


def test_positions_alone_do_not_turn_where_that_is_said() -> None:
    expect(read("x,y,z\n1,2,3\n1,2,4", rotation="none"), [[1.0, 2.0, 3.0], [1.0, 2.0, 4.0]], Rotation.identity(2))


def test_the_pose_of_a_moveit_goal() -> None:
    goal = """\
  - req:
      goal_constraints:
        - position_constraints:
            - header: {{frame_id: base_link}}
              constraint_region:
                primitive_poses:
                  - position: {{x: {x}, y: 0.2, z: 0.3}}
                    orientation: {{x: 0, y: 0, z: 0, w: 1}}
          orientation_constraints:
            - orientation: {{x: 1, y: 0, z: 0, w: 0}}
"""
    found = read("items:\n" + goal.format(x=0.1) + goal.format(x=0.4))
    expect(found, [[0.1, 0.2, 0.3], [0.4, 0.2, 0.3]], Rotation.from_quat([[1.0, 0.0, 0.0, 0.0]] * 2))


UR = """\
global a = p[0.1, 0, 0, 0, 0, 0]
b = p[0.2,0,0,0,0,0]  # a comment
q = [0,1,2,3,4,5]
movej(q)
movel(b, a=1)
movec(a, b)
"""
KUKA = """\
DECL POS XA={X 100,Y 0,Z 0,A 0,B 0,C 0}
DECL E6AXIS XH={A1 0,A2 1,A3 2,A4 3,A5 4,A6 5}
;FOLD PTP XOLD
PTP XH
LIN XA C_DIS
CIRC {X 200,Y 0,Z 0,A 0,B 0,C 0},XA,CA 360
"""
REST = "[0,0,0,0],[9E9,9E9,9E9,9E9,9E9,9E9]"
ABB = f"""\
! MoveL old,v1,fine,tool0;
CONST robtarget a:=[[100,0,0],[1,0,0,0],{REST}];
MoveAbsJ home,v100,fine,tool0;
MoveL Offs(a,0,0,50),v100,z10,tool0;
MoveC Offs(a,10,0,0),a,v100,fine,tool0;
MoveL [[1,2,3],[1,0,0,0],{REST}],v100,fine,tool0;
"""


def test_points_and_moves_of_programs() -> None:
    found = read(UR)
    expect(found, [[0.2, 0, 0], [0.1, 0, 0], [0.2, 0, 0]], Rotation.identity(3))
    assert any("1 targets were left out" in note for note in found.notes)
    expect(read(KUKA), [[0.1, 0, 0], [0.2, 0, 0], [0.1, 0, 0]], Rotation.identity(3))
    expect(read(ABB), [[0.1, 0, 0.05], [0.11, 0, 0], [0.1, 0, 0], [0.001, 0.002, 0.003]], Rotation.identity(4))


def test_points_of_a_program_that_does_not_move() -> None:
    found = read("\n".join(KUKA.split("\n")[:2]) + "\nDECL POS XB={X 1,Y 0,Z 0,A 0,B 0,C 0}")
    expect(found, [[0.1, 0, 0], [0.001, 0, 0]], Rotation.identity(2))
    assert "joint values" in found.notes[0]
    assert "Nothing moves" in found.notes[1]


@pytest.mark.parametrize(
    "arc",
    [
        "G2 X100 Y0 I50 J0",
        "G2 X100 Y0 R50",
        "G91 G2 X100 Y0 I50",
    ],
)
def test_arcs_become_chords_within_the_tolerance(arc: str) -> None:
    found = read(f"G21 G90 G17\nG0 X0 Y0 Z10\n{arc} F100\n", arc_tolerance=1e-4)
    points = found.poses[:, :3, 3]
    radii = np.hypot(points[:, 0] - 0.05, points[:, 1])
    np.testing.assert_allclose(radii, 0.05, rtol=0.0, atol=1e-12)
    assert (points[1:-1, 1] > 0.0).all()  # clockwise from the left over the top
    middles = 0.5 * (points[1:] + points[:-1])
    sags = 0.05 - np.hypot(middles[:, 0] - 0.05, middles[:, 1])
    assert 0.5e-4 < sags.max() <= 1e-4 + 1e-12


def test_a_helix_and_whole_circles_in_other_planes() -> None:
    found = read("G21 G18\nG0 X0 Y0 Z0\nG3 X0 Y20 Z0 I0 K30\n", arc_tolerance=1e-4)
    points = found.poses[:, :3, 3]
    np.testing.assert_allclose(np.hypot(points[:, 0], points[:, 2] - 0.03), 0.03, rtol=0.0, atol=1e-12)
    np.testing.assert_allclose(np.diff(points[:, 1]), 0.02 / (len(points) - 1), rtol=0.0, atol=1e-12)
    # Seen from +y, with z to the right and x upwards (ISO 6983: G18 is the plane ZX), G3 turns counter-clockwise.
    angles = np.unwrap(np.arctan2(points[:, 0], points[:, 2] - 0.03))
    assert (np.diff(angles) > 0.0).all()
    assert angles[-1] - angles[0] == pytest.approx(2.0 * pi)


def test_a_direction_in_g_code_is_the_tool_axis() -> None:
    found = read("G1 X0 Y0 Z0 A3=0 B3=0 C3=1\nG1 X1 A3=0.6 B3=0 C3=0.8\n")
    np.testing.assert_allclose(found.poses[:, :3, 2], np.array([[0, 0, -1], [-0.6, 0, -0.8]]), rtol=0.0, atol=1e-12)


def test_statements_of_apt() -> None:
    text = "PARTNO/X $$ comment\nUNITS/INCHES\nTLAXIS/0,1,0\nFROM/9,9,9\n"
    text += "GOTO/1,$\n2,3\nGODLTA/0,0,1\nRAPID\nGOTO/0,0,0,0,0,1\n"
    found = read(text)
    np.testing.assert_allclose(found.poses[:, :3, 3], 0.0254 * np.array([[1, 2, 3], [1, 2, 4], [0, 0, 0]]), atol=1e-12)
    np.testing.assert_allclose(found.poses[:, :3, 2], [[0, -1, 0], [0, -1, 0], [0, 0, -1]], rtol=0.0, atol=1e-12)
    assert found.units == "inch"


def test_a_way_may_be_written_with_any_end_of_line() -> None:
    text = WRITERS["fanuc"](drawn_way(np.random.default_rng(5), 4))
    expected = read(text).poses
    for end in ("\r\n", "\r"):
        np.testing.assert_array_equal(read(text.replace("\n", end)).poses, expected)
    np.testing.assert_array_equal(read_task_file(b"\xef\xbb\xbf" + text.encode(), "W.LS").poses, expected)


def test_a_way_of_fifty_thousand_points_is_read() -> None:
    positions = np.linspace([0.0, 0.0, 0.0], [1.0, 1.0, 1.0], 50_000)
    way = Way(positions, Rotation.identity(50_000))
    found = read(WRITERS["csv"](way))
    assert found.read == 50_000
