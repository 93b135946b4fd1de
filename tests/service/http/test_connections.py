"""Connections on which nothing comes are closed; those with a request under way are not."""

import asyncio
from pathlib import Path
from typing import Any

import pytest
import uvicorn

from duocell.service.common.problems import Problem
from duocell.service.http import connections
from duocell.service.http.arriving import arriving
from duocell.service.http.connections import Connection


async def slow(scope: Any, receive: Any, send: Any) -> None:
    """Answers after some time."""
    await asyncio.sleep(0.6)
    await send({"type": "http.response.start", "status": 200, "headers": [(b"content-length", b"2")]})
    await send({"type": "http.response.body", "body": b"ok"})


@pytest.mark.parametrize(
    ("sent", "answered"),
    [(b"", False), (b"GET / HTTP/1.1\r\nHost: x\r\n", False), (b"GET / HTTP/1.1\r\nHost: x\r\n\r\n", True)],
)
def test_what_does_not_become_a_request_is_closed(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, sent: bytes, answered: bool
) -> None:
    monkeypatch.setattr(connections, "HEAD_WITHIN", 0.2)
    path = str(tmp_path / "socket")

    async def scenario() -> bytes:
        server = uvicorn.Server(uvicorn.Config(slow, uds=path, http=Connection, lifespan="off", log_config=None))
        running = asyncio.create_task(server.serve())
        while not server.started:
            await asyncio.sleep(0.01)
        reader, writer = await asyncio.open_unix_connection(path)
        writer.write(sent)
        got = await asyncio.wait_for(reader.read(12) if answered else reader.read(), 60.0)
        writer.close()
        server.should_exit = True
        await running
        return got

    assert asyncio.run(scenario()) == (b"HTTP/1.1 200" if answered else b"")


def test_a_body_that_stalls_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("duocell.service.http.arriving.STALLED", 0.05)

    class Stalled:
        async def stream(self) -> Any:
            yield b"[1,"
            await asyncio.Event().wait()

    async def scenario() -> list[bytes]:
        return [piece async for piece in arriving(Stalled())]  # type: ignore[arg-type]

    with pytest.raises(Problem, match="without a pause") as refused:
        asyncio.run(scenario())
    assert refused.value.code == "too-slow"


def test_bodies_take_turns_so_that_nobody_waits_for_all_of_them() -> None:
    """Thirty bodies of twenty pieces that are all there: between two pieces everything else gets its turn."""

    class There:
        async def stream(self) -> Any:
            for _ in range(20):
                yield b"x" * 65_536

    taken = 0
    between: list[int] = []

    async def take() -> None:
        nonlocal taken
        async for _ in arriving(There()):  # type: ignore[arg-type]
            taken += 1

    async def look() -> None:
        while taken < 600:
            before = taken
            await asyncio.sleep(0)
            between.append(taken - before)

    async def scenario() -> None:
        await asyncio.gather(*(take() for _ in range(30)), look())

    asyncio.run(scenario())
    assert between[0] <= 30  # the first pieces have come with the heads of the requests
    assert max(between[1:]) <= 2
