"""What is whose: where keys are in use, each sees and changes its own alone, unless all are shared."""

from __future__ import annotations

from typing import Annotated

from fastapi import Depends, Request

from duocell.service.api.state import StateOf
from duocell.service.common.problems import Problem
from duocell.service.jobs.job import Job, is_job_id
from duocell.service.library.document_stores import View
from duocell.service.library.library import Library


async def _client(request: Request) -> str:
    """Who asks, as far as clients are told apart; their jobs take turns, and their idempotency keys are their own."""
    return str(request.scope.get("duocell.key") or "")


Client = Annotated[str, Depends(_client)]
"""Who asks, "" if clients are not told apart."""


async def _only_client(client: Client, state: StateOf) -> str | None:
    return None if state.settings.shared else client or None


OnlyClient = Annotated[str | None, Depends(_only_client)]
"""Whose layouts the asker may see; None: everybody's."""


async def _view(client: Client, state: StateOf) -> View:
    return View(state.settings.data_dir.absolute(), client, state.settings.shared or not client)


OwnView = Annotated[View, Depends(_view)]
"""What of robots and meshes the asker sees."""


async def _library(view: OwnView, state: StateOf) -> Library:
    return state.library.seen_by(view)


OwnLibrary = Annotated[Library, Depends(_library)]
"""Robots and meshes as the asker sees them."""


async def _layout(layout_id: str, asker: OnlyClient, state: StateOf) -> Job:
    """A layout that the asker may see.

    Raises:
        Problem: there is none; that of another key is none.
    """
    job = await state.jobs.get(layout_id) if is_job_id(layout_id) else None
    if job is None or asker not in (None, job.client):
        raise not_found(layout_id)
    return job


OwnLayout = Annotated[Job, Depends(_layout)]
"""See `_layout`."""


def not_found(layout_id: str) -> Problem:
    """There is no such layout."""
    detail = f"There is no layout {layout_id[:80]!r}; old ones are forgotten. Send its request again, or see the list."
    return Problem("layout-not-found", detail)
