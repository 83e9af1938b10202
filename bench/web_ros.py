#!/usr/bin/env python3
"""Cost of the node web, and how old poses are when a page gets them.

    scripts/ros_env python3 bench/web_ros.py [--robots 20] [--composed] [--seconds 20] [--browser]

Starts two_quads.launch, or fleet.launch for more robots, at real time. Prints the share of a core
that the node takes without clients, with one that shows everything of robot 0 and the plans, trails
and scans of all, and after it has left; and the delay from the publication of poses to their
arrival at the client, whose drawing is not part of it. With --browser a page in chromium follows:
its first paint, the delay until it has drawn poses, and the share that chromium takes.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import signal
import socket
import subprocess
import sys
import time
from pathlib import Path
from typing import Any, Callable
from xmlrpc.client import ServerProxy

import numpy as np
import psutil
import rosgraph
import rosnode
import rospy
from websockets.sync.client import connect

sys.path.insert(0, str(Path(__file__).resolve().parents[1] / "test" / "web"))

from quad_nav.ros.common.packed_messages import STATES_TOPIC, StatesMessage, StatesReader
from quad_web.view.codec import decode
from quad_web.view.state import LAYERS

READY_S = 60.0
# A page acknowledges a message when it is drawn.
NOTE_DRAWN = """
window.drawn = [];
const stamps = {};
window.WebSocket = class extends WebSocket {
  constructor(...given) {
    super(...given);
    if (!String(given[0]).endsWith('/stream')) return;
    this.addEventListener('message', (event) => {
      const length = new DataView(event.data).getUint32(0, true);
      const text = new TextDecoder().decode(new Uint8Array(event.data, 4, length));
      const header = JSON.parse(text);
      const poses = header.items.find((item) => item.key === 'poses');
      if (poses) stamps[header.seq] = poses.data.stamp_s;
    });
  }
  send(data) {
    super.send(data);
    const seq = String(data).startsWith('{"ack"') ? JSON.parse(data).ack : -1;
    if (seq in stamps) window.drawn.push([stamps[seq], Date.now() / 1000]);
    delete stamps[seq];
  }
};
"""


def main() -> None:
    """Measure and print."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--robots", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=20.0)
    parser.add_argument("--composed", action="store_true", help="two robots: in one process")
    parser.add_argument("--browser", action="store_true", help="open a page, too")
    options = parser.parse_args()
    flight = start(options)
    try:
        wait_for(lambda: rosgraph.Master("/bench_web").hasParam("/use_sim_time"))
        rospy.init_node("bench_web", anonymous=True, disable_signals=True)
        measure(options)
    finally:
        flight.send_signal(signal.SIGINT)
        flight.wait()


def start(options: argparse.Namespace) -> subprocess.Popen:
    """Start the flight with a master of its own."""
    port = free_port()
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    arguments = ["two_quads.launch", f"composed:={str(options.composed).lower()}", "loop:=true"]
    if options.robots != 2:
        arguments = ["fleet.launch", f"robots:={options.robots}", "loop:=true"]
    return subprocess.Popen(
        ["roslaunch", "-p", str(port), "quad", *arguments, "rviz:=false", "web:=true"],
        stdout=subprocess.DEVNULL,
    )


def free_port() -> int:
    """Return a free TCP port."""
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


def wait_for(condition: Callable[[], Any]) -> None:
    """Wait until a condition holds; the ROS master may not be there yet."""
    end_s = time.monotonic() + READY_S
    while time.monotonic() < end_s:
        with contextlib.suppress(OSError):
            if condition():
                return
        time.sleep(0.2)
    sys.exit(f"no flight and page within {READY_S:g} s")


