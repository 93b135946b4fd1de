"""What browsers are told: security headers, cross-origin requests."""

import base64
import hashlib
import re
from collections.abc import Callable

import pytest
from fastapi.testclient import TestClient
from pydantic import ValidationError

from duocell.service.http.keys import hash_line, new_key
from duocell.service.settings import Access

Make = Callable[..., TestClient]
PAGE = "https://planner.example"


@pytest.mark.parametrize("path", ["/v1/layouts", "/nowhere", "/healthz", "/readyz", "/openapi.json"])
def test_answers_are_data_and_nothing_else(client: TestClient, path: str) -> None:
    headers = client.get(path).headers
    assert headers["x-content-type-options"] == "nosniff"
    assert headers["referrer-policy"] == "no-referrer"
    assert headers["content-security-policy"] == "default-src 'none'; frame-ancestors 'none'"
    assert headers["cache-control"] == "no-store"


def test_refusals_and_breakdowns_have_them_too(client_with: Make) -> None:
    def broken() -> None:
        raise RuntimeError("nobody thought of this")

    client = client_with(api_keys=hash_line("a", new_key()))
    client.app.get("/problems/broken/down")(broken)  # type: ignore[attr-defined]  # below what needs no key
    for path, status in (("/v1/layouts", 401), ("/problems/broken/down", 500)):
        answer = client.get(path)
        assert answer.status_code == status
        assert answer.headers["x-content-type-options"] == "nosniff"
        assert answer.headers["content-security-policy"]
        assert answer.headers["cache-control"] == "no-store"
        assert answer.headers["x-request-id"]


def test_files_may_be_cached(client: TestClient) -> None:
    answer = client.get("/static/swagger-ui/swagger-ui.css")
    assert answer.headers["x-content-type-options"] == "nosniff"
    assert "no-store" not in answer.headers.get("cache-control", "")
    assert client.get(answer.url, headers={"If-None-Match": answer.headers["etag"]}).status_code == 304


def test_the_documentation_may_load_its_own_files_and_run_its_own_script_and_no_other(client: TestClient) -> None:
    page = client.get("/docs")
    policy = dict(part.strip().split(" ", 1) for part in page.headers["content-security-policy"].split(";"))
    assert policy["default-src"] == "'none'"
    assert policy["frame-ancestors"] == "'none'"
    inline = re.findall(r"<script(?![^>]*\ssrc=)[^>]*>(.*?)</script>", page.text, re.S)
    assert len(inline) == 1
    digest = base64.b64encode(hashlib.sha256(inline[0].encode()).digest()).decode()
    assert policy["script-src"] == f"'self' 'sha256-{digest}'"
    assert not re.search(r"\son\w+=", page.text)  # handlers in attributes would be blocked
    for kind in ("style-src", "connect-src", "img-src"):
        assert "'self'" in policy[kind]


def test_other_origins_are_not_invited_unless_set(client: TestClient) -> None:
    answer = client.get("/v1/layouts", headers={"Origin": PAGE})
    assert not [name for name in answer.headers if name.startswith("access-control")]
    preflight = client.options("/v1/layouts", headers={"Origin": PAGE, "Access-Control-Request-Method": "POST"})
    assert preflight.status_code == 405
    assert not [name for name in preflight.headers if name.startswith("access-control")]


def test_pages_of_the_origins_that_are_set_may_ask(client_with: Make) -> None:
    client = client_with(cors_origins=f"{PAGE}, http://localhost:5173", api_keys=hash_line("a", new_key()))
    asked = {"Access-Control-Request-Method": "POST", "Access-Control-Request-Headers": "x-api-key, prefer"}
    preflight = client.options("/v1/layouts", headers={"Origin": PAGE, **asked})  # browsers send no key with it
    assert preflight.status_code == 200
    assert preflight.headers["access-control-allow-origin"] == PAGE
    answer = client.get("/v1/layouts", headers={"Origin": PAGE})
    assert answer.status_code == 401  # the page can read why
    assert answer.headers["access-control-allow-origin"] == PAGE
    assert "Location" in answer.headers["access-control-expose-headers"]
    assert "access-control-allow-credentials" not in answer.headers
    other = client.get("/v1/layouts", headers={"Origin": "https://elsewhere.example"})
    assert "access-control-allow-origin" not in other.headers
    assert client.options("/v1/layouts", headers={"Origin": "https://elsewhere.example", **asked}).status_code == 400


@pytest.mark.parametrize("origin", ["planner.example", "https://planner.example/", "https://u@planner.example", "null"])
def test_what_is_no_origin_is_refused(origin: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("DUOCELL_CORS_ORIGINS", origin)
    with pytest.raises(ValidationError, match="no origin"):
        Access()


def test_all_origins(client_with: Make) -> None:
    answer = client_with(cors_origins="*").get("/v1/layouts", headers={"Origin": PAGE})
    assert answer.headers["access-control-allow-origin"] == "*"
