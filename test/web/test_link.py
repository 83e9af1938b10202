"""A link that dies, says so, and comes back; several pages of one server."""

from __future__ import annotations

import re

from driver import Driver
from playwright.sync_api import expect

GONE = r"ERR_CONNECTION_REFUSED|WebSocket connection|Failed to load resource"


NOTICE = ".quad-link-notice"


def test_a_page_whose_server_is_gone_says_so_and_comes_back(open_page, serve):
    server = serve("--robots", "2")
    driver = Driver(open_page(server.url)).is_ready()
    notice = driver.page.locator(NOTICE)
    expect(notice).to_be_hidden()
    driver.page.watch.forgive(GONE)
    server.stop()
    expect(notice).to_contain_text("reconnecting")
    expect(driver.page.locator("body")).to_have_class(re.compile("quad-link-dead"))
    serve("--robots", "3", "--port", server.port)
    expect(notice).to_be_hidden()
    expect(driver.rows()).to_have_count(3)
    driver.is_ready()


def tokens(age):
    return "--steer-token", f"{age}-to-steer", "--watch-token", f"{age}-to-watch"


def test_a_page_with_an_old_token_says_what_to_do_and_comes_back(open_page, serve):
    server = serve("--robots", "2", *tokens("old"))
    driver = Driver(open_page(server.url)).is_ready()
    notice = driver.page.locator(NOTICE)
    driver.page.watch.forgive(GONE)
    server.stop()
    expect(notice).to_contain_text("reconnecting")
    other = serve("--robots", "3", "--port", server.port, *tokens("new"))
    expect(notice).to_contain_text("open the address that it has printed")
    assert driver.page.context.new_page().goto(other.url).ok  # the cookie is the browser's
    expect(notice).to_be_hidden()
    expect(driver.rows()).to_have_count(3)


def test_a_page_whose_server_hangs_says_so(driver, server):
    notice = driver.page.locator(NOTICE)
    driver.page.watch.forgive(GONE)
    server.pause()
    expect(notice).to_contain_text("reconnecting")
    server.resume()
    expect(notice).to_be_hidden()


def test_two_pages_both_see_what_came_of_an_action(driver, open_page, server):
    other = Driver(open_page(server.url)).is_ready()
    driver.at("play").click()
    driver.says("paused")
    for one in (driver, other):
        expect(one.at("flight-state")).to_have_text("paused")
        expect(one.at("events")).to_contain_text("paused")
    other.select(1)
    assert driver.arena("fleet.selected") is None  # each page has its own selection
