"""Fly for long on ROS and watch memory, commands and lost messages.

    scripts/ros_env python3 bench/soak_ros.py --robots 10 --minutes 30

Starts ``fleet.launch`` with missions that loop. Each row covers a stretch of wall time: the
real-time factor, commands per simulated second and robot, lost messages of odometry and scans by
their sequence numbers, and the memory of each node. Exit status 1 if a node's memory grows by more
than 5 % after the first row, or a message is lost.
"""

from __future__ import annotations

import argparse
import signal
import time
from typing import Any, Dict, List

from fleet import Clock, Commands, free_port, launch_fleet, used

FLAT = 0.05
SAMPLED = 5  # robots whose messages are counted
QUEUE = 1000


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=10)
    parser.add_argument("--hosts", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=30.0, help="wall time")
    parser.add_argument("--stretch", type=float, default=5.0, help="minutes per row")
    parser.add_argument("arguments", nargs="*", help="further arguments of the launch file")
    given = parser.parse_args()
    port = free_port()
    launch = launch_fleet(
        port, given.robots, f"hosts:={given.hosts}", "loop:=true", *given.arguments
    )
    try:
        is_steady = watch(given.robots, 60 * given.minutes, 60 * given.stretch, port)
    finally:
        launch.send_signal(signal.SIGINT)
        launch.wait()
    raise SystemExit(not is_steady)


def watch(robots: int, duration_s: float, stretch_s: float, port: int) -> bool:
    """Print the rows; return True if no node's memory grew and no message was lost."""
    clock = Clock(time.monotonic() + 120.0)
    clock.wait_until(5.0)
    sampled = min(robots, SAMPLED)
    commands, counters = Commands(sampled), count_messages(sampled)
    memories: List[Dict[str, float]] = []
    end_s = time.monotonic() + duration_s
    while time.monotonic() < end_s:
        begin_s, begin_count, wall_s = clock.now_s, commands.count, time.monotonic()
        time.sleep(min(stretch_s, end_s - wall_s))
        flown_s = clock.now_s - begin_s
        memories.append({name: memory_mb for name, (_, memory_mb) in used(port).items()})
        print(
            f"{clock.now_s:7.0f} s: factor {flown_s / (time.monotonic() - wall_s):.2f}, "
            f"{(commands.count - begin_count) / flown_s / sampled:.1f} commands/s, "
            f"{sum(one.lost for one in counters)} of "
            f"{sum(one.received for one in counters)} messages lost, "
            + ", ".join(f"{name} {mb:.1f} MB" for name, mb in sorted(memories[-1].items())),
            flush=True,
        )
    grown = [
        name
        for name, mb in memories[0].items()
        if memories[-1].get(name, 0.0) > (1 + FLAT) * mb or name not in memories[-1]
    ]
    lost = sum(one.lost for one in counters)
    print(f"grown or gone: {', '.join(grown) or 'none'}; messages lost: {lost}")
    return not grown and not lost


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
