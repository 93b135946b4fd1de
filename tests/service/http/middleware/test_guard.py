"""Keys and rate limits over HTTP."""

import time
from collections.abc import Callable
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.http.keys import hash_line, new_key
from duocell.service.http.middleware.guard import _address

Make = Callable[..., TestClient]
KEY = new_key()
KEYS = f"{hash_line('press', KEY)} {hash_line('gateway', new_key())}"


def is_unauthorized(answer: Any) -> bool:
    if answer.status_code != 401:
        return False
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.headers["www-authenticate"].startswith('Bearer realm="duocell"')
    assert answer.json()["code"] == "unauthorized"
    assert KEY not in answer.text
    return True


def test_without_keys_everything_is_open(client: TestClient) -> None:
    for path in ("/v1/layouts", "/docs", "/metrics"):
        assert client.get(path).status_code == 200
    assert client.get("/v1/layouts", headers={"Authorization": "Bearer something"}).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"Authorization": f"Bearer {KEY}"},
        {"Authorization": f"bearer  {KEY} "},
        {"X-API-Key": KEY},
        {"X-API-Key": KEY, "Authorization": "Basic Z2F0ZXdheTpzZWNyZXQ="},  # the gateway's own
    ],
)
def test_a_key_opens(client_with: Make, headers: dict[str, str]) -> None:
    client = client_with(api_keys=KEYS)
    assert client.get("/v1/layouts", headers=headers).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {},
        {"Authorization": f"Bearer {KEY[:-1]}"},
        {"Authorization": f"Basic {KEY}"},
        {"Authorization": KEY},
        {"Authorization": "Bearer "},
        {"Authorization": f"Bearer {KEYS.split()[0]}"},  # the hash line is no key
        {"X-API-Key": KEY.upper()},
        {"Cookie": f"X-API-Key={KEY}"},
    ],
)
def test_nothing_else_does(client_with: Make, headers: dict[str, str], example: Any) -> None:
    client = client_with(api_keys=KEYS)
    assert is_unauthorized(client.get("/v1/layouts", headers=headers))
    assert is_unauthorized(client.post("/v1/layouts", headers=headers, json=example))
    assert is_unauthorized(client.get(f"/v1/layouts?api_key={KEY}", headers=headers))
    assert is_unauthorized(client.get("/nowhere", headers=headers))  # not even what there is
    assert is_unauthorized(client.get("//v1/layouts", headers=headers))


def test_an_unknown_key_is_told_so(client_with: Make) -> None:
    client = client_with(api_keys=KEYS)
    assert "error=" not in client.get("/v1/layouts").headers["www-authenticate"]
    wrong = client.get("/v1/layouts", headers={"X-API-Key": new_key()})
    assert 'error="invalid_token"' in wrong.headers["www-authenticate"]


def test_health_is_always_open(client_with: Make) -> None:
    client = client_with(api_keys=KEYS, rate_limit=0.001, rate_burst=1)
    for _ in range(5):
        assert client.get("/healthz").status_code == 200
        assert client.get("/readyz").status_code in (200, 503)


@pytest.mark.parametrize("public", [True, False])
def test_documentation_and_metrics_are_open_if_so_set(client_with: Make, public: bool) -> None:
    client = client_with(api_keys=KEYS, public_docs=public, public_metrics=public)
    for path in ("/docs", "/openapi.json", "/problems/queue-full", "/static/swagger-ui/swagger-ui.css", "/metrics"):
        answer = client.get(path)
        assert answer.status_code == 200 if public else is_unauthorized(answer), path
        assert client.get(path, headers={"X-API-Key": KEY}).status_code == 200
    for path in ("/docs/", "/docsearch", "/openapi.json/x", "/metrics/", "/healthz/", "/v1/layouts"):
        assert is_unauthorized(client.get(path)), path


def test_metrics_are_closed_and_documentation_is_open_unless_set_otherwise(client_with: Make) -> None:
    client = client_with(api_keys=KEYS)
    assert is_unauthorized(client.get("/metrics"))
    assert client.get("/docs").status_code == 200


def test_a_refused_body_is_not_read(client_with: Make) -> None:
    def endless() -> Any:
        yield b"["
        raise AssertionError("somebody reads on")

    answer = client_with(api_keys=KEYS).post("/v1/layouts", content=endless())
    assert is_unauthorized(answer)


def test_a_burst_is_let_through_and_then_no_more(client_with: Make) -> None:
    client = client_with(rate_limit=0.5, rate_burst=3)
    answers = [client.get("/v1/layouts") for _ in range(5)]
    assert [answer.status_code for answer in answers] == [200, 200, 200, 429, 429]
    assert [answer.headers["ratelimit"].split(";")[1] for answer in answers] == ["r=2", "r=1", "r=0", "r=0", "r=0"]
    assert all(answer.headers["ratelimit-policy"] == '"default";q=3;w=6' for answer in answers)
    refused = answers[-1]
    assert refused.headers["content-type"] == "application/problem+json"
    assert refused.json()["code"] == "rate-limited"
    assert 1 <= int(refused.headers["retry-after"]) <= 2
    time.sleep(float(refused.headers["retry-after"]))
    assert client.get("/v1/layouts").status_code == 200


def test_every_key_has_its_own_limit(client_with: Make) -> None:
    other = new_key()
    client = client_with(api_keys=f"{KEYS} {hash_line('other', other)}", rate_limit=0.01, rate_burst=2)

    def statuses(headers: dict[str, str]) -> list[int]:
        return [client.get("/v1/layouts", headers=headers).status_code for _ in range(3)]

    assert statuses({"X-API-Key": KEY}) == [200, 200, 429]
    assert statuses({"X-API-Key": other}) == [200, 200, 429]
    assert statuses({"X-API-Key": "guess"}) == [401, 401, 429]  # guessing is limited by address
    assert statuses({}) == [429, 429, 429]


def test_without_a_limit_nothing_is_said_of_it(client: TestClient) -> None:
    assert not [name for name in client.get("/v1/layouts").headers if name.startswith("ratelimit")]


@pytest.mark.parametrize(
    ("host", "who"),
    [
        ("10.1.2.3", "10.1.2.3"),
        ("2001:db8:1:2:aaaa::1", "2001:db8:1:2::/64"),
        ("2001:db8:1:2:bbbb::2", "2001:db8:1:2::/64"),
        ("testclient", "testclient"),
    ],
)
def test_an_ipv6_host_cannot_choose_a_fresh_bucket(host: str, who: str) -> None:
    assert _address({"client": (host, 1234)}) == who
    assert _address({"client": None}) == ""
