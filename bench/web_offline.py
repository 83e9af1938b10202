"""Measure what a page costs an offline flight at full speed.

Flights without and with a page alternate::

    PYTHONPATH=src .venv/bin/python3 bench/web_offline.py --robots 1 2 10 --pairs 5
    ... --browser        a page in chromium instead of a client in Python

The client shows all layers, follows robot 0, and acknowledges at once. ``wall`` compares the
real-time factors; ``cpu`` compares the processor time of the flight's own processes, which other
work on the machine changes less.
"""

from __future__ import annotations

import argparse
import os
import resource
import statistics
import subprocess
import sys
import time
from pathlib import Path
from typing import List, NamedTuple, Optional

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "test" / "web"), str(ROOT / "src")]

from stream_client import open_stream  # noqa: E402

from quad_nav.loop.worker_process import processes_for  # noqa: E402
from quad_nav.offline.run import fly  # noqa: E402
from quad_nav.recording.web_actions import FlightActions  # noqa: E402
from quad_nav.recording.web_view import WebView  # noqa: E402
from quad_nav.scenario.flight_setup import FlightOptions, read_setup  # noqa: E402
from quad_nav.view.state import LAYERS  # noqa: E402
from quad_nav.web.process import Batch, ServerProcess  # noqa: E402
from quad_nav.web.server import WebOptions  # noqa: E402

WARM_UP_S = 2.0
CHROMIUM = ("--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run")


class Flown(NamedTuple):
    """Real-time factor and processor time of a flight."""

    factor: float
    cpu_s: float


class CountingServer(ServerProcess):
    """Counts the batches."""

    batches = 0

    def send(self, batch: Batch) -> None:
        """Count and send a batch."""
        self.batches += 1
        super().send(batch)


def main() -> None:
    """Fly, and print a line for each number of robots."""
    arguments = parsed()
    if arguments.client:
        show(arguments.client, arguments.browser)
        return
    print(f"load {os.getloadavg()[0]:.1f}, {os.cpu_count()} cores")
    for robots in arguments.robots:
        server = CountingServer(WebOptions(), FlightActions.available)
        flight(robots, WARM_UP_S, None)
        shown_flight(robots, WARM_UP_S, arguments.browser, server)
        server.batches = 0
        plain: List[Flown] = []
        shown: List[Flown] = []
        for number in range(arguments.pairs):
            for is_shown in (False, True) if number % 2 else (True, False):
                if is_shown:
                    shown.append(shown_flight(robots, arguments.seconds, arguments.browser, server))
                else:
                    plain.append(flight(robots, arguments.seconds, None))
        server.close()
        report(robots, plain, shown, server.batches / arguments.pairs)


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--robots", type=int, nargs="+", default=[1, 2, 10])
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--seconds", type=float, default=60.0, help="simulated time of a flight")
    parser.add_argument("--browser", action="store_true")
    parser.add_argument("--client", help=argparse.SUPPRESS)
    return parser.parse_args()


def flight(robots: int, time_limit_s: float, server: Optional[ServerProcess]) -> Flown:
    """Fly, on a page if there is a server."""
    is_small = robots <= 2
    options = FlightOptions(
        ROOT / "scenes" / "arena.yaml" if is_small else None,
        ROOT / "goals" if is_small else None,
        robots=robots,
        seed=1,
        time_limit_s=time_limit_s,
    )
    observers = [] if server is None else [WebView(server, FlightActions(rate=0.0))]
    setup, before_s = read_setup(options), cpu_s()
    summary = fly(setup, observers, processes_for(robots))
    return Flown(summary.real_time_factor or 0.0, cpu_s() - before_s)


def shown_flight(robots: int, time_limit_s: float, browser: bool, server: ServerProcess) -> Flown:
    """Fly while a client shows everything."""
    command = [sys.executable, __file__, "--client", server.urls.steer]
    client = subprocess.Popen(command + ["--browser"] * browser)
    flown = flight(robots, time_limit_s, server)
    client.terminate()
    client.wait()
    while server.wanted:
        server.wait(0.1)
        server.poll()
    return flown


def cpu_s() -> float:
    """Processor time of this process and of the workers that have ended."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    used = [resource.getrusage(kind) for kind in kinds]
    return sum(one.ru_utime + one.ru_stime for one in used)


def show(url: str, browser: bool) -> None:
    """Show the page until this process is killed."""
    if browser:
        from playwright.sync_api import sync_playwright

        with sync_playwright() as playwright:
            chromium = playwright.chromium.launch(
                executable_path="/usr/bin/chromium", args=list(CHROMIUM)
            )
            chromium.new_page(viewport={"width": 1440, "height": 900}).goto(url)
            time.sleep(3600.0)
    with open_stream(url) as stream:
        stream.want(LAYERS, 0)
        while True:
            stream.receive()


def report(robots: int, plain: List[Flown], shown: List[Flown], batches: float) -> None:
    """Print medians, and the range of what is lost."""
    pairs = list(zip(plain, shown))
    lost = [100.0 * (1.0 - with_page.factor / without.factor) for without, with_page in pairs]
    cpu = [100.0 * (with_page.cpu_s / without.cpu_s - 1.0) for without, with_page in pairs]
    print(
        f"{robots:4d} robots: factor {statistics.median(one.factor for one in plain):6.1f} plain,"
        f" {statistics.median(one.factor for one in shown):6.1f} with a page;"
        f" lost {statistics.median(lost):5.1f} % ({min(lost):.0f} to {max(lost):.0f}),"
        f" cpu {statistics.median(cpu):+5.1f} %, {batches:.0f} samples a flight",
        flush=True,
    )


if __name__ == "__main__":
    main()
