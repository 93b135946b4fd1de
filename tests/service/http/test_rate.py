"""Token buckets, on a clock of our own."""

import itertools

from hypothesis import given
from hypothesis import strategies as st

from duocell.service.http import rate
from duocell.service.http.rate import Buckets


class Clock:
    def __init__(self) -> None:
        self.now = 0.0

    def __call__(self) -> float:
        return self.now


@given(
    rate_=st.floats(0.1, 100.0),
    burst=st.integers(1, 20),
    pauses=st.lists(st.floats(0.0, 3.0), min_size=1, max_size=60),
)
def test_never_more_than_the_burst_and_what_has_come_in_since(rate_: float, burst: int, pauses: list[float]) -> None:
    clock = Clock()
    buckets = Buckets(rate_, burst, clock)
    granted: list[float] = []
    for pause in pauses:
        clock.now += pause
        allowance = buckets.take("a")
        if allowance.granted:
            granted.append(clock.now)
    for (i, first), (j, last) in itertools.combinations(enumerate(granted), 2):
        assert j - i + 1 <= burst + rate_ * (last - first) + 1e-6
    assert granted[:1] == [pauses[0]]  # the first always passes


@given(rate_=st.floats(0.1, 100.0), burst=st.integers(1, 20))
def test_who_waits_as_told_is_let_in(rate_: float, burst: int) -> None:
    clock = Clock()
    buckets = Buckets(rate_, burst, clock)
    left = [buckets.take("a").remaining for _ in range(burst)]
    assert left == list(range(burst - 1, -1, -1))
    refused = buckets.take("a")
    assert not refused.granted
    assert refused.retry_after >= 1
    clock.now += refused.retry_after
    assert buckets.take("a").granted
    clock.now += buckets.take("a").refill
    assert buckets.take("a").remaining == burst - 1


def test_clients_do_not_share_a_bucket() -> None:
    buckets = Buckets(0.1, 1, Clock())
    assert buckets.take("a").granted
    assert not buckets.take("a").granted
    assert buckets.take("b").granted


def test_endless_clients_take_no_endless_memory(monkeypatch: object) -> None:
    buckets = Buckets(0.001, 1, Clock())
    assert buckets.take("first").granted
    for number in range(rate.MOST_CLIENTS + 5):
        buckets.take(f"client {number}")
    assert len(buckets._levels) == rate.MOST_CLIENTS
    assert not buckets.take(f"client {number}").granted
    assert buckets.take("first").granted  # forgotten


def test_the_policy_says_requests_and_seconds() -> None:
    assert Buckets(10.0, 40).policy == '"default";q=40;w=4'
    assert Buckets(100.0, 1).policy == '"default";q=1;w=1'
