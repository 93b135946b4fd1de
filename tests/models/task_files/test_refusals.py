"""What is wrong with a file is told with its line, the value, and what is allowed; nothing makes the reader break."""

from __future__ import annotations

import contextlib
import time

import numpy as np
import pytest

from bench.draws.task_file_draw import WRITERS, drawn_way
from bench.trials.task_files import broken_files
from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.found import Options
from duocell.models.task_files.reading import FORMATS, read_task_file

HEAD = "x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,1\n"
KUKA = "DECL E6POS XA={X 1,Y 2,Z 3,A 0,B 0,C 0}\n"
FANUC = "/PROG A\n/MN\n1:L P[1] 1mm/sec FINE ;\n/POS\n"
POINT = "P[%s]{\n GP1:\n UF : %s, UT : 1,\n X = 1 %s, Y = 2 mm, Z = 3 mm,\n W = 0 deg, P = 0 deg, R = 0 deg\n};\n"

FAULTS: dict[str, tuple[str, str]] = {
    "nothing": ("", "the file is empty"),
    "zero bytes": ("a\0b", "no text"),
    "prose": ("Dear robot, please weld.\nThank you.", "Say which with `format`"),
    "one point": (HEAD, "1 way-points; a task needs at least two"),
    "missing column": ("x,y,qx,qy,qz,qw\n1,2,0,0,0,1", "line 1: column z is missing; there are 'x', 'y', 'qx'"),
    "part of a quaternion": ("x,y,z,qx,qy,qz\n1,2,3,0,0,0", "line 1: column qw is missing beside qx/qy/qz/qw"),
    "no orientation": ("x,y,z,speed\n1,2,3,4", "no columns of an orientation"),
    "mixed units": ("x_mm,y_mm,z_m,qx,qy,qz,qw\n1,2,3,0,0,0,1", "line 1: mixed units in 'x_mm', 'y_mm', 'z_m'"),
    "mixed angles": ("x,y,z,roll_deg,pitch_rad,yaw_deg\n1,2,3,0,0,0", "mixed units in 'roll_deg'"),
    "radians of KUKA": ("x,y,z,a_rad,b_rad,c_rad\n1,2,3,0,0,0", "mixed units: the columns"),
    "two tables": ("x,y,z,qx,qy,qz,qw,a,b,c\n1,2,3,0,0,0,1,0,0,0", "several orientations"),
    "twice": ("x,x,y,z,qx,qy,qz,qw\n1,1,2,3,0,0,0,1", "several columns 'x'"),
    "no number": (HEAD + "1,2,fast,0,0,0,1", "line 3, column 3: column 'z_m' is 'fast'; a plain number"),
    "infinite": (HEAD + "1,2,inf,0,0,0,1", "line 3, column 3: column 'z_m' is 'inf'"),
    "absurd": (HEAD + "1,2,1e300,0,0,0,1", "at most 1e+09"),
    "a cell too few": (HEAD + "1,2,3,0,0,0", "line 3: 6 cells, but the table has 7 columns"),
    "no unit quaternion": (HEAD + "1,2,3,0,0,0,2", "line 3: quaternion [x, y, z, w] has length 2"),
    "no names": ("1,2,3,0,0,0,1\n1,2,4,0,0,0,1", "line 1: the first line has 7 numbers and no names"),
    "ambiguous": ("x,y,z,rx,ry,rz\n1,2,3,0,0,0\n1,2,4,0,0,0", "say which with `rotation`"),
    "left-handed": ('[[1,0,0,0,0,1,0,0,0,0,-1,0],[1,0,0,0,0,1,0,0,0,0,1,0]]', "left-handed"),
    "far away": ("x_m,y_m,z_m,qx,qy,qz,qw\n0,0,0,0,0,0,1\n20000,0,0,0,0,0,1", "line 3: a coordinate is 20000 m"),
    "broken JSON": ("[[1, 2,\n 3,,]]", "line 2, column 4: this is no JSON"),
    "deep JSON": ("[" * 100_000, "no JSON|nested too deeply"),
    "empty list": ("[]", "a list of way-points is needed"),
    "seven numbers": ("[[1,2,3,0,0,0,1],[1,2,3,0,0,0,1]]", "quaternion or quaternion_wxyz"),
    "no pose": ('[{"position":[1,2,3]},{"position":[1,2,3]}]', "item 0 is no pose"),
    "two forms": (
        '[{"position":[1,2,3],"orientation":{"rpy":[0,0,0]}},{"position":[1,2,3],"orientation":{"abc_deg":[0,0,0]}}]',
        "item 1 has a abc_deg, those before a rpy",
    ),
    "broken YAML": ("poses:\n- position: {x: 1\n  y: [", "this is no YAML"),
    "aliases": ("poses:\n- &a {position: {x: 1, y: 2, z: 3}, orientation: {x: 0, y: 0, z: 0, w: 1}}\n- *a", "aliases"),
    "deep YAML": ("pose: " + "[" * 1000, "nested deeper than 40 levels"),
    "no z": ("pose:\n  position: {x: 1, y: 2}\n  orientation: {x: 0, y: 0, z: 0, w: 1}", "line 2, column 13: "),
    "two frames": (
        "".join(
            f"header: {{frame_id: {name}}}\npose: {{position: [1,2,3], orientation: [0,0,0,1]}}\n---\n"
            for name in ("world", "camera")
        ),
        "frame_id is 'camera', before it was 'world'",
    ),
    "rotary axis": ("G1 X0 Y0 Z0\nG1 X1 A30", "line 2: the rotary axis A"),
    "canned cycle": ("G0 X0 Y0 Z0\nG81 X1 Y1 Z-1 R1", "line 2: G81 is not followed"),
    "inches later": ("G21\nG0 X0 Y0 Z0\nG20\nG0 X1", "line 3: mixed units"),
    "another zero point": ("G54\nG0 X0 Y0 Z0\nG55\nG0 X1", "line 3: G55 after G54"),
    "no arc": ("G0 X0 Y0 Z0\nG2 X10 Y0 I1 J0", "line 2: the ends of the arc"),
    "short radius": ("G0 X0 Y0 Z0\nG2 X10 Y0 R1", "no arc of radius 1"),
    "a circle in APT": ("GOTO/0,0,0\nCIRCLE/0,0,0,1", "line 2: arcs are not followed"),
    "units later": ("UNITS/MM\nGOTO/0,0,0\nUNITS/INCHES\nGOTO/1,1,1", "line 3: mixed units"),
    "two numbers": ("GOTO/0,0,0\nGOTO/1,2", "line 2: GOTO has 2 values, '1,2'; 3 or 6 numbers are needed"),
    "long axis": ("GOTO/0,0,0,0,0,1\nGOTO/0,0,0,0,0,2", "line 2: the tool axis has length 2"),
    "computed in UR": ("movel(pose_trans(p[0,0,0,0,0,0], p[1,0,0,0,0,0]))", "line 1: the target"),
    "five numbers": ("movel(p[1,2,3,4,5])", "line 1, column 9: a pose p[…] has 5 numbers"),
    "unknown in UR": ("a = p[0,0,0,0,0,0]\nmovel(b)", "line 2: the target 'b'"),
    "unknown in KUKA": (KUKA + "LIN XB", "line 2: there is no point 'XB'"),
    "no C": ("DECL E6POS XA={X 1,Y 2,Z 3,A 0,B 0}", "line 1, column 16: the position has no C"),
    "relative": (KUKA + "LIN_REL {X 1}", "line 2: relative moves"),
    "computed in ABB": ("MODULE A\nMoveL RelTool(p1,0,0,1),v1,fine,tool0;", "line 2: there is no point|computed"),
    "three of a quaternion": ("CONST robtarget a:=[[1,2,3],[1,0,0],[0,0,0,0]];", "3 and 3 numbers"),
    "list of targets": ("CONST robtarget a{2}:=[[1,2,3],[1,0,0,0],[0,0,0,0]];", "list of targets"),
    "register": ("/MN\n1:L PR[3] 1mm/sec FINE ;\n/POS\n" + POINT % (1, 0, "mm"), "line 2: PR[3] is a position"),
    "inches of FANUC": (FANUC + POINT % (1, 0, "inch"), "X is in inch; mm is needed: mixed units"),
    "two user frames": (
        "/MN\n1:L P[1] 1mm/sec FINE ;\n2:L P[2] 1mm/sec FINE ;\n/POS\n" + POINT % (1, 0, "mm") + POINT % (2, 1, "mm"),
        "user frame 1, tool 1, others in user frame 0",
    ),
}  # fmt: skip


