"""The page on a phone, by touch."""

from __future__ import annotations

from browser import PHONE, until
from playwright.sync_api import expect


def test_everything_is_within_the_width_of_the_screen(phone):
    width = phone.page.evaluate("document.documentElement.scrollWidth")
    assert width <= PHONE["viewport"]["width"]


def test_stop_all_is_always_in_reach(phone, server):
    for panel in ("robots", "robot", "events", "parameters", "goals", "diagnostics"):
        phone.at(f"phone-{panel}").tap()
        expect(phone.at(f"panel-{panel}")).to_be_visible()
        expect(phone.at("stop-all")).to_be_in_viewport(ratio=1)
    phone.at("stop-all").tap()
    phone.says("every robot hovers")
    assert server.calls() == ["('stop_all',)"]


def test_a_tap_in_the_arena_sends_a_goal(phone, server):
    phone.at("robots-row-1").tap()
    phone.use_goal_tool("tool-goal")
    phone.page.touchscreen.tap(*phone.pixel(6.0, 2.0))
    phone.says("goal sent")
    until(phone.page, lambda: len(server.calls()) == 1)
    assert server.calls()[0].startswith("('send_goal', 1, ")


def test_pause_and_lidar(phone, server):
    phone.at("play").tap()
    phone.says("paused")
    phone.at("robots-row-0").tap()
    phone.at("phone-robot").tap()
    phone.at("lidar").tap()
    phone.says("LIDAR off")
    assert server.calls() == ["('pause',)", "('enable_lidar', 0, False)"]
