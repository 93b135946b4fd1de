"""What is whose: where keys are in use, each sees and changes its own alone, unless all are shared."""

from __future__ import annotations

from fastapi import Request

from duocell.service.api.state import State
from duocell.service.common.problems import Problem
from duocell.service.jobs.job import Job, is_job_id
from duocell.service.library.document_stores import View
from duocell.service.library.library import Library


def client_of(request: Request) -> str:
    """Who asks, as far as clients are told apart; their jobs take turns, and their idempotency keys are their own."""
    return str(request.scope.get("duocell.key") or "")


def only_client(request: Request, state: State) -> str | None:
    """Whose layouts the asker may see; None: everybody's."""
    return None if state.settings.shared else client_of(request) or None


def library_of(request: Request, state: State) -> Library:
    """Robots and meshes as the asker sees them."""
    return state.library.seen_by(view_of(request, state))


def view_of(request: Request, state: State) -> View:
    """What of robots and meshes the asker sees."""
    client = client_of(request)
    return View(state.settings.data_dir.absolute(), client, state.settings.shared or not client)


async def own_layout(layout_id: str, request: Request, state: State) -> Job:
    """A layout that the asker may see.

    Raises:
        Problem: there is none; that of another key is none.
    """
    job = await state.jobs.get(layout_id) if is_job_id(layout_id) else None
    if job is None or only_client(request, state) not in (None, job.client):
        raise not_found(layout_id)
    return job


def not_found(layout_id: str) -> Problem:
    """There is no such layout."""
    detail = f"There is no layout {layout_id[:80]!r}; old ones are forgotten. Send its request again, or see the list."
    return Problem("layout-not-found", detail)
