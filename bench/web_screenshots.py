#!/usr/bin/env python3
"""Pictures of the web page, to be looked at.

    PYTHONPATH=src .venv/bin/python3 bench/web_screenshots.py FOLDER

Fleets of 2, 20 and 100 made-up quadcopters in both sizes, in 2D and 3D, the editor of goals, and a
recording.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any, Callable, Dict

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "test" / "web"), str(ROOT / "src")]

from browser import DESKTOP, PHONE, chromium  # noqa: E402
from driver import Driver  # noqa: E402
from playwright.sync_api import Browser  # noqa: E402
from serving import Served  # noqa: E402

SIZES: Dict[str, Dict[str, Any]] = {"desktop": DESKTOP, "phone": PHONE}
SETTLES_MS = 4000


def main() -> None:
    """Take all pictures."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    with chromium() as browser:
        for robots in (2, 20, 100):
            server = Served("--robots", str(robots))
            for size in SIZES:
                take(browser, server, size, folder / f"{size}_{robots}.png", select)
            take(browser, server, "desktop", folder / f"desktop_{robots}_3d.png", orbit)
            if robots == 2:
                take(browser, server, "desktop", folder / "desktop_goals.png", edit)
                take(browser, server, "phone", folder / "phone_robot.png", card)
            server.stop()
        server = Served("--robots", "2", "--replay", "60")
        for size in SIZES:
            take(browser, server, size, folder / f"{size}_replay.png", lambda driver: None)
        server.stop()


def take(
    browser: Browser, server: Served, size: str, file: Path, prepare: Callable[[Driver], None]
) -> None:
    """Open the page, prepare it, and take a picture."""
    context = browser.new_context(**SIZES[size])
    page = context.new_page()
    page.goto(server.url)
    driver = Driver(page).is_ready()
    prepare(driver)
    page.wait_for_timeout(SETTLES_MS)
    page.screenshot(path=file)
    context.close()
    print(file)


def select(driver: Driver) -> None:
    """Select a robot, and show the whole arena with its local costmap."""
    driver.at("robots-row-0").click()
    driver.at("layers").click()
    driver.at("layer-local_costmap").click()
    driver.page.keyboard.press("Escape")
    driver.fit()


def orbit(driver: Driver) -> None:
    """Show the arena in 3D."""
    driver.at("mode").get_by_text("3D").click()


def edit(driver: Driver) -> None:
    """Edit the goals of a robot in the arena."""
    driver.at("robots-row-0").click()
    driver.at("side-goals").click()
    driver.at("goals-edit").click()
    driver.fit()


def card(driver: Driver) -> None:
    """Show a robot's card on a phone."""
    driver.at("robots-row-0").click()
    driver.at("phone-robot").click()


if __name__ == "__main__":
    main()
