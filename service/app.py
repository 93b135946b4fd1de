"""The web application: the parts of the service, put together."""

from __future__ import annotations

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from fastapi.telemetry import TelemetryConfig

from duocell.service.api import docs, evaluate, events, exports, health, layouts, meshes, robots, tasks
from duocell.service.api import imports as imports_api
from duocell.service.api.state import State
from duocell.service.common.issues import InvalidRequest
from duocell.service.common.problems import Problem
from duocell.service.common.version import package_version
from duocell.service.http import error_handlers, openapi
from duocell.service.http.keys import keyring
from duocell.service.http.middleware import stack
from duocell.service.jobs.active import Rules
from duocell.service.jobs.evaluations import Evaluations
from duocell.service.jobs.job_store import JobStore
from duocell.service.jobs.jobs import Capacity, Jobs
from duocell.service.library.library import Library
from duocell.service.library.robots import load_catalogue, take_catalogue
from duocell.service.observability import metrics, telemetry
from duocell.service.settings import Settings
from duocell.service.store.sql import SqlJobStore
from duocell.service.uploads.imports import Imports
from duocell.service.uploads.places import upload_places
from duocell.service.workers.acceptance import Acceptance
from duocell.service.workers.executor import Executor
from duocell.service.workers.health import Monitor
from duocell.service.workers.import_worker import ImportWorker, Words
from duocell.service.workers.pool import ProcessExecutor

log = logging.getLogger(__name__)

STATIC = Path(__file__).parent / "static"

TASKS = Words("Reading it", "DUOCELL_ACCEPT_LIMIT", "Send fewer way-points.")
LOAD_WITHIN = 60.0
"""s for the catalogue."""


def create_app(
    settings: Settings | None = None,
    executor: Executor | None = None,
    traces: TelemetryConfig | None = None,
    store: JobStore | None = None,
) -> FastAPI:
    """The application.

    Args:
        settings: default: from the environment.
        executor: where solves run; default: warm processes. It is started and stopped with the application.
        traces: OpenTelemetry providers; default: what OTEL_* variables ask for, nothing without them.
        store: where jobs are kept; default: as the settings say. It is opened and closed with the application.

    Raises:
        KeysUnusable: the API keys of the settings cannot be used.
    """
    settings = settings or Settings()
    runs_on = executor or ProcessExecutor(settings.workers, settings.data_dir)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        runs_on.start()
        jobs = Jobs(
            SqlJobStore(settings.store_url()) if store is None else store,
            runs_on,
            Rules(settings.workers, settings.max_attempts, settings.time_limit, settings.grace),
            Capacity(settings.max_queued, settings.max_queued_in_all, settings.keep_jobs),
        )
        await jobs.start()
        metrics.watch(workers=runs_on.alive, queued=lambda: jobs.waiting, running=lambda: jobs.running)
        import_worker = ImportWorker(settings.upload_time_limit)
        task_worker = ImportWorker(settings.accept_limit, TASKS)
        monitor = Monitor(runs_on, settings.self_test_every)
        acceptance = Acceptance(settings)
        evaluations = Evaluations(runs_on, limit=settings.evaluate_limit, most=settings.max_evaluations)
        library, imports, places = Library(settings.data_dir), Imports(), upload_places(settings)
        app.state.duocell = State(
            settings, jobs, acceptance, evaluations, monitor, library, import_worker, task_worker, places, imports
        )
        background = [asyncio.create_task(monitor.watch()), asyncio.create_task(_load_robots(monitor))]
        try:
            yield
        finally:
            for task in background:
                task.cancel()
            await asyncio.gather(*background, return_exceptions=True)
            await jobs.close(settings.drain)
            await acceptance.stop()
            await imports.stop()
            await import_worker.stop()
            await task_worker.stop()
            await runs_on.stop()

    app = FastAPI(
        title="duocell",
        version=package_version(),
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        telemetry={**telemetry.config(), **(traces or {})},
    )
    error_handlers.install(app)
    for part in (evaluate, layouts, exports, events, tasks, robots, imports_api, meshes, health, docs):
        app.include_router(part.router)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    openapi.install(app)
    stack.install(app, settings, keyring(settings))
    return app


async def _load_robots(monitor: Monitor) -> None:
    """Load the catalogue once nothing more urgent is to be done, in a process for this alone: nobody waits for it."""
    await monitor.first_pass.wait()
    elsewhere = ImportWorker(LOAD_WITHIN)
    try:
        take_catalogue(await elsewhere.run(load_catalogue))
    except (InvalidRequest, Problem) as error:
        log.warning("the list of robots is made when it is asked for: %s", error)
    finally:
        await elsewhere.stop()
