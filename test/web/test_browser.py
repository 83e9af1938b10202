"""What the fixtures report of a page: its errors, and requests to other hosts."""

from __future__ import annotations

import pytest
from browser import Watch, until


@pytest.fixture
def watched(browser):
    context = browser.new_context()
    watch = Watch(context)
    yield context.new_page(), watch
    context.close()


def test_errors_of_a_page_are_faults(watched):
    page, watch = watched
    page.evaluate("console.error('first'); setTimeout(() => { throw new Error('second') })")
    until(page, lambda: len(watch.faults) == 2)
    assert sorted(fault.split(" ")[:2] for fault in watch.faults) == [
        ["console:", "first"],
        ["exception:", "second"],
    ]


@pytest.mark.parametrize(
    "script",
    ["fetch('https://quad.invalid/x').catch(() => 0)", "new WebSocket('wss://quad.invalid/')"],
)
def test_requests_to_other_hosts_are_faults(watched, script):
    page, watch = watched
    page.evaluate(f"() => {{ {script} }}")
    until(page, lambda: len(watch.faults) == 2)  # the browser complains as well
    assert [fault for fault in watch.faults if fault.startswith("request to another host: ")]
    watch.forgive("quad.invalid")
    assert watch.faults == []
