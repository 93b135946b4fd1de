"""Small things of HTTP: addresses that lead somewhere, HEAD, conditions, requests that end in two ways."""

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.cli.serve import keep_private
from duocell.service.http.keys import hash_line, keyring, new_key
from duocell.service.settings import Access

Make = Callable[..., TestClient]


def test_the_root_leads_to_the_forms(client_with: Make) -> None:
    for client in (client_with(), client_with(api_keys=hash_line("a", new_key()))):
        answer = client.get("/", follow_redirects=False)
        assert (answer.status_code, answer.headers["location"]) == (303, "/docs")


@pytest.mark.parametrize(
    ("path", "near"), [("/layouts", "/v1/layouts"), ("/v1/robot", "/v1/robots"), ("/health", "/healthz")]
)
def test_an_unknown_address_names_the_nearest_one(client: TestClient, path: str, near: str) -> None:
    answer = client.get(path)
    assert (answer.status_code, answer.json()["code"]) == (404, "not-found")
    assert f"Did you mean {near}?" in answer.json()["detail"]
    assert "`/docs`" in client.get("/x" * 5000).json()["detail"]


def test_head_is_get_without_the_body(client: TestClient, example: Any) -> None:
    location = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).headers["location"]
    for path in ("/healthz", "/v1/layouts", "/v1/robots/puma560", "/docs", location, f"{location}/events"):
        head, got = client.head(path), client.get(path)
        assert (head.status_code, head.content) == (got.status_code, b"") == (200, b""), path
        assert head.headers["content-type"] == got.headers["content-type"]
        assert head.headers.get("content-length") == got.headers.get("content-length")
    assert client.head("/nowhere").status_code == 404
    assert "HEAD" in client.put("/healthz").headers["allow"]


def test_any_etag_is_known_to_who_asks_for_any(client: TestClient, example: Any) -> None:
    location = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).headers["location"]
    assert client.get(location, headers={"If-None-Match": "*"}).status_code == 304


def test_a_request_that_ends_in_two_ways_is_refused(client: TestClient) -> None:
    answer = client.post("/v1/layouts", content=b"{}", headers={"Transfer-Encoding": "chunked", "Content-Length": "2"})
    assert (answer.status_code, answer.json()["code"], answer.headers["connection"]) == (400, "bad-request", "close")


def test_layouts_belong_to_their_key_unless_shared(client_with: Make, example: Any) -> None:
    ours, theirs = ({"X-API-Key": new_key()} for _ in range(2))
    keys = f"{hash_line('ours', ours['X-API-Key'])} {hash_line('theirs', theirs['X-API-Key'])}"
    client = client_with(api_keys=keys)
    location = client.post("/v1/layouts", json=example, headers=ours | {"Prefer": "wait=10"}).headers["location"]
    for ask in (client.get, client.delete):
        assert ask(location, headers=theirs).json()["code"] == "layout-not-found"
    assert client.post(f"{location}/cancel", headers=theirs).status_code == 404
    assert client.get(f"{location}/events", headers=theirs).status_code == 404
    assert client.get("/v1/layouts", headers=theirs).json()["items"] == []
    assert len(client.get("/v1/layouts", headers=ours).json()["items"]) == 1
    assert client.get(location, headers=ours).status_code == 200
    client.__exit__(None, None, None)
    shared = client_with(api_keys=keys, shared=True)
    assert shared.get(location, headers=theirs).status_code == 200
    assert shared.delete(location, headers=theirs).status_code == 204


def test_wrong_keys_are_slowed_down_and_right_ones_are_not(client_with: Make) -> None:
    key = new_key()
    client = client_with(api_keys=hash_line("a", key))
    statuses = [client.get("/v1/layouts", headers={"X-API-Key": f"wrong {k}"}).status_code for k in range(25)]
    assert statuses[:20] == [401] * 20
    assert 429 in statuses[20:]
    assert client.get("/v1/layouts", headers={"X-API-Key": key}).status_code == 200
    assert client.get("/v1/layouts").status_code == 401


def test_a_key_is_taken_back_without_a_restart(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("duocell.service.http.keys.LOOK_EVERY", 0.0)
    first, second = new_key(), new_key()
    path = tmp_path / "keys"
    path.write_text(hash_line("first", first))
    ring = keyring(Access(api_keys_file=path))
    assert (ring.owner(first), ring.owner(second)) == ("first", None)
    path.write_text(f"{hash_line('first', first)}\n{hash_line('second', second)}")
    assert (ring.owner(first), ring.owner(second)) == ("first", "second")
    path.write_text(hash_line("second", second))
    assert (ring.owner(first), ring.owner(second)) == (None, "second")
    path.write_text("no hash line at all")
    assert (ring.owner(first), ring.owner(second)) == (None, "second")
    path.write_text("# nobody\n")
    assert ring.owner(second) is None
    assert ring  # and closed all the same


def test_what_is_written_is_for_the_own_user_alone(tmp_path: Path) -> None:
    before = os.umask(0o022)
    try:
        (tmp_path / "duocell.sqlite3").write_text("of an older version")
        keep_private(tmp_path)
        (tmp_path / "duocell.sqlite3-wal").write_text("")
        assert {path.stat().st_mode & 0o777 for path in tmp_path.iterdir()} == {0o600}
    finally:
        os.umask(before)
