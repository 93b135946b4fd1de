"""The contract of /v1/layouts, on a fake executor."""

import json
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import pytest
from fastapi.testclient import TestClient

from duocell.service.http.keys import hash_line, new_key
from duocell.service.requests.accept import hash_of
from duocell.service.workers.executor import SolveFailed

Document = dict[str, Any]
Make = Callable[..., TestClient]


def finished(client: TestClient, location: str) -> Document:
    """The layout once it is finished."""
    for _ in range(200):
        layout: Document = client.get(location).json()
        if layout["status"] not in ("queued", "running"):
            return layout
        time.sleep(0.01)
    raise AssertionError("it never finished")


def test_a_request_is_taken_in_and_found_again(client: TestClient, example: Document) -> None:
    taken = client.post("/v1/layouts", json=example)
    assert taken.status_code == 202
    assert taken.headers["retry-after"] == "1"
    assert taken.json()["status"] in ("queued", "running")
    assert taken.headers["location"] == f"/v1/layouts/{taken.json()['id']}"
    layout = finished(client, taken.headers["location"])
    assert layout["status"] == "succeeded"
    assert layout["result"]["outcome"] == "optimal"
    assert [arm["name"] for arm in layout["result"]["arms"]] == ["main", "follower"]
    assert layout["created_at"] <= layout["started_at"] <= layout["finished_at"]
    assert layout["error"] is None


def test_waiting_gives_the_finished_layout(client: TestClient, example: Document) -> None:
    answer = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"})
    assert answer.status_code == 200
    assert answer.headers["preference-applied"] == "wait=10"
    assert "retry-after" not in answer.headers
    assert answer.json()["status"] == "succeeded"


def test_waiting_ends_when_the_time_is_up(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 5.0
    began = time.monotonic()
    answer = client.post("/v1/layouts", json=example, headers={"Prefer": "respond-async, wait=1"})
    assert 0.9 < time.monotonic() - began < 3.0
    assert answer.status_code == 202
    assert answer.json()["status"] == "running"


def test_waiting_is_capped(client_with: Make, fake: Any, example: Document) -> None:
    fake.seconds = 5.0
    answer = client_with(max_wait=0.2).post("/v1/layouts", json=example, headers={"Prefer": "wait=1000"})
    assert answer.status_code == 202
    assert answer.headers["preference-applied"] == "wait=0.2"


def test_a_preference_that_makes_no_sense_is_ignored(client: TestClient, example: Document) -> None:
    answer = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=soon"})
    assert answer.status_code == 202
    assert "preference-applied" not in answer.headers


def test_the_request_comes_back_complete_and_has_the_hash_of_the_result(client: TestClient, example: Document) -> None:
    layout = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).json()
    assert layout["request"]["arms"][0]["weights"] == "range"
    assert layout["request"]["arms"][0]["tool"]["position"] == [0.0, 0.0, 0.0]
    assert hash_of(layout["request"]) == layout["result"]["request_hash"]
    again = client.post("/v1/layouts", json=layout["request"], headers={"Prefer": "wait=10"}).json()
    assert again["request"] == layout["request"]
    assert again["result"]["request_hash"] == layout["result"]["request_hash"]
    assert again["id"] != layout["id"]


def test_infinite_margins_are_null(client: TestClient, example: Document) -> None:
    layout = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).json()
    assert layout["result"]["arms"][0]["joint_margins"] == [1.0, 2.0, 3.0, 4.0, 5.0, None]


def test_an_unchanged_layout_is_not_sent_twice(client: TestClient, example: Document) -> None:
    answer = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"})
    etag, location = answer.headers["etag"], answer.headers["location"]
    unchanged = client.get(location, headers={"If-None-Match": f'"other", {etag}'})
    assert unchanged.status_code == 304
    assert unchanged.content == b""
    assert unchanged.headers["etag"] == etag
    assert client.get(location, headers={"If-None-Match": '"other"'}).status_code == 200


def test_the_etag_changes_with_the_state(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 0.2
    answer = client.post("/v1/layouts", json=example)
    finished(client, answer.headers["location"])
    assert client.get(answer.headers["location"]).headers["etag"] != answer.headers["etag"]


def test_a_failed_solve_is_a_state_with_a_reason(client: TestClient, fake: Any, example: Document) -> None:
    fake.failure = SolveFailed("worker-died", "The worker was ended by signal SIGKILL.")
    answer = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"})
    assert answer.status_code == 200
    layout = answer.json()
    assert layout["status"] == "failed"
    assert layout["error"] == {"code": "worker-died", "detail": "The worker was ended by signal SIGKILL."}
    assert layout["result"] is None


def test_an_unexpected_error_ends_the_job_too(client: TestClient, fake: Any, example: Document) -> None:
    fake.error = ZeroDivisionError("nobody thought of this")
    layout = client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).json()
    assert layout["status"] == "failed"
    assert layout["error"]["code"] == "internal"
    assert "nobody" not in json.dumps(layout)


def test_soft_and_hard_limits_grow_with_what_is_asked_for(client_with: Make, fake: Any, example: Document) -> None:
    example["certificate"] = {"gap": 0.01, "time_limit": 20.0}
    client = client_with(time_limit=7.0, grace=3.0)
    client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"})
    example["baselines"] = ["interior-penalty", "exterior-penalty"]
    client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"})
    assert fake.limits == [(7.0, 30.0), (7.0, 84.0)]


def test_no_more_run_at_once_than_there_are_workers(client: TestClient, fake: Any, example: Document) -> None:
    fake.seconds = 0.1
    locations = [client.post("/v1/layouts", json=example).headers["location"] for _ in range(5)]
    assert all(finished(client, location)["status"] == "succeeded" for location in locations)
    assert fake.most_running == 2


