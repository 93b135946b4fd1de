"""Uploads that stall, and clients that send many, keep nobody else from bringing theirs."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi import FastAPI

from duocell.service.app import create_app
from duocell.service.common.problems import Problem
from duocell.service.settings import Settings
from duocell.service.uploads.places import Places
from tests.service.conftest import FakeExecutor
from tests.support.given.own_robot import urdf

TYPE = {"Content-Type": "multipart/form-data; boundary=here"}
BARE = {"name": (None, "own"), "urdf": ("own.urdf", urdf({}))}


def asker(app: FastAPI, address: str) -> httpx2.AsyncClient:
    return httpx2.AsyncClient(transport=httpx2.ASGITransport(app, client=(address, 1)), base_url="http://here")


class Stalled:
    """Uploads that begin and do not go on until they are let."""

    def __init__(self) -> None:
        self._end = asyncio.Event()
        self._tasks: list[asyncio.Task[Any]] = []

    async def add(self, client: httpx2.AsyncClient) -> None:
        """Returns when the service waits for the rest of another one."""
        waits = asyncio.Event()

        async def body() -> AsyncIterator[bytes]:
            yield b'--here\r\nContent-Disposition: form-data; name="name"\r\n\r\nhalf'
            waits.set()
            await self._end.wait()

        task = asyncio.create_task(client.post("/v1/robots", content=body(), headers=TYPE))
        self._tasks.append(task)
        looked = asyncio.create_task(waits.wait())
        await asyncio.wait([task, looked], return_when=asyncio.FIRST_COMPLETED)
        looked.cancel()

    async def statuses(self) -> list[int]:
        self._end.set()
        return [answer.status_code for answer in await asyncio.gather(*self._tasks)]


def test_stalled_uploads_lock_nobody_out(tmp_path: Path) -> None:
    settings = Settings(data_dir=tmp_path, max_arriving=5, max_arriving_in_all=7)

    async def trial() -> None:
        app = create_app(settings, FakeExecutor())
        async with app.router.lifespan_context(app), asker(app, "10.0.0.1") as one, asker(app, "10.0.0.2") as two:
            stalled = Stalled()
            for _ in range(4):
                await stalled.add(one)
            for client, name in ((one, "fifth"), (two, "other")):
                answer = await client.post("/v1/robots", files=BARE | {"name": (None, name)})
                assert answer.status_code == 201, answer.text
            await stalled.add(one)
            refused = await one.post("/v1/robots", files=BARE)
            assert (refused.status_code, refused.json()["code"]) == (429, "uploads-full")
            assert "5 of your uploads are arriving already (DUOCELL_MAX_ARRIVING)" in refused.json()["detail"]
            assert refused.headers["retry-after"] == "5"
            assert (await two.post("/v1/robots", files=BARE | {"name": (None, "second")})).status_code == 201
            for _ in range(2):
                await stalled.add(two)
            full = await two.post("/v1/robots", files=BARE)
            assert "7 uploads are arriving already (DUOCELL_MAX_ARRIVING_IN_ALL)" in full.json()["detail"]
            assert await stalled.statuses() == [422] * 7  # incomplete
            assert (await one.post("/v1/robots", files=BARE)).status_code == 201

    asyncio.run(trial())


def test_the_last_place_is_not_for_the_client_that_has_the_others() -> None:
    places = Places(2, 3, "being read", ("OF_ONE", "OF_ALL"))
    with places.taken("one"), places.taken("one"):
        with pytest.raises(Problem, match="2 of your uploads are being read already"):
            places.check("one")
        with places.taken("two"), pytest.raises(Problem, match="3 uploads are being read already"):
            places.check("three")
        places.check("two")
    places.check("one")
