"""What every store promises, asked of all of them."""

import threading
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from uuid import uuid4

import pytest

from duocell.service.common.job_errors import StoreUnavailable
from duocell.service.jobs.job import Ending, Failure, Job, JobEvent, JobStatus
from duocell.service.jobs.job_store import JobFilter, JobStore, KeyTaken

Open = Callable[[], JobStore]

NOON = datetime(2026, 11, 22, 12, 0, 0, 123456, UTC)
RESULT = '{"text": "π ≠ 3 \\u0000 \\"quoted\\"", "number": 1e-300}'
DONE = Ending(JobStatus.SUCCEEDED, RESULT, "optimal", 155.2, ended_by="answer")
ANY = JobFilter()


def job(number: int = 0, **given: object) -> Job:
    values: dict[str, object] = {
        "id": uuid4().hex,
        "name": f"job {number}",
        "client": "",
        "status": JobStatus.QUEUED,
        "created_at": NOON + timedelta(seconds=number),
        "request": '{"name": "Ünïcødé"}',
        "request_hash": "0" * 64,
        "certificate_time": 2.5,
        "runs": 3,
    }
    return Job(**(values | given))  # type: ignore[arg-type]


def added(store: JobStore, *jobs: Job) -> list[Job]:
    return [store.add(one, []) for one in jobs]


def event(number: int, kind: str = "stage") -> JobEvent:
    return JobEvent(number, kind, f'{{"number": {number}}}')


def running(store: JobStore, number: int = 0) -> Job:
    (new,) = added(store, job(number))
    claimed = store.claim(new.id, [])
    assert claimed is not None
    return claimed


def test_a_job_comes_back_as_it_was(store: JobStore) -> None:
    new = store.add(job(), [event(1, "queued")], "key", "hash")
    assert store.get(new.id) == new
    assert store.events(new.id, 0, 10) == [event(1, "queued")]
    assert store.get("unknown") is None
    assert store.events("unknown", 0, 10) == []


def test_what_a_worker_is_given_is_there_as_long_as_one_may_ask_for_it(store: JobStore) -> None:
    form = bytes(range(256)) * 3000
    ends: list[Callable[[Job], object]] = [
        lambda held: store.finish(held, DONE, []),
        lambda held: store.cancel(held.id, event(9)),
    ]
    for number, end in enumerate(ends):
        new = store.add(job(number, prepared=form), [])
        assert new.prepared == form
        assert store.get(new.id) == replace(new, prepared=None)  # which is for others, who have no use for it
        assert store.unfinished()[-1].prepared is None
        claimed = store.claim(new.id, [])
        assert claimed is not None
        assert claimed.prepared == form
        store.put_back(claimed, [], counted=True)
        again = store.claim(new.id, [])
        assert again is not None
        assert again.prepared == form
        assert again.request == new.request
        end(again)
    old = store.claim(added(store, job(2))[0].id, [])
    assert old is not None
    assert old.prepared is None


def test_a_moment_keeps_its_microseconds_and_becomes_utc(store: JobStore) -> None:
    from datetime import timezone

    elsewhere = NOON.astimezone(timezone(timedelta(hours=5, minutes=30)))
    (new,) = added(store, job(created_at=elsewhere))
    stored = store.get(new.id)
    assert stored is not None
    assert stored.created_at == NOON
    assert stored.created_at.utcoffset() == timedelta(0)


def test_the_whole_life_of_a_job(store: JobStore) -> None:
    (new,) = added(store, job())
    claimed = store.claim(new.id, [event(100)])
    assert claimed is not None
    assert claimed == replace(
        new, status=JobStatus.RUNNING, attempts=1, revision=2, started_at=claimed.started_at, owner=store.owner
    )
    head = store.finish(claimed, DONE, [event(101), event(102)])
    assert head is not None
    assert head.started_at is not None
    assert head.finished_at is not None
    assert new.created_at < head.started_at <= head.finished_at
    whole = store.get(new.id)
    assert whole == replace(
        claimed,
        status=JobStatus.SUCCEEDED,
        revision=3,
        finished_at=head.finished_at,
        result=RESULT,
        outcome="optimal",
        objective=155.2,
        ended_by="answer",
    )
    assert [e.number for e in store.events(new.id, 0, 10)] == [100, 101, 102]


