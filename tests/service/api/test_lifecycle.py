"""Cancelling, deleting, repeating, listing: over HTTP, on a fake executor."""

import json
import sqlite3
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.common.database_url import FILE
from tests.support.server import has, state_of, until

Document = dict[str, Any]
Make = Callable[..., TestClient]
WAIT = {"Prefer": "wait=10"}


# ------------------------------------------------------------------------------------------------------------- cancel


def test_a_running_layout_is_cancelled_at_once_and_its_worker_is_free(
    client_with: Make, fake: Any, example: Document
) -> None:
    fake.seconds = 60.0
    client = client_with(workers=1)
    location = client.post("/v1/layouts", json=example).headers["location"]
    answer = client.post(f"{location}/cancel")
    assert answer.status_code == 202
    assert answer.json()["status"] == "cancelled"
    assert answer.json()["finished_at"] is not None
    assert answer.json()["error"] is None
    until(lambda: fake.running == 0)
    fake.seconds = 0.0
    assert client.post("/v1/layouts", json=example, headers=WAIT).json()["status"] == "succeeded"
    assert state_of(client, location) == "cancelled"


def test_a_waiting_layout_is_cancelled_and_never_runs(client_with: Make, fake: Any, example: Document) -> None:
    fake.seconds = 60.0
    client = client_with(workers=1)
    first, second, third = (client.post("/v1/layouts", json=example).headers["location"] for _ in range(3))
    assert client.post(f"{second}/cancel").json()["status"] == "cancelled"
    fake.seconds = 0.0
    client.post(f"{first}/cancel")
    until(lambda: state_of(client, third) == "succeeded")
    assert len(fake.limits) == 2


