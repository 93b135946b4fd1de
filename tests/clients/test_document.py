"""docs/openapi.json is what the service publishes."""

import json

from fastapi.testclient import TestClient

from duocell.service.app import create_app
from tests.clients.fuzz import DOCUMENT


def test_the_committed_document_is_the_published_one() -> None:
    published = TestClient(create_app()).get("/openapi.json").json()
    committed = json.loads(DOCUMENT.read_text())
    assert committed == published, "run `make openapi` and commit docs/openapi.json"
