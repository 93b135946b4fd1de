"""The trial of large requests: what it draws is accepted, the same each time, and a miss is counted as one."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from bench.draws.large_draw import large_request, meshes
from bench.trials.large_requests import is_miss, summary
from duocell.service.library.library import Library
from duocell.service.requests.accept import accept
from duocell.service.settings import Limits


@pytest.fixture(scope="module")
def library(tmp_path_factory: pytest.TempPathFactory) -> Library:
    library = Library(Path(tmp_path_factory.mktemp("data")))
    for name, document in meshes().items():
        library.mesh_store.put(name, document)
    return library


@pytest.mark.parametrize("seed", [6, 7, 12])  # a task sequence, obstacles of meshes, couplings
def test_requests_are_accepted_and_the_same_each_time(seed: int, library: Library) -> None:
    request = large_request(seed, Limits())
    assert request == large_request(seed, Limits())
    accepted = accept(json.dumps(request).encode(), Limits(), library)
    assert accepted.time_limit == 5.0


def test_late_is_what_is_late_by_both_clocks() -> None:
    on_time = {"word": "feasible", "ended_by": "answer", "over": 2.5, "cpu_over": -1.0}
    late, failed = {**on_time, "cpu_over": 2.1}, {**on_time, "word": "failed: internal"}
    refused = {"word": "refused", "over": None, "cpu_over": None}
    assert [is_miss(record) for record in (on_time, late, failed, refused)] == [False, True, True, False]
    assert "| feasible | 2 | 0 | 0 | 2.5 | 1 |" in summary([on_time, late, refused])
