"""``python -m bench.trials.urdf_files``: are URDF files as people publish them read as they are meant?

Every file is read as an upload is, with ``missing_meshes`` "estimate". It has to be accepted with the right chain, or
refused for the right reason; its forward kinematics are held against Pinocchio's own parser of the same text; and its
arm, whose drawing has a closed form, has to have postures.
"""

from __future__ import annotations

from collections.abc import Sequence
from xml.etree import ElementTree

import numpy as np
import pinocchio as pin

from bench.draws.urdf_draw import HABITS, Drawn, draw
from bench.trials.trial import Record, options_of, run, table
from duocell.models.base.arrays import Floats
from duocell.models.description.urdf_file import parse_document
from duocell.models.kinematics.kinematics import flange_poses
from duocell.models.kinematics.nominal import posture_form
from duocell.models.robot.robot import Robot
from duocell.service.common.issues import InvalidRequest
from duocell.service.settings import Limits
from duocell.service.uploads.robot_import import RobotFiles, robot_from_files
from tests.support.given.own_robot import zipped

COUNT = 400
POSTURES = 20
EQUAL = 1e-9
"""m, and entries of rotations."""


def attempt(seed: int) -> Record:
    """One file read and judged."""
    drawn = draw(seed)
    meshes = {name.removeprefix("package://"): data for name, data in drawn.meshes.items()}
    files = RobotFiles(
        "made", "made.urdf", drawn.text.encode(), zipped(meshes) if meshes else None, drawn.base_link, None, "estimate"
    )
    record: Record = {"habit": drawn.habit, "arm": drawn.arm, "fault": "", "error": None, "postures": None}
    try:
        robot = robot_from_files(files, Limits()).robot
    except InvalidRequest as error:
        said = " ".join(issue.detail for issue in error.issues)
        right = bool(drawn.refused) and drawn.refused in said
        return record | {"refused": said[:200], "fault": "" if right else f"refused: {said[:120]}"}
    record |= {"refused": None, "error": _away(drawn, robot), "postures": posture_form(robot) is not None}
    if drawn.refused:
        record["fault"] = f"accepted, though {drawn.refused}"
    elif (robot.base_frame, robot.flange_frame, robot.joint_names) != (drawn.base, drawn.tip, drawn.joints):
        record["fault"] = f"{robot.base_frame} to {robot.flange_frame} in the place of {drawn.base} to {drawn.tip}"
    elif record["error"] > EQUAL:
        record["fault"] = "forward kinematics"
    elif not record["postures"]:
        record["fault"] = "no postures"
    return record


def _away(drawn: Drawn, robot: Robot) -> float:
    """How far the flange is from where Pinocchio's parser of the same file puts it, over random postures."""
    document = parse_document(drawn.text.encode())
    kept = ElementTree.Element("robot", name="made")
    kept.extend(element for element in document if element.tag in ("link", "joint"))
    model = pin.buildModelFromXML(ElementTree.tostring(kept, encoding="unicode"))
    data, worst = model.createData(), 0.0
    q = np.random.default_rng(0).uniform(-3.0, 3.0, (POSTURES, robot.dof))
    poses = flange_poses(robot, q)
    for row, pose in zip(q, poses, strict=True):
        worst = max(worst, float(np.max(np.abs(_pose(model, data, robot, row) - pose))))
    return worst


def _pose(model: pin.Model, data: pin.Data, robot: Robot, row: Floats) -> Floats:
    """(4, 4) flange in the base frame by Pinocchio."""
    full = pin.neutral(model)
    for name, value in zip(robot.joint_names, row, strict=True):
        full[model.joints[model.getJointId(name)].idx_q] = value
    pin.framesForwardKinematics(model, data, full)
    base, tip = (data.oMf[model.getFrameId(name)] for name in (robot.base_frame, robot.flange_frame))
    pose: Floats = (base.inverse() * tip).homogeneous
    return pose


def say(record: Record) -> str:
    """One line of a record."""
    return f"{record['seed']} {record['habit']} {record['arm']} {record['fault'] or 'as it should be'}"


def summary(records: Sequence[Record]) -> str:
    """Habit by habit: files, accepted, with postures, farthest from Pinocchio, refused for the reason, faults."""
    rows = []
    for habit in [*HABITS, "all"]:
        some = [record for record in records if habit in ("all", record["habit"])]
        accepted = [record for record in some if record["refused"] is None]
        postures = sum(bool(record["postures"]) for record in accepted)
        worst = max((record["error"] for record in accepted), default=None)
        faults = [record["seed"] for record in some if record["fault"]]
        rows.append(
            [habit, len(some), len(accepted), postures, worst, len(some) - len(accepted), ", ".join(map(str, faults))]
        )
    return table(["habit", "files", "accepted", "with postures", "from Pinocchio", "refused", "faults"], rows)


def main(arguments: Sequence[str] | None = None) -> int:
    """Read what is asked for; 1 if a file is not read as it is meant."""
    records = run(options_of(__doc__, COUNT, arguments), attempt, say)
    print(summary(records))
    return int(any(record["fault"] for record in records))


if __name__ == "__main__":
    raise SystemExit(main())