def test_a_failure_is_kept_with_its_reason(store: JobStore) -> None:
    claimed = running(store)
    failure = Failure("worker-died", "SIGKILL")
    store.finish(claimed, Ending(JobStatus.FAILED, failure=failure), [])
    stored = store.get(claimed.id)
    assert stored is not None
    assert (stored.status, stored.failure, stored.result) == (JobStatus.FAILED, failure, None)


def test_only_queued_jobs_are_claimed_and_only_once(store: JobStore) -> None:
    claimed = running(store)
    assert store.claim(claimed.id, []) is None
    store.finish(claimed, DONE, [])
    assert store.claim(claimed.id, []) is None
    assert store.claim("unknown", []) is None


def test_final_states_are_final(store: JobStore) -> None:
    claimed = running(store)
    assert store.finish(claimed, DONE, []) is not None
    before = store.get(claimed.id)
    assert store.finish(claimed, Ending(JobStatus.FAILED), [event(1)]) is None
    assert store.put_back(claimed, [event(2)], counted=True) is None
    assert store.cancel(claimed.id, event(3)) is None
    assert store.get(claimed.id) == before
    assert store.events(claimed.id, 0, 10) == []


def test_who_lost_a_job_cannot_end_it(store: JobStore) -> None:
    claimed = running(store)
    assert store.put_back(claimed, [], counted=True) is not None
    assert store.finish(claimed, DONE, []) is None  # queued
    again = store.claim(claimed.id, [])
    assert again is not None
    assert again.attempts == 2
    assert store.finish(claimed, DONE, []) is None  # another attempt
    assert store.put_back(claimed, [], counted=True) is None
    assert store.finish(again, DONE, []) is not None


@pytest.mark.parametrize(("counted", "attempts"), [(True, 1), (False, 0)])
def test_a_job_that_is_put_back_is_queued_again(store: JobStore, counted: bool, attempts: int) -> None:
    claimed = running(store)
    back = store.put_back(claimed, [event(7)], counted=counted)
    assert back is not None
    assert (back.status, back.attempts, back.started_at, back.revision) == (JobStatus.QUEUED, attempts, None, 3)
    assert store.events(claimed.id, 0, 10) == [event(7)]


def test_cancelling_ends_queued_and_running_jobs_at_once(store: JobStore) -> None:
    (waiting,) = added(store, job())
    claimed = running(store, 1)
    for one in (waiting, claimed):
        head = store.cancel(one.id, event(1, "done"))
        assert head is not None
        assert head.status is JobStatus.CANCELLED
        assert head.finished_at is not None
        assert store.events(one.id, 0, 10) == [event(1, "done")]
    assert store.claim(waiting.id, []) is None
    assert store.finish(claimed, DONE, []) is None
    assert store.cancel("unknown", event(1)) is None


def test_a_key_belongs_to_one_job_of_a_client(store: JobStore) -> None:
    first = store.add(job(), [event(1)], "key", "a")
    with pytest.raises(KeyTaken):
        store.add(job(1), [event(1)], "key", "b")
    other = store.add(job(2, client="other"), [], "key", "c")
    keyed = store.with_key("", "key")
    assert keyed is not None
    assert (keyed.job, keyed.body_hash) == (first, "a")
    keyed = store.with_key("other", "key")
    assert keyed is not None
    assert keyed.job == other
    assert store.with_key("", "unknown") is None
    added(store, job(3), job(4))  # many may have none
    assert len(store.page(10, None, ANY)) == 4


def test_a_key_is_free_again_when_its_job_is_forgotten(store: JobStore) -> None:
    first = job()
    store.add(first, [], "key", "a")
    store.cancel(first.id, event(1))
    assert store.delete(first.id)
    store.add(job(1), [], "key", "b")


def test_only_finished_jobs_are_deleted(store: JobStore) -> None:
    (waiting,) = added(store, job())
    claimed = running(store, 1)
    store.add_events([(claimed.id, event(1))])
    assert not store.delete(waiting.id)
    assert not store.delete(claimed.id)
    assert not store.delete("unknown")
    store.finish(claimed, DONE, [])
    assert store.delete(claimed.id)
    assert store.get(claimed.id) is None
    assert store.events(claimed.id, 0, 10) == []


