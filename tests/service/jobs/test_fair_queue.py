"""Who is next."""

from collections import Counter, defaultdict

import pytest
from hypothesis import given
from hypothesis import strategies as st

from duocell.service.jobs.fair_queue import FairQueue


def drained(waiting: FairQueue) -> list[str]:
    return [waiting.next() for _ in range(len(waiting))]


def test_one_client_is_served_in_order() -> None:
    waiting = FairQueue()
    for job in "abc":
        waiting.add("", job)
    assert drained(waiting) == ["a", "b", "c"]
    with pytest.raises(KeyError):
        waiting.next()


def test_clients_take_turns() -> None:
    waiting = FairQueue()
    for job in ("a1", "a2", "a3", "b1", "c1", "c2"):
        waiting.add(job[0], job)
    assert drained(waiting) == ["a1", "b1", "c1", "a2", "c2", "a3"]


def test_a_second_try_comes_before_everything_else() -> None:
    waiting = FairQueue()
    for job in ("a1", "b1", "b2"):
        waiting.add(job[0], job)
    waiting.add_first("b", "b0")
    assert drained(waiting) == ["b0", "a1", "b1", "b2"]


def test_a_job_can_be_taken_out() -> None:
    waiting = FairQueue()
    for job in ("a1", "a2", "b1"):
        waiting.add(job[0], job)
    assert waiting.remove("a", "a1")
    assert not waiting.remove("a", "a1")
    assert not waiting.remove("unknown", "a2")
    assert waiting.remove("b", "b1")
    assert drained(waiting) == ["a2"]


@given(st.lists(st.sampled_from("abcd"), max_size=40))
def test_nobody_waits_longer_than_a_round_for_each_of_his_jobs(clients: list[str]) -> None:
    waiting = FairQueue()
    sent: defaultdict[str, list[str]] = defaultdict(list)
    for number, client in enumerate(clients):
        sent[client].append(f"{client}{number}")
        waiting.add(client, sent[client][-1])
    served = drained(waiting)
    for client, jobs in sent.items():
        assert [job for job in served if job[0] == client] == jobs
        for index, job in enumerate(jobs):
            before = Counter(other[0] for other in served[: served.index(job)])
            assert all(count <= index + 1 for count in before.values())
