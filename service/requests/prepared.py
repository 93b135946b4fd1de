"""An accepted request as it is given to a worker: its poses are converted, and nothing is left to be checked.

Such a form lies beside the text of a job as long as the job waits or runs. The text stays what counts: answers show it,
it says all that the form says, and it is read again where there is no form, or one of another version.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from io import BytesIO
from typing import TypeVar

import numpy as np

from duocell.models.cell.cell import Cell
from duocell.models.cell.task import Task
from duocell.models.cell.task_sequence import TaskSegment, task_sequence
from duocell.service.library.library import Library
from duocell.service.requests.convert import cell_of
from duocell.service.schemas.pose import PoseList
from duocell.service.schemas.request import LayoutRequest
from duocell.service.schemas.task import FamilyJob

Asked = TypeVar("Asked", bound=LayoutRequest)

FORM = b"duocell request 1\n"
"""Begins every form; the number rises when what follows is to be read otherwise.

Two arrays in NumPy's own format follow: the bytes of the request's JSON, in which every list of poses is replaced by
their number, and (m, 4, 4) the poses of the task, segment after segment.
"""


def prepared(request: LayoutRequest, cell: Cell) -> bytes:
    """The form of a request.

    Args:
        request: that is accepted.
        cell: that it describes.
    """
    outline = json.dumps(request.model_dump(mode="json", context=len)).encode()
    form = BytesIO()
    form.write(FORM)
    for array in (np.frombuffer(outline, np.uint8), cell.task.poses):
        np.save(form, array, allow_pickle=False)
    return form.getvalue()


def is_prepared(form: bytes) -> bool:
    """Whether this version can read a form."""
    return form.startswith(FORM)


def read_accepted(kind: type[Asked], accepted: bytes | str, library: Library | None = None) -> tuple[Asked, Cell]:
    """An accepted request and the cell that it describes.

    Args:
        kind: of request.
        accepted: its form, or its JSON.
        library: what users brought.

    Raises:
        InvalidRequest: it names a robot or a mesh that is there no more.
    """
    request, task = request_of(kind, accepted)
    return request, cell_of(request, library, task)


def request_of(kind: type[Asked], accepted: bytes | str) -> tuple[Asked, Task | None]:
    """An accepted request, and its task if that is converted already.

    Args:
        kind: of request.
        accepted: its form, or its JSON.

    Returns:
        The request; read from a form, its lists of poses have positions only, and cannot be written. The task that a
        form holds.
    """
    if isinstance(accepted, str):
        return kind.model_validate_json(accepted), None
    file = BytesIO(accepted)
    file.seek(len(FORM))
    outline, poses = (np.load(file, allow_pickle=False) for _ in range(2))
    document = json.loads(outline.tobytes())
    paths = []
    for stated in [document["task"]] if document["tasks"] is None else [one["task"] for one in document["tasks"]]:
        count = stated["poses"] if "poses" in stated else next(iter(stated.values()))["count"]
        path, poses = Task(poses[:count]), poses[count:]
        paths.append(path)
        if "poses" in stated:
            stated["poses"] = PoseList(path.poses[:, :3, 3], ())
    request = kind.model_validate(document)
    return request, paths[0] if request.tasks is None else _sequence(request.tasks, paths)


def _sequence(segments: Sequence[FamilyJob], paths: Sequence[Task]) -> Task:
    """Converted segments under their names and weights."""
    return task_sequence([TaskSegment(one.name, path, one.weight) for one, path in zip(segments, paths, strict=True)])
