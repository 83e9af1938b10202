#!/usr/bin/env python3
"""Cost and delay of the web page: server, messages and browser.

    PYTHONPATH=src .venv/bin/python3 bench/web.py --seconds 10
    PYTHONPATH=src .venv/bin/python3 bench/web.py --compare aiohttp

Serves the synthetic fleet of ``test/web/synthetic.py`` with 2, 20 and 100 robots. Cores are CPU
seconds per second. The server's are those of its process less those of the made-up source.

* idle: without clients
* client: with a Python client that wants trails, plans, scans and the costmaps of robot 0
* page: with the page in chromium instead
* message: from the time at which poses are put until the client has them, milliseconds
* browser: all processes of chromium
* paint: from the request until the browser paints the page's first content

``--compare aiohttp`` also serves the same messages by aiohttp to a page of one canvas, without
NiceGUI: what a page of our own making could gain.
"""

from __future__ import annotations

import argparse
import asyncio
import multiprocessing
import os
import statistics
import sys
import threading
import time
from pathlib import Path
from typing import Any, Dict, Iterator, List, Sequence

from tabulate import tabulate

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "test" / "web"), str(ROOT / "src")]

from browser import DESKTOP, chromium  # noqa: E402
from playwright.sync_api import Browser  # noqa: E402
from stream_client import open_stream  # noqa: E402
from synthetic_actions import SyntheticActions  # noqa: E402
from synthetic_fleet import SyntheticFleet  # noqa: E402

from quad_web.stream import Stream  # noqa: E402
from quad_web.view.state import FleetState  # noqa: E402

LAYERS = ("trail", "plan", "local_plan", "scan", "global_costmap", "local_costmap")
SETTLES_S = 2.0
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
CANVAS = ROOT / "bench" / "web_canvas.html"


def main() -> None:
    """Measure and print a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, nargs="*", default=[2, 20, 100])
    parser.add_argument("--seconds", type=float, default=10.0, help="for each figure")
    parser.add_argument("--compare", choices=["aiohttp"], help="also serve without NiceGUI")
    args = parser.parse_args()
    servers = ["nicegui", *([args.compare] if args.compare else [])]
    rows = []
    with chromium(draws_3d=False) as browser:
        for robots in args.robots:
            for server in servers:
                rows.append(measure(browser, server, robots, args.seconds))
                print(rows[-1], flush=True)
    print(tabulate(rows, headers="keys", floatfmt=".3g"))
    print(f"load of the machine: {os.getloadavg()[0]:.1f} on {os.cpu_count()} cores")


def measure(browser: Browser, server: str, robots: int, seconds: float) -> Dict[str, Any]:
    """Return the figures of one server with one fleet."""
    ours, theirs = multiprocessing.Pipe()
    child = multiprocessing.get_context("spawn").Process(
        target=serve, args=(server, robots, theirs)
    )
    child.start()
    url = ours.recv()
    row: Dict[str, Any] = {"server": server, "robots": robots}
    time.sleep(SETTLES_S)
    row["idle"] = cores_of(ours, seconds)
    row.update(client_figures(url, ours, seconds))
    row.update(page_figures(browser, url, ours, seconds))
    ours.send("end")
    child.join()
    return row


def cores_of(pipe: Any, seconds: float) -> float:
    """Return the server's cores over some seconds."""
    pipe.send("cpu")
    before_s = pipe.recv()
    time.sleep(seconds)
    pipe.send("cpu")
    return (pipe.recv() - before_s) / seconds


def client_figures(url: str, pipe: Any, seconds: float) -> Dict[str, Any]:
    """Return the server's cores with a Python client, and the delay and size of messages."""
    delays_ms: List[float] = []
    sizes: List[int] = []
    ended = threading.Event()

    def read() -> None:
        with open_stream(url) as stream:
            stream.want(LAYERS, robot=0)
            while not ended.is_set():
                header = stream.receive()
                now_s = time.time()
                sizes.append(stream.size)
                for item in header["items"]:
                    if item["key"] == "poses":
                        delays_ms.append(1000.0 * (now_s - item["data"]["wall_s"]))

    thread = threading.Thread(target=read)
    thread.start()
    time.sleep(SETTLES_S)
    delays_ms.clear()
    sizes.clear()
    cores = cores_of(pipe, seconds)
    rate_hz = len(delays_ms) / seconds
    ended.set()
    thread.join()
    return {
        "client": cores,
        "Hz": rate_hz,
        "kB": statistics.mean(sizes) / 1e3,
        "message ms": statistics.median(delays_ms),
        "95 %": percentile_95(delays_ms),
    }


