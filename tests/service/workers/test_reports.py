"""What of the events of a solve is sent on."""

import json
from math import inf, nan

from duocell.optimizer.monitoring.events import Bounded, Iterated, Stage
from duocell.service.workers.reports import Reports


class Clock:
    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_frequent_events_are_thinned_but_the_last_before_another_is_kept() -> None:
    clock, sent = Clock(), list[tuple[str, str]]()
    reports = Reports(lambda kind, data: sent.append((kind, data)), clock)
    reports(Stage("searching", 0.0))
    for number in range(10):
        reports(Iterated(number, 1.0, 0.0))
    reports(Stage("proving", 0.5))
    numbers = [json.loads(data).get("iteration") for kind, data in sent if kind == "iteration"]
    assert numbers == [0, 9]
    assert [kind for kind, _ in sent] == ["stage", "iteration", "iteration", "stage"]


def test_an_hour_gives_hundreds_of_events_not_millions() -> None:
    clock, sent = Clock(), list[str]()
    reports = Reports(lambda kind, data: sent.append(kind), clock)
    for _ in range(360_000):
        clock.now += 0.01
        reports(Bounded("arm", 1.0, 2.0, 0.5, 1))
    assert 400 < len(sent) < 1000


def test_what_json_cannot_hold_becomes_null() -> None:
    sent: list[str] = []
    Reports(lambda kind, data: sent.append(data))(Bounded("ärm", -inf, nan, None, 3))
    assert json.loads(sent[0]) == {"arm": "ärm", "lower_bound": None, "objective": None, "gap": None, "boxes": 3}
