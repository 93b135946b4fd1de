"""The web application: the parts of the service, put together."""

from __future__ import annotations

import asyncio
import threading
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from fastapi import FastAPI
from fastapi.openapi.docs import get_swagger_ui_html
from fastapi.responses import HTMLResponse
from fastapi.staticfiles import StaticFiles

from service import error_handlers, openapi
from service.api import evaluate, events, health, layouts, robots
from service.api.state import State
from service.dispatch import Rules
from service.evaluations import Evaluations
from service.executor import Executor
from service.health import Monitor
from service.jobs import Capacity, Jobs
from service.pool import ProcessExecutor
from service.robots import robot_list
from service.settings import Settings
from service.store.job_store import JobStore
from service.store.sql import SqlJobStore
from service.version import package_version

STATIC = Path(__file__).parent / "static"
NO_ICON = "data:,"
"""An icon that is no request."""


def create_app(
    settings: Settings | None = None, executor: Executor | None = None, store: JobStore | None = None
) -> FastAPI:
    """The application.

    Args:
        settings: default: from the environment.
        executor: where solves run; default: warm processes. It is started and stopped with the application.
        store: where jobs are kept; default: as the settings say. It is opened and closed with the application.
    """
    settings = settings or Settings()
    runs_on = executor or ProcessExecutor(settings.workers)

    @asynccontextmanager
    async def lifespan(app: FastAPI) -> AsyncIterator[None]:
        runs_on.start()
        jobs = Jobs(
            SqlJobStore(settings.store_url()) if store is None else store,
            runs_on,
            Rules(settings.workers, settings.max_attempts, settings.time_limit, settings.grace),
            Capacity(settings.max_queued, settings.keep_jobs),
        )
        await jobs.start()
        monitor = Monitor(runs_on, settings.self_test_every)
        evaluations = Evaluations(runs_on, limit=settings.evaluate_limit, most=settings.max_evaluations)
        app.state.duocell = State(settings, jobs, evaluations, monitor)
        background = [asyncio.create_task(monitor.watch()), asyncio.create_task(_load_robots(monitor))]
        try:
            yield
        finally:
            for task in background:
                task.cancel()
            await asyncio.gather(*background, return_exceptions=True)
            await jobs.close(settings.drain)
            await runs_on.stop()

    app = FastAPI(
        title="duocell",
        version=package_version(),
        lifespan=lifespan,
        docs_url=None,
        redoc_url=None,
    )
    error_handlers.install(app)
    for part in (evaluate, layouts, events, robots, health):
        app.include_router(part.router)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    app.add_api_route("/docs", _docs, include_in_schema=False, response_class=HTMLResponse)
    openapi.install(app)
    return app


async def _docs() -> HTMLResponse:
    """Forms for every request; everything they load comes from here."""
    return get_swagger_ui_html(
        openapi_url="/openapi.json",
        title="duocell",
        swagger_js_url="/static/swagger-ui/swagger-ui-bundle.js",
        swagger_css_url="/static/swagger-ui/swagger-ui.css",
        swagger_favicon_url=NO_ICON,
    )


async def _load_robots(monitor: Monitor) -> None:
    """Load the catalogue once nothing more urgent is to be done, so that nobody waits for it."""
    await monitor.first_pass.wait()
    threading.Thread(target=robot_list, name="load-robots", daemon=True).start()
