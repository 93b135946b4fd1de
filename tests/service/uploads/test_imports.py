"""An upload that nobody waits for can be followed link by link, by the key that sent it alone."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.common.problems import Problem
from duocell.service.http.prefer import prefers_async
from duocell.service.uploads.imports import REMEMBERED, Imports
from duocell.service.workers.executor import Report
from tests.service.uploads.test_own_uploads import HASHES, as_key
from tests.service.uploads.test_robot_upload import form
from tests.support.given.own_robot import urdf

Make = Callable[..., TestClient]


def begin(client: TestClient, **parts: Any) -> Any:
    return client.post("/v1/robots", headers={"Prefer": "respond-async"}, **form(**parts))


def ended(client: TestClient, address: str) -> dict[str, Any]:
    """The upload once it has ended."""
    while True:
        answer = client.get(address)
        assert answer.status_code == 200, answer.text
        found: dict[str, Any] = answer.json()
        if found["status"] != "reading":
            return found
        assert answer.headers["retry-after"] == "1"
        time.sleep(0.05)


def test_who_does_not_wait_is_told_where_to_look(client_with: Make) -> None:
    client = client_with()
    answer = begin(client)
    assert answer.status_code == 202, answer.text
    begun = answer.json()
    assert (answer.headers["location"], answer.headers["preference-applied"]) == (begun["href"], "respond-async")
    assert (begun["status"], begun["links_total"], begun["robot"]) == ("reading", 0, None)
    done = ended(client, begun["href"])
    assert done == begun | {"status": "succeeded", "links_done": 3, "links_total": 3, "robot": "/v1/robots/own"}
    assert client.get(done["robot"]).json()["geometry"] == "mesh"


def test_what_is_wrong_with_the_files_is_told_there(client_with: Make) -> None:
    client = client_with()
    failed = ended(client, begin(client, meshes=None).json()["href"])
    assert (failed["status"], failed["robot"], failed["problem"]["code"]) == ("failed", None, "invalid-robot")
    assert failed["problem"]["errors"][0]["pointer"] == "/meshes"
    assert begin(client, name=(None, "no name")).status_code == 422  # what is seen at once is told at once
    assert begin(client, urdf=("own.urdf", urdf({})), meshes=None).status_code == 202  # its place is free again


def test_nobody_else_sees_it(client_with: Make) -> None:
    client = as_key(client_with(api_keys=HASHES), "press")
    address = begin(client, urdf=("own.urdf", urdf({})), meshes=None).json()["href"]
    assert as_key(client, "gateway").get(address).json()["code"] == "import-not-found"
    assert ended(as_key(client, "press"), address)["status"] == "succeeded"


def test_links_are_told_and_old_uploads_forgotten() -> None:
    seen: list[tuple[str | None, int, int]] = []

    async def scenario() -> None:
        imports = Imports()

        async def work(report: Report) -> None:
            for number, link in enumerate(("base", "upper arm")):
                report("link", f'{{"link":"{link}","done":{number},"total":2}}')
                seen.append((one.link, one.links_done, one.links_total))

        one = imports.begin("", "own", work)
        await asyncio.gather(*imports._tasks)
        assert (one.status, one.link, one.links_done) == ("succeeded", None, 2)
        for _ in range(REMEMBERED + 5):
            imports.begin("", "own", work)
            await asyncio.gather(*imports._tasks)
        imports.begin("", "own", work)
        assert imports.get(one.id) is None
        assert len(imports._known) == REMEMBERED + 1
        await imports.stop()

    asyncio.run(scenario())
    assert seen[:2] == [("base", 0, 2), ("upper arm", 1, 2)]


@pytest.mark.parametrize(
    ("error", "code"), [(Problem("robot-exists", "Taken."), "robot-exists"), (KeyError(1), "internal")]
)
def test_every_end_is_told(error: Exception, code: str) -> None:
    async def scenario() -> None:
        imports = Imports()

        async def work(report: Report) -> None:
            raise error

        one = imports.begin("", "own", work)
        await asyncio.gather(*imports._tasks)
        assert (one.status, (one.problem or {})["code"]) == ("failed", code)

    asyncio.run(scenario())


@pytest.mark.parametrize(
    ("headers", "wanted"),
    [
        (["respond-async"], True),
        (["wait=3, Respond-Async"], True),
        (["wait=3"], False),
        ([], False),
        (["x;respond-async"], False),
    ],
)
def test_the_preference_is_read(headers: list[str], wanted: bool) -> None:
    assert prefers_async(headers) is wanted
