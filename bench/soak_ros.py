r"""Fly for long on ROS and watch commands, contacts, memory and lost messages.

    scripts/ros_env python3 bench/soak_ros.py --robots 10 --minutes 30
    scripts/ros_env python3 bench/soak_ros.py --robots 50 --minutes 10 --stretch 1 --commands 10 \
        --rviz 1

Starts ``fleet.launch`` with missions that loop. Each row covers a stretch of wall time: the
real-time factor, the fewest and the most commands per wall second of a robot, the longest simulated
time without one, contacts, lost messages of odometry and scans by their sequence numbers, and the
memory of each node. ``--rviz`` attaches RViz after the first two stretches, on a virtual display if
there is none.

Exit status 1 if a node's memory grows by more than 5 % after the first row, a message is lost,
robots touch, or, with ``--commands``, a robot gets another number of commands in a stretch.
"""

from __future__ import annotations

import argparse
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Dict, List, Optional

from figures import JSON_HELP, LARGER, Figures
from fleet import Clock, free_port, launch_fleet, used

ROOT = Path(__file__).resolve().parents[1]
QUIET_RVIZ = ROOT / "rviz" / "quiet_rviz.sh"
FLAT = 0.05
QUEUE = 1000
RVIZ_AFTER = 2  # stretches


@dataclass
class Stretch:
    """Results of a stretch.

    Attributes:
        factor: Simulated seconds per second.
        rates_hz: Commands per wall second of each robot.
        gap_s: Longest simulated time between two commands of a robot.
        memory_mb: Memory by node.
    """

    factor: float
    rates_hz: List[float]
    gap_s: float
    memory_mb: Dict[str, float] = field(default_factory=dict)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__.splitlines()[0], epilog="The module's docstring says more."
    )
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--hosts", type=int, help="default of fleet.launch if not given")
    parser.add_argument("--minutes", type=float, default=30.0, help="wall time")
    parser.add_argument("--stretch", type=float, default=5.0, help="minutes per row")
    parser.add_argument("--messages", type=int, default=5, help="robots whose messages are counted")
    parser.add_argument("--commands", type=float, help="commands per second that each robot needs")
    parser.add_argument("--within", type=float, default=0.1, help="tolerance of --commands")
    parser.add_argument("--rviz", type=float, default=0.0, help="minutes with RViz")
    parser.add_argument("--json", type=Path, help=JSON_HELP)
    parser.add_argument("arguments", nargs="*", help="further arguments of the launch file")
    given = parser.parse_args()
    if given.rviz and shutil.which("rviz") is None:
        parser.error("--rviz: rviz is not installed")
    port = free_port()
    hosts = [f"hosts:={given.hosts}"] if given.hosts else []
    launch = launch_fleet(port, given.robots, *hosts, "loop:=true", *given.arguments)
    try:
        problems = watch(given, port)
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait()
    print("; ".join(problems) or "memory flat, no message lost, no contact, commands in time")
    sys.stdout.flush()
    os._exit(bool(problems))  # rospy's threads wait for the dead master


def watch(given: argparse.Namespace, port: int) -> List[str]:
    """Print the rows; return what is wrong."""
    clock = Clock(time.monotonic() + 120.0)
    clock.wait_until(5.0)
    commands = [Commands(robot, clock) for robot in range(given.robots)]
    contacts, counters = Contacts(), count_messages(min(given.robots, given.messages))
    stretches: List[Stretch] = []
    begin_s, rviz = time.monotonic(), Rviz(given.robots)
    while time.monotonic() - begin_s < 60 * given.minutes:
        left_s = 60 * given.minutes - (time.monotonic() - begin_s)
        if len(stretches) == RVIZ_AFTER and given.rviz:
            rviz.start()
        has_rviz = rviz.is_running
        one = stretch(min(60 * given.stretch, left_s), clock, commands)
        if len(stretches) + 1 >= RVIZ_AFTER + given.rviz / given.stretch:
            rviz.stop()
        one.memory_mb = {name: memory_mb for name, (_, memory_mb) in used(port).items()}
        stretches.append(one)
        print(row(clock.now_s, one, contacts, counters, has_rviz), flush=True)
    rviz.stop()
    write(given, stretches)
    lost = sum(counter.lost for counter in counters)
    return [
        *grown(stretches),
        *([f"{lost} messages lost"] if lost else []),
        *([f"{len(contacts.seen)} contacts: {', '.join(contacts.seen)}"] if contacts.seen else []),
        *rviz.problems,
        *(late(stretches, given.commands, given.within) if given.commands else []),
    ]


def stretch(duration_s: float, clock: Clock, commands: List[Commands]) -> Stretch:
    """Count for some wall time."""
    for one in commands:
        one.begin()
    begin_s, wall_s = clock.now_s, time.monotonic()
    time.sleep(duration_s)
    counts, real_s = [one.count for one in commands], time.monotonic() - wall_s
    return Stretch(
        (clock.now_s - begin_s) / real_s,
        [count / real_s for count in counts],
        max(one.gap_s() for one in commands),
    )