def test_trimming_forgets_what_ended_first(store: JobStore) -> None:
    (waiting,) = added(store, job(9))
    jobs = [running(store, number) for number in range(4)]
    for one in (jobs[2], jobs[0], jobs[3], jobs[1]):
        store.finish(one, DONE, [event(1)])
    assert store.trim(2) == 2
    assert [store.get(one.id) is not None for one in jobs] == [False, True, False, True]
    assert store.events(jobs[2].id, 0, 10) == []
    assert store.get(waiting.id) is not None
    assert store.trim(2) == 0


def test_pages_are_the_newest_first_without_gaps_or_repetitions(store: JobStore) -> None:
    jobs = added(store, *(job(-number // 2) for number in range(9)))  # whatever the clock says
    wanted = [one.id for one in reversed(jobs)]
    seen: list[str] = []
    after = None
    while page := store.page(2, after, ANY):
        seen += [one.id for one in page]
        after = page[-1].sequence
        added(store, job(100))  # newer ones do not shift the pages behind
    assert seen == wanted
    assert store.page(1, None, ANY)[0].request == ""


def test_pages_can_be_chosen_by_state_name_client_and_time(store: JobStore) -> None:
    added(store, job(0), job(1, name="other"), job(2, client="me"))
    claimed = running(store, 3)
    store.finish(claimed, DONE, [])

    def names(**chosen: object) -> list[str]:
        return [one.name for one in store.page(10, None, JobFilter(**chosen))]  # type: ignore[arg-type]

    assert names(statuses=[JobStatus.SUCCEEDED]) == ["job 3"]
    assert names(statuses=[JobStatus.SUCCEEDED, JobStatus.QUEUED]) == ["job 3", "job 2", "other", "job 0"]
    assert names(statuses=[]) == []
    assert names(name="other") == ["other"]
    assert names(name="oth") == []
    assert names(client="me") == ["job 2"]
    assert names(created_after=NOON, created_before=NOON + timedelta(seconds=2)) == ["other"]


def test_unfinished_jobs_are_listed_the_oldest_first(store: JobStore) -> None:
    done = running(store, 5)
    store.finish(done, DONE, [])
    early, middle = added(store, job(7))[0], running(store, 5)
    (late,) = added(store, job(3))  # the clock was set back
    assert [(one.id, one.status) for one in store.unfinished()] == [
        (early.id, JobStatus.QUEUED),
        (middle.id, JobStatus.RUNNING),
        (late.id, JobStatus.QUEUED),
    ]


def test_events_are_read_in_order_from_any_number(store: JobStore) -> None:
    first, second = added(store, job(), job(1))
    store.add_events([(first.id, event(1)), (second.id, event(1)), (first.id, event(5)), ("gone", event(1))])
    store.add_events([(first.id, event(9))])
    assert store.events(first.id, 0, 10) == [event(1), event(5), event(9)]
    assert store.events(first.id, 1, 10) == [event(5), event(9)]
    assert store.events(first.id, 1, 1) == [event(5)]
    assert store.events(first.id, 9, 10) == []


def test_everything_is_there_after_opening_again(store: JobStore, open_store: Open) -> None:
    claimed = running(store)
    store.add_events([(claimed.id, event(1))])
    before = store.get(claimed.id)
    store.close()
    again = open_store()
    assert again.get(claimed.id) == before
    assert again.events(claimed.id, 0, 10) == [event(1)]


def test_only_one_at_a_time_has_it_open(store: JobStore, open_store: Open) -> None:
    store.open()  # again: nothing happens
    store.check()
    with pytest.raises(StoreUnavailable, match="Another server"):
        open_store()
    store.check()
    store.close()
    open_store().check()


def test_threads_do_not_disturb_each_other(store: JobStore) -> None:
    """Eight write at the same time: every job is claimed by one of those who try, and nothing is lost."""
    jobs = added(store, *(job(number) for number in range(10)))
    won: list[str] = []
    errors: list[Exception] = []
    start = threading.Barrier(8)

    def compete() -> None:
        start.wait()
        try:
            for one in jobs:
                claimed = store.claim(one.id, [event(1)])
                if claimed is not None:
                    won.append(one.id)
                    assert store.finish(claimed, DONE, [event(2)]) is not None
                store.page(3, None, ANY)
        except Exception as error:  # reported by the thread that waits
            errors.append(error)

    threads = [threading.Thread(target=compete) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert errors == []
    assert sorted(won) == sorted(one.id for one in jobs)
    assert store.unfinished() == []
