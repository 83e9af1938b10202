#!/usr/bin/env python3
"""Memory of the web page and its server over time.

    PYTHONPATH=src .venv/bin/python3 bench/web_soak.py --minutes 60

Serves the synthetic fleet of ``test/web/synthetic.py`` to chromium and to a Python client
that wants every layer. Samples the server's resident memory, that of chromium's process for the
page, and the page's JavaScript heap after a garbage collection. The status is 1 if the mean of the
last third is more than 5 % above that of the first third, the warm-up left out.
"""

from __future__ import annotations

import argparse
import sys
import threading
import time
from pathlib import Path
from typing import Dict, List

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path[:0] = [str(ROOT / "test" / "web"), str(ROOT / "src")]

from browser import DESKTOP, chromium  # noqa: E402
from playwright.sync_api import Browser, CDPSession  # noqa: E402
from serving import Served  # noqa: E402
from stream_client import open_stream  # noqa: E402

from quad_web.view.state import LAYERS  # noqa: E402

WARM_UP_S = 120.0
MOST_GROWTH = 0.05


class Reader(threading.Thread):
    """A client that wants everything, reads and acknowledges each message."""

    def __init__(self, url: str) -> None:
        super().__init__(daemon=True)
        self.frames = 0
        self.ended = threading.Event()
        self._url = url

    def run(self) -> None:
        """Read until ``ended`` is set."""
        with open_stream(self._url) as stream:
            stream.want(LAYERS, robot=0)
            while not self.ended.is_set():
                stream.receive()
                self.frames += 1


def main() -> int:
    """Measure, print a table, and return the status."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--minutes", type=float, default=60.0)
    parser.add_argument("--robots", type=int, default=20)
    parser.add_argument("--period", type=float, default=10.0, help="seconds between samples")
    args = parser.parse_args()
    server = Served("--robots", str(args.robots))
    try:
        with chromium() as browser:
            samples = measure(browser, server, args.minutes * 60.0, args.period)
    finally:
        server.stop()
    return report(samples)


def measure(
    browser: Browser, server: Served, duration_s: float, period_s: float
) -> List[Dict[str, float]]:
    """Return samples: time_s, and MB of the server, the page's process and its heap."""
    page = browser.new_page(**DESKTOP)
    page.goto(server.url)
    reader = Reader(server.url)
    reader.start()
    debug = page.context.new_cdp_session(page)
    system = browser.new_browser_cdp_session()
    start_s = time.monotonic()
    samples: List[Dict[str, float]] = []
    print("  time_s  server  page  heap, MB   frames read", flush=True)
    while time.monotonic() - start_s < duration_s:
        page.wait_for_timeout(1000.0 * period_s)
        debug.send("HeapProfiler.collectGarbage")
        sample = {
            "time_s": time.monotonic() - start_s,
            "server": resident_mb(server.process.pid),
            "page": max(resident_mb(pid) for pid in renderers(system)),
            "heap": page.evaluate("performance.memory.usedJSHeapSize") / 1e6,
        }
        samples.append(sample)
        print(
            "{time_s:8.0f} {server:7.1f} {page:6.1f} {heap:5.1f}".format(**sample),
            f"{reader.frames:12d}",
            flush=True,
        )
        assert reader.is_alive(), "the reading client has lost its connection"
    reader.ended.set()
    reader.join()
    return samples


def renderers(system: CDPSession) -> List[int]:
    """Return the processes of chromium that show pages."""
    processes = system.send("SystemInfo.getProcessInfo")["processInfo"]
    return [process["id"] for process in processes if process["type"] == "renderer"]


def resident_mb(pid: int) -> float:
    """Return a process's resident memory in MB."""
    for line in Path(f"/proc/{pid}/status").read_text().splitlines():
        if line.startswith("VmRSS:"):
            return int(line.split()[1]) / 1e3
    raise ValueError(f"process {pid} has no VmRSS")


def report(samples: List[Dict[str, float]]) -> int:
    """Print growth and slope of each quantity, and return 1 if one is not flat."""
    warm = [sample for sample in samples if sample["time_s"] >= WARM_UP_S]
    if len(warm) < 6:
        print(f"quad: too short: expected a minute more than the warm-up of {WARM_UP_S:.0f} s")
        return 2
    third = len(warm) // 3
    time_s = np.array([sample["time_s"] for sample in warm])
    is_flat = True
    for name in ("server", "page", "heap"):
        values = np.array([sample[name] for sample in warm])
        growth = values[-third:].mean() / values[:third].mean() - 1.0
        slope = np.polyfit(time_s, values, 1)[0] * 3600.0
        is_flat &= growth <= MOST_GROWTH
        print(
            f"{name}: {values.mean():.1f} MB, last third {100 * growth:+.1f} % of the first,"
            f" slope {slope:+.1f} MB/h"
        )
    return 0 if is_flat else 1


if __name__ == "__main__":
    sys.exit(main())
