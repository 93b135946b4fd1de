"""Events of a job: their numbers, who is told, what is still to be stored."""

import asyncio
import json

from duocell.service.jobs.event_log import STRIDE, EventLog


def test_numbers_rise_from_state_to_state_and_in_between() -> None:
    log = EventLog()
    events = [log.state(1, "status", status="queued"), log.state(2, "status", status="running")]
    log.tell(*events)
    log.note("stage", '{"done": 0.5}')
    log.tell(log.state(3, "done"))
    numbers = [event.number for event in log.after(0)]
    assert numbers == [STRIDE + 1, 2 * STRIDE + 1, 2 * STRIDE + 2, 3 * STRIDE + 1]


def test_data_are_json_with_the_time() -> None:
    log = EventLog()
    log.note("stage", '{"done": 0.5}')
    log.note("stage", "{}")
    log.tell(log.state(2, "done", name='"ü"'))
    data = [json.loads(event.data) for event in log.after(0)]
    assert all(entry.pop("at").endswith("Z") for entry in data)
    assert data == [{"done": 0.5}, {}, {"name": '"ü"'}]


def test_what_is_stored_is_not_stored_again() -> None:
    log = EventLog()
    for _ in range(3):
        log.note("stage", "{}")
    first = log.unsaved()
    assert len(first) == 3
    log.note("stage", "{}")  # meanwhile
    log.saved(first[-1].number)
    assert log.unsaved() == log.after(first[-1].number)
    assert len(log.unsaved()) == 1


def test_everybody_who_waits_is_told() -> None:
    async def story() -> None:
        log = EventLog()
        followers = [asyncio.create_task(log.news(10.0)) for _ in range(3)]
        await asyncio.sleep(0)
        log.note("stage", "{}")
        assert await asyncio.gather(*followers) == [True, True, True]
        assert not await log.news(0.01)
        last = asyncio.create_task(log.news(10.0))
        await asyncio.sleep(0)
        log.close()
        assert await last

    asyncio.run(story())
