"""A family: several jobs that one layout has to serve, as one task."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isfinite

import numpy as np

from duocell.models.base.errors import InvalidTask
from duocell.models.cell.task import Task


@dataclass(frozen=True, eq=False, slots=True)
class Job:
    """One job of a family.

    Attributes:
        name: label given by the user.
        task: its poses; no family itself.
        weight: >= 0, what each of its poses counts for in the objective.
    """

    name: str
    task: Task
    weight: float = 1.0


def family(jobs: Sequence[Job]) -> Task:
    """Several jobs as one task, for a layout that serves them all.

    Args:
        jobs: at least one.

    Raises:
        InvalidTask: no job (pointer ``""``), or a weight that is negative or no number (pointer ``/k/weight``).
    """
    if not jobs:
        raise InvalidTask("a family has at least one job.", "")
    for k, job in enumerate(jobs):
        if not (isfinite(job.weight) and job.weight >= 0.0):
            raise InvalidTask(
                f"the weight of a job is {job.weight:g}; it must be a number >= 0 (0: the job has to be possible, "
                "but does not count in the objective).",
                f"/{k}/weight",
            )
        if len(job.task.starts) > 1:
            raise ValueError(f"job {k} is a family itself")
    lengths = [len(job.task) for job in jobs]
    return Task(
        poses=np.concatenate([job.task.poses for job in jobs]),
        starts=tuple(int(start) for start in np.cumsum([0, *lengths[:-1]])),
        names=tuple(job.name for job in jobs),
        weights=np.concatenate([job.weight * job.task.weights for job in jobs]),
    )
