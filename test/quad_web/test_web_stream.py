"""The stream to one page: what is sent, when, and who is dropped. The page is a pair of queues."""

from __future__ import annotations

import asyncio
import json
import time

import pytest

from quad_web import stream as web_stream
from quad_web.stream import Stream
from quad_web.view.codec import decode
from quad_web.view.state import FleetState, Item, Wanted

PATIENCE_S = 10.0


class Page:
    """The browser's end of the connection."""

    def __init__(self, stream, reads=True):
        self._to_server: asyncio.Queue = asyncio.Queue()
        self._sent: asyncio.Queue = asyncio.Queue()
        self._reads = reads
        self._to_server.put_nowait({"type": "websocket.connect"})
        self.task = asyncio.ensure_future(stream({}, self._to_server.get, self._take))

    async def _take(self, message):
        if message["type"] == "websocket.send" and not self._reads:
            await asyncio.Event().wait()
        self._sent.put_nowait(message)

    def say(self, message):
        self.say_text(json.dumps(message))

    def say_text(self, text):
        self._to_server.put_nowait({"type": "websocket.receive", "text": text})

    def leave(self):
        self._to_server.put_nowait({"type": "websocket.disconnect", "code": 1001})

    async def event(self):
        return await asyncio.wait_for(self._sent.get(), PATIENCE_S)

    async def header(self, acknowledge=True):
        event = await self.event()
        assert event["type"] == "websocket.send", event
        header, _ = decode(event["bytes"])
        if acknowledge:
            self.say({"ack": header["seq"]})
        return header

    @property
    def has_message(self):
        return not self._sent.empty()


@pytest.fixture
def state():
    return FleetState()


def run(state, scenario):
    """Run a scenario with a page that has been accepted; return what it returns."""

    async def main():
        stream = Stream(state)
        page = Page(stream)
        assert (await page.event())["type"] == "websocket.accept"
        return await scenario(page, stream)

    return asyncio.run(main())


def keys(header):
    return [item["key"] for item in header["items"]]


def test_page_gets_what_is_there_then_what_it_wants(state):
    state.put_all([Item("flight"), Item("plan/0"), Item("local_costmap/3")])

    async def scenario(page, stream):
        first = await page.header()
        page.say({"want": {"layers": ["plan", "local_costmap", "of the future"], "robot": 3}})
        second = await page.header()
        page.say({"want": {"layers": ["local_costmap"], "robot": None}})
        return first, second, await page.header()

    before_s = time.time()
    first, second, third = run(state, scenario)
    assert (first["seq"], keys(first)) == (0, ["flight"])
    assert before_s <= first["wall_s"] <= time.time()
    assert (second["seq"], keys(second)) == (1, ["plan/0", "local_costmap/3"])
    assert (third["seq"], keys(third)) == (2, [])
    assert sorted(third["removed"]) == ["local_costmap/3", "plan/0"]


def test_changes_that_no_one_wants_send_nothing(state):
    async def scenario(page, stream):
        await page.header()
        state.put("plan/0")
        state.put("scan/0")
        header = await page.header()  # a keep-alive
        state.put("goals")
        return header, await page.header()

    quiet, header = run(state, scenario)
    assert (quiet["items"], quiet["removed"]) == ([], [])
    assert keys(header) == ["goals"]


def test_nothing_is_sent_before_the_last_message_is_acknowledged(state, monkeypatch):
    monkeypatch.setattr(web_stream, "KEEP_ALIVE_S", 0.0)

    async def scenario(page, stream):
        await page.header(acknowledge=False)
        for k in range(50):
            state.put("poses", k)
            await asyncio.sleep(0)
        page.say({"ack": 7})  # not that one
        page.say({"want": {"layers": ["plan"], "robot": None}})
        while state.wanted() != (Wanted(frozenset({"plan"})),):
            await asyncio.sleep(0)
        assert not page.has_message
        page.say({"ack": 0})
        return await page.header()

    header = run(state, scenario)
    assert [item["data"] for item in header["items"]] == [49]  # the newest alone


def test_page_that_leaves_is_forgotten(state):
    async def scenario(page, stream):
        await page.header()
        assert len(state.wanted()) == 1
        page.leave()
        await asyncio.wait_for(page.task, PATIENCE_S)
        state.put("goals")
        return page.has_message

    assert run(state, scenario) is False
    assert (state.wanted(), state._listeners) == ((), ())


@pytest.mark.parametrize(
    "text, reason",
    [
        ("{", "message { is not JSON"),
        ("[1]", "message [1]; expected an object with want or ack"),
        ("[" * 4000, "message [[["),
        ('{"want": 3}', "want has no valid layers"),
        ('{"want": {"layers": "plan"}}', "want has no valid layers"),
        ('{"want": {"layers": [1]}}', "want has no valid layers"),
        ('{"want": {"layers": [], "robot": -1}}', "robot of want is not valid"),
        ('{"want": {"layers": [], "robot": true}}', "robot of want is not valid"),
        ('{"want": {"layers": [], "robot": 1e3}}', "robot of want is not valid"),
        (" " * 5000 + "{}", "message is binary or too long; expected up to 4096 characters"),
        (None, "message is binary or too long"),
    ],
)
def test_messages_that_are_not_valid_close_the_connection(state, text, reason):
    async def scenario(page, stream):
        await page.header(acknowledge=False)
        page.say_text(text)
        closed = await page.event()
        await asyncio.wait_for(page.task, PATIENCE_S)
        return closed

    closed = run(state, scenario)
    assert (closed["type"], closed["code"]) == ("websocket.close", 1008)
    assert closed["reason"].startswith(reason)
    assert len(closed["reason"].encode()) <= 123
    assert state.wanted() == ()


def test_page_that_does_not_acknowledge_is_dropped(state, monkeypatch):
    monkeypatch.setattr(web_stream, "ACKNOWLEDGES_WITHIN_S", 0.05)

    async def scenario(page, stream):
        await page.header(acknowledge=False)
        closed = await page.event()
        await asyncio.wait_for(page.task, PATIENCE_S)
        return closed

    closed = run(state, scenario)
    assert closed["reason"] == "no acknowledgement of message 0 within 0.05 s"
    assert state.wanted() == ()


def test_more_pages_than_are_served_are_told_so(state, monkeypatch):
    monkeypatch.setattr(web_stream, "MAX_CLIENTS", 2)

    async def scenario(page, stream):
        second, third = Page(stream), Page(stream)
        await second.event()
        await third.event()
        closed = await third.event()
        second.leave()
        await asyncio.wait_for(second.task, PATIENCE_S)
        fourth = Page(stream)
        await fourth.event()
        return closed, await fourth.header()

    closed, header = run(state, scenario)
    assert (closed["code"], closed["reason"]) == (1013, "2 pages are open; expected fewer")
    assert header["seq"] == 0
