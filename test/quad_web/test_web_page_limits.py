"""What the server of the page logs and keeps: a line for each kind of fault, few messages."""

from __future__ import annotations

import asyncio
import logging

import pytest

from quad_web import page_limits
from quad_web.page_limits import MAX_KINDS, Complaints


@pytest.fixture
def log(caplog):
    logger = logging.getLogger("quad.test_web_page_limits")
    ending = []
    complaints = Complaints(lambda: bool(ending))
    logger.addFilter(complaints)
    yield logger, ending
    logger.removeFilter(complaints)


def fail(logger, error, text=None):
    try:
        raise error
    except type(error) as caught:
        logger.exception(text or caught)


PLACE = f"(test_web_page_limits.py:{fail.__code__.co_firstlineno + 2})"


def test_a_fault_is_one_line_with_its_place(log, caplog):
    fail(log[0], ValueError("a\nb\x1b[31m" + "x" * 1000), "Task exception\nfuture: ...")
    (record,) = caplog.records
    text = record.getMessage()
    assert text.startswith("web: Task exception: ValueError: a\\nb\\x1b[31mxxx")
    assert len(text) < 400
    assert text.endswith(PLACE)
    assert record.exc_info is None


def test_a_kind_is_repeated_after_some_seconds(log, caplog, monkeypatch):
    now_s = 100.0
    monkeypatch.setattr(page_limits.time, "monotonic", lambda: now_s)
    for _ in range(3):
        for _ in range(100):
            fail(log[0], KeyError("x"))
        now_s += 5.0
    assert [record.getMessage() for record in caplog.records] == [f"web: KeyError: 'x' {PLACE}"] * 3


def test_kinds_are_limited(log, caplog):
    for number in range(MAX_KINDS + 5):
        log[0].error(f"kind {number}")
        log[0].error(f"kind {number}")
    assert len(caplog.records) == MAX_KINDS


def test_what_a_stop_cuts_off_is_not_logged(log, caplog):
    log[1].append(True)
    log[0].error("connection lost")
    assert caplog.records == []


def test_too_many_waiting_messages_end_the_connection_of_a_page():
    async def left():
        queue = page_limits._Waiting()
        for number in range(page_limits.MAX_WAITING):
            await queue.put(number)
        assert queue.qsize() == page_limits.MAX_WAITING
        await queue.put("one more")
        await queue.put("after the end")
        packets = [queue.get_nowait() for _ in range(queue.qsize())]
        for _ in packets:
            queue.task_done()
        await queue.join()
        return packets

    assert asyncio.run(left()) == [None, "after the end"]
