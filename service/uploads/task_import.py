"""From a file to a task; runs in a process of its own, which must not wait for a web framework to be loaded."""

from __future__ import annotations

from duocell.models.base.pose import quaternion_from_rotation
from duocell.models.task_files.errors import InvalidTaskFile
from duocell.models.task_files.found import Options
from duocell.models.task_files.reading import Resampling, TaskFile, read_task_file
from duocell.service.common.issues import InvalidRequest, Issue
from duocell.service.schemas.uploads import ImportedTask, UnderstoodFile
from duocell.service.settings import Limits
from duocell.service.validation.count_limits import CODE

ANGLE_TOLERANCE = 0.01
"""rad, where only a tolerance is given."""


def task_text(data: bytes, file: str, options: Options, resampling: Resampling | None, limits: Limits) -> str:
    """As `imported`, as JSON; runs in a process of its own."""
    return imported(data, file, options, resampling, limits).model_dump_json()


def imported(data: bytes, file: str, options: Options, resampling: Resampling | None, limits: Limits) -> ImportedTask:
    """The task in a file.

    Args:
        data, file, options, resampling: see `duocell.models.task_files.reading.read_task_file`.
        limits: how many poses a task may have.

    Raises:
        InvalidRequest: the file cannot be understood, or is too long.
    """
    try:
        found = read_task_file(data, file, options, resampling)
    except InvalidTaskFile as error:
        raise InvalidRequest([Issue("/file", error.detail, error.code)]) from error
    if len(found.poses) > limits.max_poses:
        advice = "Send a tolerance, or split it." if resampling is None else "Send a larger tolerance, or split it."
        detail = f"{len(found.poses)} poses; allowed are {limits.max_poses} (DUOCELL_MAX_POSES). {advice}"
        raise InvalidRequest([Issue("/file", detail, CODE)])
    return _document(found)


def _document(found: TaskFile) -> ImportedTask:
    quaternions = quaternion_from_rotation(found.poses[:, :3, :3]).tolist()
    poses = [
        {"position": position, "orientation": {"quaternion": quaternion}}
        for position, quaternion in zip(found.poses[:, :3, 3].tolist(), quaternions, strict=True)
    ]
    understood = UnderstoodFile.of(
        found,
        columns=list(found.columns),
        guessed=list(found.guessed),
        notes=list(found.notes),
        kept=len(found.poses),
    )
    return ImportedTask.model_validate({"task": {"poses": poses}, "understood": understood})
