"""Events of a job: their numbers, who is told, what is still to be stored."""

import asyncio
import json

from duocell.service.jobs.event_log import STRIDE, EventLog


def test_numbers_rise_from_state_to_state_and_in_between() -> None:
    feed = EventLog()
    events = [feed.state(1, "status", status="queued"), feed.state(2, "status", status="running")]
    feed.tell(*events)
    feed.note("stage", '{"done": 0.5}')
    feed.tell(feed.state(3, "done"))
    numbers = [event.number for event in feed.after(0)]
    assert numbers == [STRIDE + 1, 2 * STRIDE + 1, 2 * STRIDE + 2, 3 * STRIDE + 1]


def test_data_are_json_with_the_time() -> None:
    feed = EventLog()
    feed.note("stage", '{"done": 0.5}')
    feed.note("stage", "{}")
    feed.tell(feed.state(2, "done", name='"ü"'))
    data = [json.loads(event.data) for event in feed.after(0)]
    assert all(entry.pop("at").endswith("Z") for entry in data)
    assert data == [{"done": 0.5}, {}, {"name": '"ü"'}]


def test_what_is_stored_is_not_stored_again() -> None:
    feed = EventLog()
    for _ in range(3):
        feed.note("stage", "{}")
    first = feed.unsaved()
    assert len(first) == 3
    feed.note("stage", "{}")  # meanwhile
    feed.saved(first[-1].number)
    assert feed.unsaved() == feed.after(first[-1].number)
    assert len(feed.unsaved()) == 1


def test_everybody_who_waits_is_told() -> None:
    async def story() -> None:
        feed = EventLog()
        followers = [asyncio.create_task(feed.news(10.0)) for _ in range(3)]
        await asyncio.sleep(0)
        feed.note("stage", "{}")
        assert await asyncio.gather(*followers) == [True, True, True]
        assert not await feed.news(0.01)
        last = asyncio.create_task(feed.news(10.0))
        await asyncio.sleep(0)
        feed.close()
        assert await last

    asyncio.run(story())
