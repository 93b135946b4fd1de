"""The OpenAPI document: valid, complete, and true to what is answered."""

import copy
from collections.abc import Callable, Iterator
from typing import Any

import pytest
import trimesh
from fastapi.testclient import TestClient
from jsonschema import Draft202012Validator
from openapi_spec_validator import OpenAPIV31SpecValidator

from duocell.service.schemas.evaluate import EVALUATE_EXAMPLE
from duocell.service.workers.executor import SolveFailed
from tests.support.given import own_robot

Document = dict[str, Any]


@pytest.fixture
def published(client: TestClient) -> Document:
    document: Document = client.get("/openapi.json").json()
    return document


def operations(document: Document) -> Iterator[tuple[str, str, Document]]:
    for path, item in document["paths"].items():
        for method, operation in item.items():
            yield method, path, operation


def test_it_is_a_valid_document(published: Document) -> None:
    assert list(OpenAPIV31SpecValidator(published).iter_errors()) == []


def test_every_operation_is_named_and_explained(published: Document) -> None:
    names = [operation["operationId"] for _, _, operation in operations(published)]
    assert sorted(names) == [
        "cancel_layout",
        "create_layout",
        "create_mesh",
        "create_robot",
        "delete_layout",
        "delete_mesh",
        "delete_robot",
        "evaluate_layout",
        "export_layout",
        "follow_layout",
        "get_health",
        "get_import",
        "get_layout",
        "get_mesh",
        "get_problem",
        "get_readiness",
        "get_robot",
        "import_task",
        "list_layouts",
        "list_meshes",
        "list_robots",
    ]
    for _, _, operation in operations(published):
        assert operation["summary"]
        assert operation["description"]


def test_every_field_is_explained(published: Document) -> None:
    bare = [
        f"{name}.{field}"
        for name, schema in published["components"]["schemas"].items()
        for field, value in schema.get("properties", {}).items()
        if not value.get("description")
    ]
    assert bare == []


def test_every_field_of_a_request_has_an_example(published: Document) -> None:
    schemas = published["components"]["schemas"]
    seen, todo = set(), ["LayoutRequest", "EvaluateRequest"]
    while todo:
        name = todo.pop()
        if name in seen:
            continue
        seen.add(name)
        todo += [reference.rsplit("/", 1)[1] for reference in references(schemas[name])]
        for field, value in schemas[name].get("properties", {}).items():
            assert value.get("examples"), f"{name}.{field}"
    assert {"Arm", "Base", "DhRow", "Pose", "ArcByRadius", "Certificate", "Posture"} <= seen
    assert {"Obstacle", "Mesh", "Part", "Pedestal", "Mirror", "Clearance", "PlacedArm", "PlacedBase"} <= seen


def references(value: Any) -> Iterator[str]:
    if isinstance(value, dict):
        for key, inner in value.items():
            if key == "$ref":
                yield inner
            else:
                yield from references(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from references(inner)


def test_errors_are_problems_everywhere(published: Document) -> None:
    for _, path, operation in operations(published):
        for status, response in operation["responses"].items():
            if int(status) >= 400:
                assert list(response["content"]) == ["application/problem+json"], (path, status)
    assert "HTTPValidationError" not in published["components"]["schemas"]


def test_headers_are_documented(published: Document) -> None:
    create = published["paths"]["/v1/layouts"]["post"]
    assert {"Location", "Retry-After", "ETag"} <= set(create["responses"]["202"]["headers"])
    assert "Retry-After" in create["responses"]["429"]["headers"]
    assert [parameter["name"] for parameter in create["parameters"]] == ["Prefer", "Idempotency-Key"]
    read = published["paths"]["/v1/layouts/{layout_id}"]["get"]
    assert {parameter["name"] for parameter in read["parameters"]} == {"layout_id", "If-None-Match"}
    assert "ETag" in read["responses"]["304"]["headers"]


def test_every_example_of_a_body_is_accepted(client: TestClient, published: Document) -> None:
    sent = 0
    for method, path, operation in operations(published):
        for example in (
            operation.get("requestBody", {}).get("content", {}).get("application/json", {}).get("examples", {}).values()
        ):
            expected = 200 if operation["operationId"] == "evaluate_layout" else 202
            assert client.request(method, path, json=example["value"]).status_code == expected
            sent += 1
    assert sent == 2


def test_example_values_fit_their_schemas(published: Document) -> None:
    for name, schema in published["components"]["schemas"].items():
        for field, value in schema.get("properties", {}).items():
            for example in value.get("examples", []):
                check(example, value, published, f"{name}.{field}")


def check(value: Any, schema: Document, published: Document, what: str) -> None:
    whole = copy.deepcopy(schema) | {"components": published["components"]}
    errors = [
        f"{what}{list(error.absolute_path)}: {error.message}"
        for error in Draft202012Validator(whole).iter_errors(value)
    ]
    assert errors == []


def finished(client: TestClient, example: Document) -> str:
    return client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).headers["location"]


def schema_of(published: Document, operation_id: str, status: int, media_type: str) -> Document:
    for _, _, operation in operations(published):
        if operation["operationId"] == operation_id:
            schema: Document = operation["responses"][str(status)]["content"][media_type]["schema"]
            return schema
    raise AssertionError(operation_id)


BROKEN_FORM = {"Content-Type": "multipart/form-data"}


def bring_robot(client: TestClient, name: str = "own") -> Any:
    return client.post("/v1/robots", data={"name": name}, files={"urdf": ("own.urdf", own_robot.urdf({}))})


