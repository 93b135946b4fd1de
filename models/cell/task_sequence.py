"""A task sequence: several segments that one layout has to serve, as one task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from duocell.models.base.errors import InvalidTask
from duocell.models.cell.task import Task


@dataclass(frozen=True, eq=False, slots=True)
class TaskSegment:
    """One segment of a task sequence.

    Attributes:
        name: label given by the user.
        task: its poses; no task sequence itself.
        weight: >= 0, what each of its poses counts for in the objective.
    """

    name: str
    task: Task
    weight: float = 1.0


def task_sequence(segments: Sequence[TaskSegment]) -> Task:
    """Several segments as one task, for a layout that serves them all.

    Args:
        segments: at least one.

    Raises:
        InvalidTask: no segment (pointer ``""``), or a weight that is negative or no number (pointer ``/k/weight``).
    """
    if not segments:
        raise InvalidTask("a family has at least one job.", "")
    for k, segment in enumerate(segments):
        if not (isfinite(segment.weight) and segment.weight >= 0.0):
            raise InvalidTask(
                f"the weight of a job is {segment.weight:g}; it must be a number >= 0 (0: the job has to be possible, "
                "but does not count in the objective).",
                f"/{k}/weight",
            )
        if len(segment.task.starts) > 1:
            raise ValueError(f"job {k} is a family itself")
    lengths = [len(segment.task) for segment in segments]
    return Task(
        poses=np.concatenate([segment.task.poses for segment in segments]),
        starts=tuple(int(start) for start in np.cumsum([0, *lengths[:-1]])),
        names=tuple(segment.name for segment in segments),
        weights=np.concatenate([segment.weight * segment.task.weights for segment in segments]),
    )