def row(
    now_s: float,
    one: Stretch,
    contacts: Contacts,
    counters: List[SequenceCounter],
    has_rviz: bool,
) -> str:
    return (
        f"{now_s:7.0f} s: factor {one.factor:.3f}, "
        f"{min(one.rates_hz):.2f} to {max(one.rates_hz):.2f} commands/s, "
        f"longest gap {one.gap_s:.2f} s, {len(contacts.seen)} contacts, "
        f"{sum(counter.lost for counter in counters)} of "
        f"{sum(counter.received for counter in counters)} messages lost, "
        f"{'RViz, ' if has_rviz else ''}load {os.getloadavg()[0]:.1f}, "
        + ", ".join(f"{name} {mb:.1f} MB" for name, mb in sorted(one.memory_mb.items()))
    )


def grown(stretches: List[Stretch]) -> List[str]:
    """Return the nodes whose memory has grown since the first stretch, and those that are gone."""
    last_mb = stretches[-1].memory_mb
    return [
        f"{name} has grown from {mb:.0f} MB to {last_mb[name]:.0f} MB"
        if name in last_mb
        else f"{name} is gone"
        for name, mb in stretches[0].memory_mb.items()
        if name not in last_mb or last_mb[name] > (1 + FLAT) * mb
    ]


def late(stretches: List[Stretch], wanted_hz: float, within_hz: float) -> List[str]:
    """Return the robots whose rate of commands is not ``wanted_hz`` in some stretch."""
    return [
        f"quad{robot} got {rate_hz:.2f} commands/s in stretch {number}"
        for number, one in enumerate(stretches, 1)
        for robot, rate_hz in enumerate(one.rates_hz)
        if abs(rate_hz - wanted_hz) > within_hz
    ]


def write(given: argparse.Namespace, stretches: List[Stretch]) -> None:
    """Add the figures to the file, a repetition for each stretch."""
    figures = Figures(f"soak_ros {given.robots}")
    figures.add("real-time factor", "", [one.factor for one in stretches], LARGER)
    figures.add(
        "fewest commands of a robot", "1/s", [min(one.rates_hz) for one in stretches], LARGER
    )
    figures.add("longest time without a command", "s", [one.gap_s for one in stretches])
    memory_mb = [sum(one.memory_mb.values()) for one in stretches]
    figures.add("memory of all nodes", "MB", memory_mb)
    figures.write(given.json)


class Commands:
    """Counts the commands for one robot, and the simulated time between them."""

    def __init__(self, robot: int, clock: Clock) -> None:
        import rospy

        self.count = 0
        self._clock, self._longest_s, self._last_s = clock, 0.0, clock.now_s
        rospy.Subscriber(f"/cmd_vel{robot}", rospy.AnyMsg, self._add)

    def begin(self) -> None:
        """Begin a stretch."""
        self.count, self._longest_s, self._last_s = 0, 0.0, self._clock.now_s

    def gap_s(self) -> float:
        """Longest simulated time without a command, until now."""
        return max(self._longest_s, self._clock.now_s - self._last_s)

    def _add(self, _: Any) -> None:
        now_s = self._clock.now_s
        self._longest_s, self._last_s = max(self._longest_s, now_s - self._last_s), now_s
        self.count += 1


class Contacts:
    """The contacts that the simulator reports."""

    def __init__(self) -> None:
        import rospy
        from quad.msg import Contact

        self.seen: List[str] = []
        rospy.Subscriber("/simulation/contacts", Contact, self._add, queue_size=QUEUE)

    def _add(self, message: Any) -> None:
        time_s = message.header.stamp.to_sec()
        self.seen.append(f"{message.robot} with {message.other} at {time_s:.2f} s")


class Rviz:
    """RViz as ``fleet.launch`` shows it, with its priority, for a part of the flight."""

    def __init__(self, robots: int) -> None:
        self._robots = robots
        self._process: Optional[subprocess.Popen[bytes]] = None
        self.problems: List[str] = []

    @property
    def is_running(self) -> bool:
        """True while RViz shows the fleet."""
        return self._process is not None

    def start(self) -> None:
        """Start it, on a virtual display if there is none."""
        virtual = [] if os.environ.get("DISPLAY") else ["xvfb-run", "-a"]
        node = [sys.executable, str(ROOT / "nodes" / "fleet_rviz"), "--robots", str(self._robots)]
        self._process = subprocess.Popen(
            ["bash", str(QUIET_RVIZ), *virtual, *node, "__name:=rviz_fleet"],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            start_new_session=True,
        )

    def stop(self) -> None:
        """Stop it; it must have run until now."""
        if self._process is None:
            return
        if self._process.poll() is not None:
            self.problems.append(f"RViz ended with status {self._process.returncode}")
        else:
            os.killpg(self._process.pid, signal.SIGTERM)
            self._process.wait()
        self._process = None


class SequenceCounter:
    """Counts the gaps in a topic's sequence numbers."""

    def __init__(self, topic: str, message_type: type) -> None:
        import rospy

        self.received = self.lost = 0
        self._last = -1
        rospy.Subscriber(topic, message_type, self._count, queue_size=QUEUE)

    def _count(self, message: Any) -> None:
        if self._last >= 0:
            self.lost += message.header.seq - self._last - 1
        self._last = message.header.seq
        self.received += 1


def count_messages(robots: int) -> List[SequenceCounter]:
    from nav_msgs.msg import Odometry
    from sensor_msgs.msg import LaserScan

    return [
        SequenceCounter(f"/{name}{number}", message_type)
        for number in range(robots)
        for name, message_type in (("odom", Odometry), ("scan", LaserScan))
    ]


if __name__ == "__main__":
    main()
