"""Measure what a page costs an offline flight at full speed.

Flights without and with a page alternate::

    PYTHONPATH=src .venv/bin/python3 bench/web_offline.py --robots 1 2 10 --pairs 5
    ... --browser        a page in chromium instead of a client in Python
    ... --settle 0       the flight begins as soon as the page is open, as in quad fly

The client shows all layers, follows robot 0, and acknowledges at once; the page in chromium shows
what it shows at first. Missions repeat until a flight has lasted about ``--wall`` seconds. ``lost``
compares the real-time factors. The last columns are processor time per second of wall time, in
cores: of the flight with its workers, without and with a page, of the server and of chromium.
Other work on the machine changes these less than the factors.
"""

from __future__ import annotations

import argparse
import contextlib
import multiprocessing
import os
import resource
import statistics
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Iterator, List, NamedTuple, Optional, Tuple

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "test" / "web"), str(ROOT / "src"), str(ROOT / "bench")]

from stream_client import open_stream  # noqa: E402
from web import cpu_s, descendants  # noqa: E402

from quad_nav.loop.worker_process import processes_for  # noqa: E402
from quad_nav.offline.run import fly  # noqa: E402
from quad_nav.scenario.flight_setup import FlightOptions, FlightSetup, read_setup  # noqa: E402
from quad_web.offline.actions import FlightActions  # noqa: E402
from quad_web.offline.view import WebView  # noqa: E402
from quad_web.process import Batch, ServerProcess  # noqa: E402
from quad_web.server import WebOptions  # noqa: E402
from quad_web.view.state import LAYERS  # noqa: E402

WARM_UP_S = 30.0


class Flown(NamedTuple):
    """Real-time factor of a flight, its wall time, and processor times meanwhile."""

    factor: float
    wall_s: float
    flight_s: float
    server_s: float
    browser_s: float


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
        factor = flight(robots, WARM_UP_S, None).factor
        seconds = max(WARM_UP_S, factor * arguments.wall)
        plain: List[Flown] = []
        shown: List[Flown] = []
        for number in range(arguments.pairs):
            for is_shown in (False, True) if number % 2 else (True, False):
                if is_shown:
                    shown.append(shown_flight(robots, seconds, arguments, server))
                else:
                    plain.append(flight(robots, seconds, None))
        server.close()
        report(robots, plain, shown, server.batches)


def parsed() -> argparse.Namespace:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, nargs="+", default=[1, 2, 10])
    parser.add_argument("--pairs", type=int, default=5)
    parser.add_argument("--wall", type=float, default=5.0, help="wall time of a flight, s")
    parser.add_argument("--settle", type=float, default=3.0, help="page open before a flight, s")
    parser.add_argument("--browser", action="store_true")
    parser.add_argument("--client", help=argparse.SUPPRESS)
    return parser.parse_args()


def looped_setup(robots: int, time_limit_s: float) -> FlightSetup:
    """Return the tutorial's mission or a random one, repeated until time is up."""
    is_small = robots <= 2
    setup = read_setup(
        FlightOptions(
            ROOT / "scenes" / "arena.yaml" if is_small else None,
            ROOT / "goals" if is_small else None,
            robots=robots,
            seed=1,
            time_limit_s=time_limit_s,
        )
    )
    looped = [
        replace(robot, sequence=replace(robot.sequence, settings=replace(settings, loop=True)))
        for robot in setup.robots
        for settings in [robot.sequence.settings]
    ]
    return replace(setup, robots=tuple(looped))


def flight(robots: int, time_limit_s: float, server: Optional[ServerProcess]) -> Flown:
    """Fly, on a page if there is a server."""
    observers = [] if server is None else [WebView(server, FlightActions(rate=0.0))]
    setup, before, own_s = looped_setup(robots, time_limit_s), others_cpu_s(), own_cpu_s()
    summary = fly(setup, observers, processes_for(robots))
    used = [max(0.0, now - then) for now, then in zip(others_cpu_s(), before)]
    wall_s = summary.wall_time_s
    return Flown(summary.real_time_factor or 0.0, wall_s, own_cpu_s() - own_s, *used)


def shown_flight(
    robots: int, time_limit_s: float, arguments: argparse.Namespace, server: ServerProcess
) -> Flown:
    """Fly while a client shows the flight."""
    with client_of(server.urls.steer, arguments.browser):
        if arguments.settle > 0.0:
            await_client(server, True)
            time.sleep(arguments.settle)
        flown = flight(robots, time_limit_s, server)
    await_client(server, False)
    return flown


@contextlib.contextmanager
def client_of(url: str, browser: bool) -> Iterator[None]:
    """Have a client in a process of its own."""
    command = [sys.executable, __file__, "--client", url]
    client = subprocess.Popen(command + ["--browser"] * browser)
    yield
    client.terminate()
    client.wait()


def await_client(server: ServerProcess, is_there: bool) -> None:
    """Wait until a client is there, or none."""
    while bool(server.wanted) != is_there:
        server.wait(0.1)
        server.poll()


def own_cpu_s() -> float:
    """Return the processor time of this process and of the workers that have ended."""
    kinds = (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)
    used = [resource.getrusage(kind) for kind in kinds]
    return sum(one.ru_utime + one.ru_stime for one in used)


def others_cpu_s() -> Tuple[float, float]:
    """Return the processor times of the page's server and of chromium."""
    browser = sum(map(cpu_s, descendants(os.getpid(), "chrom")))
    return server_cpu_s(), browser


def server_cpu_s() -> float:
    """Return the processor time of the page's server."""
    return sum(cpu_s(process.pid or 0) for process in multiprocessing.active_children())


def show(url: str, browser: bool) -> None:
    """Show the page until this process is killed."""
    if browser:
        from browser import DESKTOP, chromium  # only this needs playwright

        with chromium(draws_3d=False) as started:
            started.new_page(**DESKTOP).goto(url)
            time.sleep(3600.0)
    with open_stream(url) as stream:
        stream.want(LAYERS, 0)
        while True:
            stream.receive()


def report(robots: int, plain: List[Flown], shown: List[Flown], batches: int) -> None:
    """Print medians, and the range of what is lost."""
    lost = [100.0 * (1.0 - page.factor / bare.factor) for bare, page in zip(plain, shown)]
    seconds = sum(one.wall_s for one in shown)
    print(
        f"{robots:4d} robots: factor {statistics.median(one.factor for one in plain):6.1f} plain,"
        f" {statistics.median(one.factor for one in shown):6.1f} with a page;"
        f" lost {statistics.median(lost):5.1f} % ({min(lost):.0f} to {max(lost):.0f});"
        f" {batches / seconds:.1f} samples/s; cores: flight"
        f" {sum(one.flight_s for one in plain) / sum(one.wall_s for one in plain):.2f} plain,"
        f" {sum(one.flight_s for one in shown) / seconds:.2f} with a page, server"
        f" {sum(one.server_s for one in shown) / seconds:.2f}, chromium"
        f" {sum(one.browser_s for one in shown) / seconds:.2f}",
        flush=True,
    )


if __name__ == "__main__":
    main()