def page_figures(browser: Browser, url: str, pipe: Any, seconds: float) -> Dict[str, Any]:
    """Return what a page in the browser costs, and when it is there."""
    page = browser.new_page(**DESKTOP)
    page.goto(url)
    page.wait_for_timeout(1000.0 * SETTLES_S)
    paint_ms = page.evaluate("performance.getEntriesByName('first-contentful-paint')[0].startTime")
    processes = list(descendants(os.getpid(), "chrom"))
    before_s = sum(map(cpu_s, processes))
    server = cores_of(pipe, seconds)
    browser_cores = (sum(map(cpu_s, processes)) - before_s) / seconds
    page.close()
    return {"page": server, "browser": browser_cores, "paint ms": paint_ms}


def percentile_95(values: Sequence[float]) -> float:
    """Return the value that 95 % are below."""
    return statistics.quantiles(values, n=20)[-1]


def descendants(pid: int, name: str) -> Iterator[int]:
    """Yield the processes below one whose command has a name in it."""
    for task in Path(f"/proc/{pid}/task").iterdir():
        for child in map(int, (task / "children").read_text().split()):
            if name in Path(f"/proc/{child}/comm").read_text():
                yield child
            yield from descendants(child, name)


def cpu_s(pid: int) -> float:
    """Return the CPU time of a process; 0 once it has ended."""
    try:
        fields = Path(f"/proc/{pid}/stat").read_text().rpartition(") ")[2].split()
    except FileNotFoundError:
        return 0.0
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


# -- the child process ---------------------------------------------------------------


def serve(server: str, robots: int, pipe: Any) -> None:
    """Serve a fleet until told to end; answer each request with the CPU time of the server."""
    fleet = SyntheticFleet(robots)
    fleet.start()
    ready = threading.Event()
    urls: List[str] = []

    def on_ready(url: str) -> None:
        urls.append(url)
        ready.set()

    target = {"nicegui": _serve_nicegui, "aiohttp": _serve_aiohttp}[server]
    threading.Thread(target=target, args=(fleet, on_ready), daemon=True).start()
    ready.wait()
    pipe.send(urls[0])
    while pipe.recv() == "cpu":
        pipe.send(time.process_time() - fleet.cpu_s)


def _serve_nicegui(fleet: SyntheticFleet, on_ready: Any) -> None:
    from quad_web.server import WebOptions
    from quad_web.server import serve as serve_page

    options = WebOptions(on_ready=lambda urls: on_ready(urls.steer))
    serve_page(fleet.state, SyntheticActions(fleet), options)


def _serve_aiohttp(fleet: SyntheticFleet, on_ready: Any) -> None:
    asyncio.run(_aiohttp(fleet.state, on_ready))


async def _aiohttp(state: FleetState, on_ready: Any) -> None:
    from aiohttp import WSMsgType, web

    stream = Stream(state)

    async def page(request: web.Request) -> web.FileResponse:
        return web.FileResponse(CANVAS)

    async def socket(request: web.Request) -> web.WebSocketResponse:
        connection = web.WebSocketResponse(compress=False)
        await connection.prepare(request)
        received = iter([{"type": "websocket.connect"}])

        async def receive() -> Dict[str, Any]:
            for first in received:
                return first
            message = await connection.receive()
            if message.type is WSMsgType.TEXT:
                return {"type": "websocket.receive", "text": message.data}
            return {"type": "websocket.disconnect"}

        async def send(message: Dict[str, Any]) -> None:
            if message["type"] == "websocket.send":
                await connection.send_bytes(message["bytes"])

        await stream({}, receive, send)
        return connection

    app = web.Application()
    app.add_routes([web.get("/", page), web.get("/stream", socket)])
    runner = web.AppRunner(app, access_log=None)
    await runner.setup()
    site = web.TCPSite(runner, "127.0.0.1", 0)
    await site.start()
    port = runner.addresses[0][1]
    on_ready(f"http://127.0.0.1:{port}/")
    await asyncio.Event().wait()


if __name__ == "__main__":
    main()
