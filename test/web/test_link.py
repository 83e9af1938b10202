"""A link that dies, says so, and comes back."""

from __future__ import annotations

import re

from driver import Driver
from playwright.sync_api import expect

GONE = r"ERR_CONNECTION_REFUSED|WebSocket connection|Failed to load resource"
NOTICE = ".quad-link-notice"


def tokens(age):
    return "--robots", "2", "--steer-token", f"{age}-to-steer", "--watch-token", f"{age}-to-watch"


def test_a_page_whose_server_is_gone_or_has_new_tokens_says_so_and_comes_back(open_page, serve):
    server = serve(*tokens("old"))
    driver = Driver(open_page(server.url)).is_ready()
    notice = driver.page.locator(NOTICE)
    expect(notice).to_be_hidden()
    driver.page.watch.forgive(GONE)
    server.stop()
    expect(notice).to_contain_text("reconnecting")
    expect(driver.page.locator("body")).to_have_class(re.compile("quad-link-dead"))
    other = serve("--port", server.port, *tokens("new"), "--robots", "3")
    expect(notice).to_contain_text("open the address that it has printed")
    assert driver.page.context.new_page().goto(other.url).ok  # the cookie is the browser's
    expect(notice).to_be_hidden()
    expect(driver.rows()).to_have_count(3)


def test_a_page_whose_server_hangs_says_so(driver, server):
    notice = driver.page.locator(NOTICE)
    driver.page.watch.forgive(GONE)
    server.pause()
    try:
        expect(notice).to_contain_text("reconnecting")
    finally:
        server.resume()
    expect(notice).to_be_hidden()
