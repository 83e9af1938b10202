"""Fixtures of the browser tests: servers, one browser, and pages of two sizes."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from browser import DESKTOP, PHONE, ROOT, Watch, chromium
from driver import Driver
from playwright.sync_api import expect
from serving import Served

SCREENSHOTS = Path(os.environ.get("QUAD_SCREENSHOTS", ROOT / "build" / "screenshots"))
PATIENCE_MS = 15000
expect.set_options(timeout=PATIENCE_MS)


@pytest.fixture(scope="session")
def browser():
    with chromium() as started:
        yield started


@pytest.fixture
def serve():
    """Start servers with options of ``synthetic.py``; all end with the test."""
    running = []

    def start(*options: str, **choices) -> Served:
        running.append(Served(*options, **choices))
        return running[-1]

    yield start
    faults = [fault for server in running for fault in server.faults()]
    for server in running:
        server.stop()
    assert faults == []


@pytest.fixture(scope="session")
def lasting_server():
    server = Served("--robots", "2")
    yield server
    server.stop()


@pytest.fixture
def server(lasting_server):
    """A server of two robots whose flight has just begun; tests do not end it."""
    lasting_server.renew()
    yield lasting_server
    assert lasting_server.faults() == []


@pytest.fixture
def open_page(browser, request):
    """Open pages that are each alone in a browser profile; a fault in any fails the test."""
    opened = []

    def open_at(url, **options):
        context = browser.new_context(**{**DESKTOP, **options})
        context.set_default_timeout(PATIENCE_MS)
        watch = Watch(context)
        page = context.new_page()
        page.watch = watch
        opened.append(page)
        if url is not None:
            page.goto(url)
        return page

    yield open_at
    failed = getattr(request.node, "failed", False)
    faults = [fault for page in opened for fault in page.watch.faults]
    for number, page in enumerate(opened):
        if failed or faults:
            SCREENSHOTS.mkdir(parents=True, exist_ok=True)
            page.screenshot(path=SCREENSHOTS / f"{request.node.name}-{number}.png")
        page.context.close()
    assert faults == []


@pytest.fixture
def page(open_page, server):
    return open_page(server.url)


@pytest.fixture
def driver(page):
    return Driver(page).is_ready()


@pytest.fixture
def phone(open_page, server):
    return Driver(open_page(server.url, **PHONE)).is_ready()


@pytest.hookimpl(hookwrapper=True)
def pytest_runtest_makereport(item, call):
    outcome = yield
    if call.when == "call" and outcome.get_result().failed:
        item.failed = True
