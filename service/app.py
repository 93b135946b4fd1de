"""The web application: the parts of the service, put together."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import FastAPI
from fastapi.staticfiles import StaticFiles
from fastapi.telemetry import TelemetryConfig

from service import error_handlers, metrics, openapi, telemetry
from service.api import docs, evaluate, health, layouts, meshes, robots
from service.api.state import State
from service.evaluations import Evaluations
from service.executor import Executor, ProcessExecutor
from service.health import Monitor
from service.intake import Intake
from service.jobs import MemoryJobs
from service.keys import keyring
from service.library import Library
from service.middleware import stack
from service.robots import catalogue_list
from service.settings import Settings
from service.version import package_version

STATIC = Path(__file__).parent / "static"


def create_app(
    settings: Settings | None = None, executor: Executor | None = None, traces: TelemetryConfig | None = None
) -> FastAPI:
    """The application.

    Args:
        settings: default: from the environment.
        executor: where solves run; default: warm processes. It is started and stopped with the application.
        traces: OpenTelemetry providers; default: what OTEL_* variables ask for, nothing without them.

    Raises:
        KeysUnusable: the API keys of the settings cannot be used.
    """
    settings = settings or Settings()
    runs_on = executor or ProcessExecutor(settings.workers, settings.data_dir)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        runs_on.start()
        jobs = MemoryJobs(
            runs_on,
            workers=settings.workers,
            time_limit=settings.time_limit,
            grace=settings.grace,
            max_queued=settings.max_queued,
            keep=settings.keep_jobs,
        )
        metrics.watch(workers=runs_on.alive)
        intake = Intake(settings.upload_time_limit, settings.max_uploads)
        monitor = Monitor(runs_on, settings.self_test_every)
        evaluations = Evaluations(runs_on, limit=settings.evaluate_limit, most=settings.max_evaluations)
        app.state.duocell = State(settings, jobs, evaluations, monitor, Library(settings.data_dir), intake)
        background = [asyncio.create_task(monitor.watch()), asyncio.create_task(_load_robots(monitor))]
        try:
            yield
        finally:
            for task in background:
                task.cancel()
            await asyncio.gather(*background, return_exceptions=True)
            await jobs.close()
            await asyncio.to_thread(intake.stop)
            await asyncio.to_thread(runs_on.stop)

    app = FastAPI(
        title="duocell",
        version=package_version(),
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
        telemetry={**telemetry.config(), **(traces or {})},
    )
    error_handlers.install(app)
    for part in (evaluate, layouts, robots, meshes, health, docs):
        app.include_router(part.router)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    openapi.install(app)
    stack.install(app, settings, keyring(settings))
    return app


async def _load_robots(monitor: Monitor) -> None:
    """Load the catalogue once nothing more urgent is to be done, so that nobody waits for it."""
    await monitor.first_pass.wait()
    threading.Thread(target=catalogue_list, name="load-robots", daemon=True).start()
