"""Measure a fleet on ROS: CPU time and memory of each node, for several sizes.

    scripts/ros_env python3 bench/fleet.py --robots 2 8 20

Starts ``fleet.launch`` for each size, waits until all robots fly, and measures for some simulated
time. CPU is in seconds per simulated second: 1.0 keeps one core busy at real time. If commands per
simulated second and robot are fewer than the navigators' control rate, the fleet lags behind the
simulation. The load average counts other users' processes, too. ``--json`` adds the figures of four
equal parts of the time to a file.
"""

from __future__ import annotations

import argparse
import multiprocessing
import os
import signal
import socket
import subprocess
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Tuple

from figures import JSON_HELP, LARGER, Figures

TICKS_PER_S = os.sysconf("SC_CLK_TCK")
SETTLE_S, TIMEOUT_S = 5.0, 120.0
SAMPLED = 5  # robots whose commands are counted
PARTS = 4  # of the measured time


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, nargs="+", default=[2, 4, 8, 16, 20, 32, 50])
    parser.add_argument("--seconds", type=float, default=20.0, help="simulated time for each size")
    parser.add_argument("--json", type=Path, help=JSON_HELP)
    parser.add_argument("arguments", nargs="*", help="further arguments of the launch file")
    given = parser.parse_args()
    for robots in given.robots:
        arguments = f"robots:={robots}", *given.arguments
        seen = snapshots(robots, given.seconds, "fleet.launch", *arguments)
        show(robots, seen[0], seen[-1])
        write(robots, seen, given.json)


class Snapshot(NamedTuple):
    """Resources that a fleet has used, and its commands, until a moment."""

    now_s: float  # simulated time
    wall_s: float
    commands: int
    nodes: Dict[str, Tuple[float, float]]  # CPU in s, memory in MB


def snapshots(robots: int, seconds: float, *arguments: str) -> List[Snapshot]:
    """Start a launch file of ours; return what its nodes have used at the ends of equal parts."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        return pool.submit(observe, robots, seconds, *arguments).result()


def observe(robots: int, seconds: float, *arguments: str) -> List[Snapshot]:
    """Take the snapshots; in a process of its own, because a process can be a node once."""
    port = free_port()
    launch = start(port, *arguments)
    try:
        clock = Clock(time.monotonic() + TIMEOUT_S)
        clock.wait_until(1.0 + SETTLE_S)
        commands = Commands(min(robots, SAMPLED))
        begin_s, seen = clock.now_s, []
        for part in range(PARTS + 1):
            clock.wait_until(begin_s + seconds * part / PARTS)
            seen.append(Snapshot(clock.now_s, time.monotonic(), commands.count, used(port)))
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait()
    return seen


def cpu_of(before: Snapshot, after: Snapshot) -> Dict[str, float]:
    """Return the CPU time of each node in seconds per simulated second."""
    flown_s = after.now_s - before.now_s
    return {
        name: (after.nodes[name][0] - before.nodes[name][0]) / flown_s
        for name in sorted(before.nodes)
        if name in after.nodes
    }


def rate_hz(robots: int, before: Snapshot, after: Snapshot) -> float:
    """Return the commands per simulated second of a robot."""
    flown_s = after.now_s - before.now_s
    return (after.commands - before.commands) / flown_s / min(robots, SAMPLED)


def factor(before: Snapshot, after: Snapshot) -> float:
    return (after.now_s - before.now_s) / (after.wall_s - before.wall_s)


def show(robots: int, before: Snapshot, after: Snapshot) -> None:
    """Print a size's line."""
    cpu = cpu_of(before, after)
    total = sum(cpu.values())
    hosts = sum(name.startswith(("fleet", "simulator worker")) for name in cpu)
    print(
        f"{robots:4d} robots, {hosts} hosts beside the simulator: "
        f"real-time factor {factor(before, after):.2f}, "
        f"{rate_hz(robots, before, after):.1f} commands/s, CPU {total:.2f} "
        f"({1000 * total / robots:.0f} ms/robot): "
        + ", ".join(
            f"{name} {value:.2f} ({after.nodes[name][1]:.0f} MB)" for name, value in cpu.items()
        )
        + f"; load {os.getloadavg()[0]:.1f}",
        flush=True,
    )


def write(robots: int, seen: List[Snapshot], file: Optional[Path]) -> None:
    """Add the figures of a size, one value for each part of the time."""
    figures, parts = Figures(f"fleet {robots}"), list(zip(seen, seen[1:]))
    cost_ms = [1000 * sum(cpu_of(*part).values()) / robots for part in parts]
    figures.add("CPU per robot and second", "ms", cost_ms)
    figures.add("real-time factor", "", [factor(*part) for part in parts], LARGER)
    figures.add("commands", "1/s", [rate_hz(robots, *part) for part in parts], LARGER)
    memory_mb = sum(one_mb for _, one_mb in seen[-1].nodes.values())
    figures.add("memory of all nodes", "MB", [memory_mb])
    figures.write(file)


def start(port: int, *arguments: str) -> subprocess.Popen[bytes]:
    """Start a launch file of ours under a roscore on this port."""
    os.environ["ROS_MASTER_URI"] = f"http://localhost:{port}"
    return subprocess.Popen(
        ["roslaunch", "-p", str(port), "quad", *arguments, "rviz:=false"],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
        start_new_session=True,
    )


class Clock:
    """The simulation's clock."""

    def __init__(self, give_up_s: float) -> None:
        import rosgraph
        import rospy
        from rosgraph_msgs.msg import Clock as ClockMessage

        self.now_s, self._give_up_s = 0.0, give_up_s
        self._wait(rosgraph.is_master_online)
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
    """Return (CPU in s, memory in MB) of every node whose master listens on a port.

    Worker processes of a node have its name with a number; the fork server is left out.
    """
    names: Dict[int, str] = {}
    figures, parents = {}, {}
    for folder in Path("/proc").glob("[0-9]*"):
        try:
            words = (folder / "cmdline").read_bytes().decode().split("\0")
            environment = (folder / "environ").read_bytes().decode()
            if f"ROS_MASTER_URI=http://localhost:{port}" not in environment:
                continue
            fields = (folder / "stat").read_text().rsplit(")", 1)[1].split()
            memory_mb = int((folder / "statm").read_text().split()[1]) * 4096 / 1e6
        except (OSError, UnicodeDecodeError):  # it has just ended
            continue
        pid = int(folder.name)
        parents[pid] = int(fields[1])
        figures[pid] = ((int(fields[11]) + int(fields[12])) / TICKS_PER_S, memory_mb)
        names.update((pid, word[8:]) for word in words if word.startswith("__name:="))
    found = {name: figures[pid] for pid, name in names.items()}
    workers = [pid for pid, parent in sorted(parents.items()) if parents.get(parent) in names]
    for number, pid in enumerate((pid for pid in workers if pid not in names), 1):
        found[f"{names[parents[parents[pid]]]} worker {number}"] = figures[pid]
    return found


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]


if __name__ == "__main__":
    main()