@pytest.mark.parametrize("what", FAULTS)
def test_faults_are_told_with_their_place(what: str) -> None:
    text, words = FAULTS[what]
    with pytest.raises(InvalidTaskFile) as refused:
        read_task_file(text.encode())
    assert any(word in refused.value.detail for word in words.split("|")), refused.value.detail


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (Options(format="step"), "format is 'step'; it must be one of json, fanuc"),
        (Options(units="feet"), "units is 'feet'; it must be one of m, mm, cm, inch"),
        (Options(rotation="euler"), "rotation is 'euler'; it must be one of quaternion"),
        (Options(units="mm"), "mixed units"),
        (Options(rotation="rpy"), "are quaternion, not rpy"),
        (Options(columns=("x", "y", "z")), "7 cells, but 3 columns are named"),
        (Options(format="gcode"), "0 way-points"),
    ],
)
def test_what_is_said_of_a_file_is_held_against_it(options: Options, words: str) -> None:
    with pytest.raises(InvalidTaskFile) as refused:
        read_task_file((HEAD + "1,2,3,0,0,0,1\n").encode(), "way.csv", options)
    assert words in refused.value.detail


@pytest.mark.parametrize("name", WRITERS)
def test_broken_files_of_every_kind_are_refused_or_read(name: str) -> None:
    text = WRITERS[name](drawn_way(np.random.default_rng(7), 6))
    for data in broken_files(text, np.random.default_rng(8), 60):
        for options in (Options(), Options(format=name)):
            with contextlib.suppress(InvalidTaskFile):  # nothing else
                read_task_file(data, "", options)


HOSTILE = {
    "blanks": " " * 300_000,
    "lines": "\n" * 300_000 + "x",
    "a long number": "1" * 300_000,
    "brackets": "p[" * 100_000,
    "braces": "{" * 300_000,
    "names": "a" * 300_000,
    "assignments": "X = " * 80_000,
    "targets": "robtarget a := " * 20_000,
    "blanks behind a name": "movel(" + " " * 300_000 + "\nG1" + " " * 300_000 + "Z",
    "equal signs": "N1" * 100_000 + "\nx=" + " " * 100_000 + "p" + " " * 100_000 + "[",
}


@pytest.mark.parametrize("what", HOSTILE)
def test_nothing_takes_longer_than_its_length(what: str) -> None:
    before = time.process_time()
    for name in FORMATS:
        with pytest.raises(InvalidTaskFile):
            read_task_file(HOSTILE[what].encode(), "", Options(format=name))
    assert time.process_time() - before < 10.0  # some ms each; what grows with the square takes minutes
