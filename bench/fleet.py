"""Measure a fleet on ROS: CPU time and memory of each node, for several sizes.

    scripts/ros_env python3 bench/fleet.py --robots 2 8 20

Starts ``fleet.launch`` for each size, waits until all robots fly, and measures for some simulated
time. CPU is in seconds per simulated second: 1.0 keeps one core busy at real time. If commands per
simulated second and robot are fewer than the navigators' control rate, the fleet lags behind the
simulation. The load average counts other users' processes, too.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import socket
import subprocess
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

TICKS_PER_S = os.sysconf("SC_CLK_TCK")
SETTLE_S, TIMEOUT_S = 5.0, 120.0
SAMPLED = 5  # robots whose commands are counted


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, nargs="+", default=[2, 4, 8, 16, 20, 32, 50])
    parser.add_argument("--hosts", type=int, help="default of fleet.launch if not given")
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time for each size")
    parser.add_argument("arguments", nargs="*", help="further arguments of the launch file")
    given = parser.parse_args()
    for robots in given.robots:
        context = multiprocessing.get_context("spawn")
        one = context.Process(
            target=measure, args=(robots, given.hosts, given.seconds, given.arguments)
        )
        one.start()
        one.join()


def measure(robots: int, hosts: Optional[int], seconds: float, arguments: List[str]) -> None:
    """Measure one size and print its line."""
    port = free_port()
    launch = launch_fleet(port, robots, *([f"hosts:={hosts}"] if hosts else []), *arguments)
    try:
        clock = Clock(time.monotonic() + TIMEOUT_S)
        clock.wait_until(1.0 + SETTLE_S)
        before, wall_s, begin_s = used(port), time.monotonic(), clock.now_s
        commands = Commands(min(robots, SAMPLED))
        clock.wait_until(begin_s + seconds)
        flown_s = clock.now_s - begin_s
        rate_hz = commands.count / flown_s / min(robots, SAMPLED)
        factor = flown_s / (time.monotonic() - wall_s)
        after = used(port)
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait()
    cpu = {name: (after[name][0] - before[name][0]) / flown_s for name in sorted(before)}
    total = sum(cpu.values())
    hosts = sum(name.startswith("fleet") for name in cpu)
    print(
        f"{robots:4d} robots, {hosts} hosts: real-time factor {factor:.2f}, "
        f"{rate_hz:.1f} commands/s, CPU {total:.2f} "
        f"({1000 * total / robots:.0f} ms/robot): "
        + ", ".join(f"{name} {value:.2f} ({after[name][1]:.0f} MB)" for name, value in cpu.items())
        + f"; load {os.getloadavg()[0]:.1f}",
        flush=True,
    )


def launch_fleet(port: int, robots: int, *arguments: str) -> subprocess.Popen[bytes]:
    """Start ``fleet.launch`` under a roscore on this port."""
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    return subprocess.Popen(
        [
            "roslaunch",
            "-p",
            str(port),
            "quad",
            "fleet.launch",
            f"robots:={robots}",
            "rviz:=false",
            *arguments,
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


class Clock:
    """The simulation's clock."""

    def __init__(self, give_up_s: float) -> None:
        import rospy
        from rosgraph_msgs.msg import Clock as ClockMessage

        self.now_s, self._give_up_s = 0.0, give_up_s
        self._wait(lambda: is_listening(int(os.environ["ROS_MASTER_URI"].rsplit(":", 1)[1])))
        rospy.init_node("bench", disable_signals=True, disable_rosout=True)
        rospy.Subscriber("/clock", ClockMessage, self._store, queue_size=1)

    def wait_until(self, now_s: float) -> None:
        """Wait until this simulated time; exit if it does not come."""
        self._give_up_s = time.monotonic() + TIMEOUT_S
        self._wait(lambda: self.now_s >= now_s)

    def _wait(self, condition: Callable[[], bool]) -> None:
        while not condition():
            if time.monotonic() > self._give_up_s:
                raise SystemExit("the fleet did not fly in time")
            time.sleep(0.02)

    def _store(self, message: Any) -> None:
        self.now_s = message.clock.to_sec()


class Commands:
    """Counts the commands for the first few robots."""

    def __init__(self, robots: int) -> None:
        import rospy

        self.count = 0
        for number in range(robots):
            rospy.Subscriber(f"/cmd_vel{number}", rospy.AnyMsg, self._add)

    def _add(self, _: Any) -> None:
        self.count += 1


def used(port: int) -> Dict[str, Tuple[float, float]]:
    """Return (CPU in s, memory in MB) of every node whose master listens on a port."""
    found = {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().decode().split("\0")
            names = [word[len("__name:=") :] for word in words if word.startswith("__name:=")]
            environment = (folder / "environ").read_bytes().decode()
            if names and f"ROS_MASTER_URI=http://localhost:{port}" in environment:
                fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
                memory_mb = int((folder / "statm").read_text().split()[1]) * 4096 / 1e6
                found[names[0]] = ((int(fields[11]) + int(fields[12])) / TICKS_PER_S, memory_mb)
        except (OSError, UnicodeDecodeError):  # it has just ended
            continue
    return found


def is_listening(port: int) -> bool:
    with socket.socket() as probe:
        return probe.connect_ex(("localhost", port)) == 0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


if __name__ == "__main__":
    main()