def measure(options: argparse.Namespace) -> None:
    """Measure the three phases and print them."""
    published_s = {}
    reader = StatesReader()

    def note(message: StatesMessage) -> None:
        published_s.setdefault(round(reader.read(message).stamp_s, 4), time.time())

    wait_for(lambda: rospy.get_time() > 3.0 and rospy.get_param("/web/port", 0))  # 0: not yet
    node = node_process()
    time.sleep(3.0)
    print(f"{options.robots} robots, {options.seconds:g} s each")
    print(f"no client:       {share(node, lambda end_s: time.sleep(end_s - time.time()), options)}")
    rospy.Subscriber(STATES_TOPIC, StatesMessage, note, queue_size=100)
    port = rospy.get_param("/web/port")
    origin = f"http://127.0.0.1:{port}"
    with connect(f"ws://127.0.0.1:{port}/stream", origin=origin, max_size=None) as client:
        client.send(json.dumps({"want": {"layers": list(LAYERS), "robot": 0}}))
        receive(client, time.time() + 3.0, {})
        arrived_s: dict = {}
        print(
            f"one client:      {share(node, lambda end: receive(client, end, arrived_s), options)}"
        )
    print(f"poses:           {delays_text(arrived_s, published_s, options)}")
    time.sleep(2.0)
    print(f"client has left: {share(node, lambda end_s: time.sleep(end_s - time.time()), options)}")
    if options.browser:
        measure_page(node, f"http://127.0.0.1:{port}/", published_s, options)


def measure_page(
    node: psutil.Process, url: str, published_s: dict, options: argparse.Namespace
) -> None:
    """Measure with a page in chromium and print."""
    from browser import DESKTOP, chromium  # here: only this needs playwright

    with chromium(draws_3d=False) as browser:
        page = browser.new_page(**DESKTOP)
        page.add_init_script(NOTE_DRAWN)
        page.goto(url)
        page.wait_for_function("() => window.drawn.length > 20")
        script = "() => performance.getEntriesByType('paint').map((entry) => entry.startTime)"
        print(f"first paint:     {min(page.evaluate(script)):.0f} ms")
        page.evaluate("() => { window.drawn = []; }")
        before_s = chromium_cpu_s()
        text = share(
            node, lambda end_s: page.wait_for_timeout(1e3 * (end_s - time.time())), options
        )
        cores = (chromium_cpu_s() - before_s) / options.seconds
        drawn_s = {round(stamp_s, 4): at_s for stamp_s, at_s in page.evaluate("() => window.drawn")}
        print(f"one page:        {text}; chromium {cores:.2f} core")
        print(f"poses drawn:     {delays_text(drawn_s, published_s, options)}")


def chromium_cpu_s() -> float:
    """Return the processor time of the browser's processes."""
    return sum(
        sum(child.cpu_times()[:2])
        for child in psutil.Process().children(recursive=True)
        if "chrom" in child.name()
    )


def delays_text(at_s: dict, published_s: dict, options: argparse.Namespace) -> str:
    """Return the rate of poses, and their delays since they were published, by their stamps."""
    delays_ms = [1e3 * (at_s[stamp] - published_s[stamp]) for stamp in at_s if stamp in published_s]
    return (
        f"{len(delays_ms) / options.seconds:.1f} per s, median {np.median(delays_ms):.0f} ms,"
        f" 95th percentile {np.percentile(delays_ms, 95):.0f} ms, most {max(delays_ms):.0f} ms"
    )


def node_process() -> psutil.Process:
    """Return the process of the node web."""
    uri = rosnode.get_api_uri(rosgraph.Master("/bench_web"), "/web")
    return psutil.Process(ServerProxy(uri).getPid("/bench_web")[2])


def share(node: psutil.Process, wait: Callable[[float], None], options: argparse.Namespace) -> str:
    """Return the share of a core that a process takes meanwhile, and its memory."""
    before, start_s = sum(node.cpu_times()[:2]), time.time()
    wait(start_s + options.seconds)
    cores = (sum(node.cpu_times()[:2]) - before) / (time.time() - start_s)
    return f"{cores:.3f} core, {node.memory_info().rss / 1e6:.0f} MB"


def receive(client: Any, end_s: float, arrived_s: dict) -> None:
    """Receive and acknowledge until a time, and note when poses arrive."""
    while time.time() < end_s:
        header, _ = decode(client.recv(timeout=10.0))
        for item in header["items"]:
            if item["key"] == "poses":
                arrived_s[round(item["data"]["stamp_s"], 4)] = time.time()
        client.send(json.dumps({"ack": header["seq"]}))


if __name__ == "__main__":
    main()
