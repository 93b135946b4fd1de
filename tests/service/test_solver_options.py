"""Clients choose no option of the solver: some linear solvers of IPOPT crash the process that is told to use them."""

import copy
import json
from collections.abc import Iterator
from typing import Any

import casadi
import pytest

from duocell.optimizer.nlp import solve
from duocell.service.common.issues import InvalidRequest
from duocell.service.requests.accept import accept
from duocell.service.schemas.request import EXAMPLE
from duocell.service.settings import Settings
from duocell.service.workers.solving import solve_request

Document = dict[str, Any]

OPTIONS: Document = {
    "ipopt": {"linear_solver": "ma97"},
    "linear_solver": "ma97",
    "options": {"ipopt.linear_solver": "ma97"},
    "solver": "ma97",
    "time_limit": 1e9,
    "max_iter": 10**9,
}
FULL: Document = {
    "name": 'x", "ipopt.linear_solver": "ma97',
    "max_joint_step": 0.8,
    "certificate": {"gap": 0.5, "time_limit": 0.2},
    "baselines": ["exterior-penalty"],
}


def objects(document: Any, place: str = "") -> Iterator[tuple[str, Document]]:
    """Every object of a document, with where it is."""
    if isinstance(document, dict):
        yield place, document
        for name, value in document.items():
            yield from objects(value, f"{place}/{name}")
    elif isinstance(document, list):
        for index, value in enumerate(document):
            yield from objects(value, f"{place}/{index}")


@pytest.mark.parametrize("option", OPTIONS)
def test_options_are_refused_wherever_they_are_put(option: str) -> None:
    request = copy.deepcopy(EXAMPLE)
    places = 0
    for place, target in list(objects(request)):
        if option == "time_limit" and place in ("", "/certificate"):
            continue  # a field there; see `test_bad_input` for its limit
        target[option] = OPTIONS[option]
        with pytest.raises(InvalidRequest) as refused:
            accept(json.dumps(request).encode(), Settings())
        assert any(issue.pointer.startswith(place) for issue in refused.value.issues)
        del target[option]
        places += 1
    assert places >= 14


def test_the_solver_gets_the_same_options_whatever_is_asked_for(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Document] = []
    build = casadi.nlpsol

    def record(name: str, plugin: str, problem: Any, options: Document) -> Any:
        given.append({"name": name, "plugin": plugin, **options})
        return build(name, plugin, problem, options)

    monkeypatch.setattr(casadi, "nlpsol", record)
    for change in ({"certificate": None}, FULL):
        solve._solver.cache_clear()
        accepted = accept(json.dumps(copy.deepcopy(EXAMPLE) | change).encode(), Settings())
        assert solve_request(accepted.text, accepted.request_hash, 30.0)["outcome"] in ("optimal", "feasible")
    assert len(given) >= 2
    assert {options["plugin"] for options in given} == {"ipopt"}
    assert all(options["ipopt"].pop("max_wall_time") <= 60.0 for options in given)
    assert all(options["ipopt"] == solve.IPOPT_OPTIONS for options in given)
    assert "ma97" not in json.dumps(solve.IPOPT_OPTIONS)