def bring_mesh(client: TestClient, file: str = "box.stl") -> Any:
    return client.post("/v1/meshes", files={"mesh": (file, own_robot.as_stl(trimesh.creation.box((1.0, 2.0, 3.0))))})


def import_task(client: TestClient, text: str) -> Any:
    return client.post("/v1/tasks/import", files={"file": ("way.apt", text)})


@pytest.mark.parametrize(
    ("operation_id", "status", "ask"),
    [
        ("create_layout", 200, lambda c, e: c.post("/v1/layouts", json=e, headers={"Prefer": "wait=10"})),
        ("create_layout", 202, lambda c, e: c.post("/v1/layouts", json=e)),
        ("create_layout", 400, lambda c, e: c.post("/v1/layouts", content=b"{")),
        ("create_layout", 415, lambda c, e: c.post("/v1/layouts", data={"a": "b"})),
        ("create_layout", 422, lambda c, e: c.post("/v1/layouts", json={})),
        ("evaluate_layout", 200, lambda c, e: c.post("/v1/layouts/evaluate", json=EVALUATE_EXAMPLE)),
        ("evaluate_layout", 422, lambda c, e: c.post("/v1/layouts/evaluate", json=e)),
        ("list_layouts", 200, lambda c, e: (c.post("/v1/layouts", json=e), c.get("/v1/layouts"))[1]),
        ("list_layouts", 422, lambda c, e: c.get("/v1/layouts?limit=0")),
        ("get_layout", 404, lambda c, e: c.get("/v1/layouts/none")),
        ("cancel_layout", 409, lambda c, e: c.post(f"{finished(c, e)}/cancel")),
        ("cancel_layout", 404, lambda c, e: c.post("/v1/layouts/none/cancel")),
        ("delete_layout", 404, lambda c, e: c.delete("/v1/layouts/none")),
        ("follow_layout", 404, lambda c, e: c.get("/v1/layouts/none/events")),
        ("list_robots", 200, lambda c, e: c.get("/v1/robots")),
        ("get_robot", 200, lambda c, e: c.get("/v1/robots/puma560")),
        ("get_robot", 404, lambda c, e: c.get("/v1/robots/none")),
        ("create_robot", 201, lambda c, e: bring_robot(c)),
        ("create_robot", 400, lambda c, e: c.post("/v1/robots", content=b"x", headers=BROKEN_FORM)),
        ("create_robot", 409, lambda c, e: bring_robot(c, "puma560")),
        ("create_robot", 415, lambda c, e: c.post("/v1/robots", json=e)),
        ("create_robot", 422, lambda c, e: bring_robot(c, "..")),
        ("get_robot", 200, lambda c, e: (bring_robot(c), c.get("/v1/robots/own"))[1]),
        ("list_robots", 200, lambda c, e: (bring_robot(c), c.get("/v1/robots"))[1]),
        ("delete_robot", 404, lambda c, e: c.delete("/v1/robots/none")),
        ("delete_robot", 409, lambda c, e: c.delete("/v1/robots/puma560")),
        ("create_mesh", 201, lambda c, e: bring_mesh(c)),
        ("create_mesh", 200, lambda c, e: (bring_mesh(c), bring_mesh(c))[1]),
        ("create_mesh", 422, lambda c, e: bring_mesh(c, "fork.step")),
        ("list_meshes", 200, lambda c, e: (bring_mesh(c), c.get("/v1/meshes"))[1]),
        ("get_mesh", 200, lambda c, e: c.get(bring_mesh(c).headers["location"])),
        ("get_mesh", 404, lambda c, e: c.get("/v1/meshes/none")),
        ("delete_mesh", 404, lambda c, e: c.delete("/v1/meshes/none")),
        ("import_task", 200, lambda c, e: import_task(c, "GOTO/0,0,0\nGOTO/1,0,0\n")),
        ("import_task", 422, lambda c, e: import_task(c, "GOTO/0,0\n")),
        ("import_task", 415, lambda c, e: c.post("/v1/tasks/import", json=e)),
        ("get_health", 200, lambda c, e: c.get("/healthz")),
        ("get_readiness", 200, lambda c, e: c.get("/readyz")),
        ("get_problem", 200, lambda c, e: c.get("/problems/queue-full")),
        ("get_problem", 404, lambda c, e: c.get("/problems/none")),
    ],
)
def test_answers_are_what_the_document_says(
    client: TestClient, published: Document, example: Document, operation_id: str, status: int, ask: Callable[..., Any]
) -> None:
    answer = ask(client, example)
    assert answer.status_code == status
    media_type = answer.headers["content-type"]
    check(answer.json(), schema_of(published, operation_id, status, media_type), published, operation_id)


def test_uploads_are_described_as_forms(published: Document) -> None:
    for path, form, required in (
        ("/v1/robots", "RobotUpload", ["name", "urdf"]),
        ("/v1/meshes", "MeshUpload", ["mesh"]),
    ):
        body = published["paths"][path]["post"]["requestBody"]
        assert body["content"]["multipart/form-data"]["schema"] == {"$ref": f"#/components/schemas/{form}"}
        schema = published["components"]["schemas"][form]
        assert schema["required"] == required
        assert schema["properties"][required[-1]]["format"] == "binary"
        assert {field["type"] for field in schema["properties"].values()} == {"string"}  # a form has no null
        assert "Location" in published["paths"][path]["post"]["responses"]["201"]["headers"]


def test_a_failed_layout_fits_its_schema_too(
    client: TestClient, fake: Any, published: Document, example: Document
) -> None:
    fake.failure = SolveFailed("time-limit", "No answer within 70 s.")
    answer = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"})
    check(answer.json(), schema_of(published, "create_layout", 200, "application/json"), published, "failed")
