"""Chromium as the tests use it: found, started, and watched for errors and foreign requests."""

from __future__ import annotations

import os
import re
import subprocess
import time
from contextlib import contextmanager
from pathlib import Path
from typing import Callable, Iterator, List
from urllib.parse import urlsplit

from playwright.sync_api import Browser, BrowserContext, Page, sync_playwright

ROOT = Path(__file__).resolve().parents[2]
DESKTOP = {"viewport": {"width": 1440, "height": 900}}
PHONE = {
    "viewport": {"width": 390, "height": 844},
    "device_scale_factor": 2,
    "has_touch": True,
    "is_mobile": True,
}
LOCAL_HOSTS = ("127.0.0.1", "localhost", "::1")

# Root has no sandbox. SwiftShader draws WebGL without a graphics card. The rest keeps chromium from
# asking its maker for updates.
ARGUMENTS = [
    "--no-sandbox",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]
# For WebGL alone. With --use-angle=swiftshader the whole page would be drawn by it, at four times
# the CPU.
SWIFTSHADER = ["--enable-unsafe-swiftshader"]


@contextmanager
def chromium(draws_3d: bool = True) -> Iterator[Browser]:
    """Start a browser, and end it afterwards.

    Args:
        draws_3d: Have WebGL, from SwiftShader.
    """
    graphics = SWIFTSHADER if draws_3d else ["--disable-gpu"]
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find(), args=[*ARGUMENTS, *graphics])
        yield browser
        browser.close()


def find() -> str:
    """Return the path of the installed browser."""
    return (
        os.environ.get("QUAD_CHROMIUM")
        or subprocess.run(
            [str(ROOT / "scripts" / "chromium")], check=True, stdout=subprocess.PIPE, text=True
        ).stdout.strip()
    )


class Watch:
    """What goes wrong in the pages of a context: errors, and requests that leave the machine."""

    def __init__(self, context: BrowserContext) -> None:
        self._all: List[str] = []
        self._forgiven: List[str] = []
        context.on("page", self._watch)

    def _watch(self, page: Page) -> None:
        page.on("pageerror", lambda error: self._all.append(f"exception: {error}"))
        page.on("console", self._console)
        page.on("request", lambda request: self._requested(request.url))
        page.on("websocket", lambda socket: self._requested(socket.url))

    def _console(self, message) -> None:
        if message.type == "error":
            self._all.append(f"console: {message.text} ({message.location.get('url', '')})")

    def _requested(self, url: str) -> None:
        parts = urlsplit(url)
        if parts.scheme in ("http", "https", "ws", "wss") and parts.hostname not in LOCAL_HOSTS:
            self._all.append(f"request to another host: {url}")

    def forgive(self, pattern: str) -> None:
        """Take no offence at faults that a test brings about, now or later."""
        self._forgiven.append(pattern)

    @property
    def faults(self) -> List[str]:
        """What went wrong and is not forgiven."""
        return [
            fault
            for fault in self._all
            if not any(re.search(pattern, fault) for pattern in self._forgiven)
        ]


def until(page: Page, condition: Callable[[], bool], patience_s: float = 10.0) -> None:
    """Let the browser work until a condition holds.

    Raises:
        AssertionError: It does not hold in time.
    """
    end_s = time.monotonic() + patience_s
    while not condition():
        assert time.monotonic() < end_s, f"waited {patience_s} s in vain: {condition.__name__}"
        page.wait_for_timeout(20)  # also hands out the page's events
