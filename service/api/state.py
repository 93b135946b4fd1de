"""What endpoints share; it lives as long as the app."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from fastapi import Depends, Request

from duocell.service.jobs.evaluations import Evaluations
from duocell.service.jobs.jobs import Jobs
from duocell.service.library.library import Library
from duocell.service.settings import Settings
from duocell.service.uploads.imports import Imports
from duocell.service.uploads.places import UploadPlaces
from duocell.service.workers.acceptance import Acceptance
from duocell.service.workers.health import Monitor
from duocell.service.workers.import_worker import ImportWorker


@dataclass(frozen=True, slots=True)
class State:
    """The parts of a running service."""

    settings: Settings
    jobs: Jobs
    acceptance: Acceptance
    evaluations: Evaluations
    monitor: Monitor
    library: Library
    import_worker: ImportWorker
    task_worker: ImportWorker
    places: UploadPlaces
    imports: Imports


async def _state(request: Request) -> State:
    state: State = request.app.state.duocell
    return state


StateOf = Annotated[State, Depends(_state)]