def test_a_full_queue_says_when_to_come_back(client_with: Make, fake: Any, example: Document) -> None:
    fake.seconds = 5.0
    client = client_with(workers=1, max_queued=2)
    answers = [client.post("/v1/layouts", json=example) for _ in range(4)]
    assert [answer.status_code for answer in answers] == [202, 202, 202, 429]
    problem = answers[-1]
    assert problem.json()["code"] == "queue-full"
    assert int(problem.headers["retry-after"]) >= 1
    assert problem.headers["content-type"] == "application/problem+json"


def test_one_client_does_not_take_the_places_of_others(client_with: Make, fake: Any, example: Document) -> None:
    fake.seconds = 5.0
    greedy, other = new_key(), new_key()
    keys = f"{hash_line('greedy', greedy)} {hash_line('other', other)}"
    client = client_with(workers=1, max_queued=3, max_queued_in_all=5, api_keys=keys)

    def send(key: str) -> Any:
        return client.post("/v1/layouts", json=example, headers={"X-API-Key": key})

    with ThreadPoolExecutor(8) as at_once:
        statuses = list(at_once.map(send, [greedy] * 8))
    assert sorted(answer.status_code for answer in statuses) == [202] * 4 + [429] * 4
    assert [send(other).status_code for _ in range(3)] == [202, 202, 429]


def test_pages_hold_every_layout_once_the_newest_first(client: TestClient, example: Document) -> None:
    ids = []
    for number in range(5):
        example["name"] = f"layout {number}"
        ids.append(client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).json()["id"])
    seen, cursor = [], None
    while True:
        page = client.get("/v1/layouts", params={"limit": 2} | ({"cursor": cursor} if cursor else {})).json()
        assert len(page["items"]) <= 2
        seen += page["items"]
        cursor = page["next_cursor"]
        if cursor is None:
            break
        client.post("/v1/layouts", json=example)  # newer ones do not shift the pages behind
    assert [item["id"] for item in seen] == ids[::-1]
    assert seen[0]["name"] == "layout 4"
    assert seen[0]["outcome"] == "optimal"
    assert client.get(seen[0]["href"]).json()["id"] == seen[0]["id"]


@pytest.mark.parametrize("query", ["limit=0", "limit=101", "limit=ten", "cursor=x", "cursor=bm90IG9uZQ", "cursor=%ff"])
def test_pages_that_make_no_sense_are_refused(client: TestClient, query: str) -> None:
    answer = client.get(f"/v1/layouts?{query}")
    assert answer.status_code == 422
    assert answer.json()["errors"][0]["detail"]


def test_old_layouts_are_forgotten(client_with: Make, example: Document) -> None:
    client = client_with(keep_jobs=2)
    locations = [
        client.post("/v1/layouts", json=example, headers={"Prefer": "wait=10"}).headers["location"] for _ in range(3)
    ]
    for _ in range(300):  # once a second
        if client.get(locations[0]).status_code == 404:
            break
        time.sleep(0.01)
    assert [client.get(location).status_code for location in locations] == [404, 200, 200]
    assert client.get(locations[0]).json()["code"] == "layout-not-found"


def test_jobs_wait_for_the_next_process_when_the_service_ends(
    client_with: Make, fake: Any, example: Document, tmp_path: Path
) -> None:
    fake.seconds = 60.0
    client = client_with(workers=1, data_dir=tmp_path)
    locations = [client.post("/v1/layouts", json=example).headers["location"] for _ in range(2)]
    began = time.monotonic()
    client.__exit__(None, None, None)
    assert time.monotonic() - began < 5.0
    assert fake.stopped
    fake.seconds = 0.0
    again = client_with(workers=1, data_dir=tmp_path)
    layouts = [finished(again, location) for location in locations]
    assert [layout["status"] for layout in layouts] == ["succeeded", "succeeded"]
    assert [layout["attempts"] for layout in layouts] == [1, 1]  # being put back is nobody's fault
    client.__enter__()  # the fixture leaves it once more


def test_every_end_says_what_ended_it(client: TestClient, fake: Any, example: Document) -> None:
    wait = {"Prefer": "wait=10"}

    def ended(location: str) -> Any:
        layout = client.get(location).json()
        (summary,) = [item for item in client.get("/v1/layouts").json()["items"] if item["id"] == layout["id"]]
        done = client.get(f"{location}/events").text.partition("event: done\ndata: ")[2].partition("\n")[0]
        assert layout["ended"] == summary["ended"] == json.loads(done)["ended"]
        return layout["ended"]

    answered = client.post("/v1/layouts", json=example, headers=wait).headers["location"]
    assert ended(answered) == {"by": "answer", "detail": "The solve came to its own end."}
    fake.ended_by = "time-limit"
    cut = client.post("/v1/layouts", json=example | {"time_limit": 7.0}, headers=wait).headers["location"]
    assert ended(cut)["by"] == "time-limit"
    assert "7 s" in ended(cut)["detail"]
    fake.failure = SolveFailed("out-of-memory", "Too many poses.")
    failed = client.post("/v1/layouts", json=example, headers=wait).headers["location"]
    assert ended(failed) == {"by": "out-of-memory", "detail": "Too many poses."}
    fake.seconds = 60.0
    running = client.post("/v1/layouts", json=example)
    assert running.json()["ended"] is None
    client.post(f"{running.headers['location']}/cancel")
    assert ended(running.headers["location"]) == {"by": "cancelled", "detail": "A client called it off."}