def test_cancelling_twice_is_cancelling_once(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 60.0
    location = client.post("/v1/layouts", json=example).headers["location"]
    first, second = (client.post(f"{location}/cancel") for _ in range(2))
    assert (first.status_code, second.status_code) == (202, 202)
    assert first.json() == second.json()
    assert first.headers["etag"] == second.headers["etag"]


def test_what_has_ended_is_not_cancelled(client: TestClient, example: Document) -> None:
    location = client.post("/v1/layouts", json=example, headers=WAIT).headers["location"]
    answer = client.post(f"{location}/cancel")
    assert answer.status_code == 409
    assert answer.json()["code"] == "layout-finished"
    assert "succeeded" in answer.json()["detail"]
    assert state_of(client, location) == "succeeded"


def test_whoever_waits_for_a_cancelled_layout_is_told(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 60.0
    answers: list[Any] = []
    thread = threading.Thread(
        target=lambda: answers.append(client.post("/v1/layouts", json=example, headers={"Prefer": "wait=30"}))
    )
    thread.start()
    until(lambda: fake.running == 1)
    (item,) = client.get("/v1/layouts").json()["items"]
    client.post(f"{item['href']}/cancel")
    thread.join(5.0)
    assert not thread.is_alive()
    assert answers[0].status_code == 200
    assert answers[0].json()["status"] == "cancelled"
    assert answers[0].json()["request"]["name"] == example["name"]


@pytest.mark.parametrize("path", ["/cancel", "/events", ""])
@pytest.mark.parametrize("name", ["none", "0" * 32, "%00", "0" * 31 + "G"])
def test_what_is_not_there_cannot_be_changed_or_followed(client: TestClient, name: str, path: str) -> None:
    method = {"/cancel": "POST", "/events": "GET", "": "DELETE"}[path]
    answer = client.request(method, f"/v1/layouts/{name}{path}")
    assert answer.status_code == 404
    assert answer.json()["code"] == "layout-not-found"


# ------------------------------------------------------------------------------------------------------------- delete


def test_a_finished_layout_can_be_forgotten(client: TestClient, example: Document) -> None:
    location = client.post("/v1/layouts", json=example, headers=WAIT | {"Idempotency-Key": "k"}).headers["location"]
    answer = client.delete(location)
    assert answer.status_code == 204
    assert answer.content == b""
    assert client.get(location).status_code == 404
    assert client.get(f"{location}/events").status_code == 404
    assert client.delete(location).status_code == 404
    again = client.post("/v1/layouts", json=example, headers=WAIT | {"Idempotency-Key": "k"})
    assert again.headers["location"] != location


def test_a_layout_under_way_is_not_forgotten(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 60.0
    location = client.post("/v1/layouts", json=example).headers["location"]
    answer = client.delete(location)
    assert answer.status_code == 409
    assert answer.json()["code"] == "layout-active"
    client.post(f"{location}/cancel")
    assert client.delete(location).status_code == 204


# -------------------------------------------------------------------------------------------------------- idempotency


def test_a_repeated_request_is_carried_out_once(client: TestClient, fake: Any, example: Document) -> None:
    headers = {"Idempotency-Key": '"8e03978e-40d5-43dd-bc93-6894a57f9324"'}
    first = client.post("/v1/layouts", json=example, headers=headers)
    assert first.status_code == 202
    second = client.post("/v1/layouts", json=example, headers=headers | WAIT)
    assert second.status_code == 200
    assert second.json()["id"] == first.json()["id"]
    bare = client.post("/v1/layouts", json=example, headers={"Idempotency-Key": "8e03978e-40d5-43dd-bc93-6894a57f9324"})
    assert bare.status_code == 200
    assert bare.json() == second.json()
    assert len(fake.limits) == 1


def test_a_key_with_another_body_is_refused(client: TestClient, fake: Any, example: Document) -> None:
    client.post("/v1/layouts", json=example, headers={"Idempotency-Key": "k"})
    answer = client.post("/v1/layouts", json=example | {"name": "other"}, headers={"Idempotency-Key": "k"})
    assert answer.status_code == 422
    assert answer.json()["code"] == "idempotency-key-reused"
    assert len(client.get("/v1/layouts").json()["items"]) == 1


def test_a_bad_request_does_not_use_up_its_key(client: TestClient, example: Document) -> None:
    bad = client.post("/v1/layouts", json=example | {"arms": []}, headers={"Idempotency-Key": "k"})
    assert bad.status_code == 422
    assert client.post("/v1/layouts", json=example, headers={"Idempotency-Key": "k"}).status_code == 202


def test_a_key_that_is_being_taken_in_is_busy(client: TestClient, example: Document, monkeypatch: Any) -> None:
    from duocell.service.store.sql import SqlJobStore

    add, inside, leave = SqlJobStore.add, threading.Event(), threading.Event()

    def slow(self: Any, *arguments: Any) -> Any:
        inside.set()
        leave.wait(10.0)
        return add(self, *arguments)

    monkeypatch.setattr(SqlJobStore, "add", slow)
    answers: list[Any] = []
    headers = {"Idempotency-Key": "k"}
    thread = threading.Thread(target=lambda: answers.append(client.post("/v1/layouts", json=example, headers=headers)))
    thread.start()
    assert inside.wait(5.0)
    busy = client.post("/v1/layouts", json=example, headers=headers)
    leave.set()
    thread.join(5.0)
    assert busy.status_code == 409
    assert busy.json()["code"] == "idempotency-key-busy"
    assert busy.headers["retry-after"] == "1"
    assert answers[0].status_code == 202
    again = client.post("/v1/layouts", json=example, headers=headers)
    assert again.json()["id"] == answers[0].json()["id"]


@pytest.mark.parametrize("keys", [[""], ['""'], ['"a'], ['" a"'], ["a" * 256], ["a", "b"], ["\x7f"]])
def test_keys_that_cannot_be_used_are_refused(client: TestClient, example: Document, keys: list[str]) -> None:
    answer = client.post("/v1/layouts", json=example, headers=[("Idempotency-Key", key) for key in keys])
    assert answer.status_code == 400
    assert "Idempotency-Key" in answer.json()["detail"]


# --------------------------------------------------------------------------------------------------------------- list


def test_lists_can_be_narrowed_and_lead_on(client: TestClient, fake: Any, example: Document) -> None:
    for number in range(4):
        client.post("/v1/layouts", json=example | {"name": f"n{number % 2} & more"}, headers=WAIT)
    fake.seconds = 60.0
    client.post("/v1/layouts", json=example)

    def names(query: str) -> list[str]:
        return [item["name"] for item in client.get(f"/v1/layouts?{query}").json()["items"]]

    assert names("status=running") == [example["name"]]
    assert len(names("status=running&status=succeeded")) == 5
    assert names("name=n1%20%26%20more") == ["n1 & more"] * 2
    items = client.get("/v1/layouts").json()["items"]
    assert names(f"created_after={items[2]['created_at']}") == [items[0]["name"], items[1]["name"]]
    assert len(names(f"created_before={items[2]['created_at']}")) == 2
    page = client.get("/v1/layouts?status=succeeded&name=n0%20%26%20more&limit=1")
    link = page.headers["link"]
    assert link.endswith('; rel="next"')
    following = client.get(link[1 : link.index(">")])
    assert [item["name"] for item in following.json()["items"]] == ["n0 & more"]
    assert following.json()["items"][0]["id"] != page.json()["items"][0]["id"]
    assert "link" not in following.headers
    assert client.get("/v1/layouts?created_before=0001-01-01T00:00:00%2B23:59").json()["items"] == []
    assert len(client.get("/v1/layouts?created_before=9999-12-31T23:59:59-23:59").json()["items"]) == 5


@pytest.mark.parametrize(
    "query", ["status=lost", "name=%00", "created_after=yesterday", "created_before=2026-11-22T09:30:00", "cursor=%00"]
)
def test_lists_that_make_no_sense_are_refused(client: TestClient, query: str) -> None:
    answer = client.get(f"/v1/layouts?{query}")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["detail"]


# ----------------------------------------------------------------------------------------------- what a worker is given


def test_workers_are_given_what_is_converted_and_the_text_where_nothing_of_this_version_is(
    client_with: Make, fake: Any, example: Document, tmp_path: Path
) -> None:
    fake.seconds = 60.0
    client = client_with(workers=1)
    locations = [client.post("/v1/layouts", json=example).headers["location"] for _ in range(4)]
    until(lambda: fake.running == 1)
    with sqlite3.connect(tmp_path / FILE) as store:
        for location, form in zip(locations[2:], (None, b"duocell request 0\n..."), strict=True):
            store.execute("UPDATE jobs SET prepared = ? WHERE id = ?", (form, location.rsplit("/", 1)[1]))
    store.close()
    fake.seconds = 0.0
    client.post(f"{locations[0]}/cancel")
    for location in locations[1:]:
        until(has(client, location, "status", "succeeded"))
    assert [type(one) for one in fake.given] == [bytes, bytes, str, str]
    texts = [client.get(location).json()["request"] for location in locations]
    assert json.loads(fake.given[2]) == json.loads(fake.given[3]) == texts[0]
    assert all(text == texts[0] for text in texts)
    with sqlite3.connect(tmp_path / FILE) as store:  # nobody will ask for it again
        assert store.execute("SELECT count(prepared) FROM jobs").fetchone() == (0,)
    store.close()
