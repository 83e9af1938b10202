"""Launch files under a roscore of their own, and a node that watches the flight."""

from __future__ import annotations

import math
import os
import signal
import socket
import subprocess
import time
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Sequence, Set, Tuple
from xmlrpc.client import ServerProxy

from link import HERE_IP

from quad_nav.mission.actions import Event
from quad_nav.topics.mission_events import MissionEvent, mission_event_from_message

ENDED = (Event.REACHED, Event.SKIPPED)
TIMEOUT_S = 150.0  # wall time


class Watch:
    """A node that records the robots' speeds and the sequencer's events."""

    def __init__(self, odometry: Sequence[str] = ("/odom0", "/odom1")) -> None:
        """Subscribe to the odometry of robots 0 and 1 and to the events."""
        import rospy
        from nav_msgs.msg import Odometry
        from quad.msg import MissionEvent as MissionEventMessage

        rospy.init_node("faults", anonymous=True, disable_signals=True)
        self.events: List[MissionEvent] = []
        self.now_s = 0.0
        self._places_m: Dict[int, Tuple[float, float]] = {}
        self.speeds_mps: List[Tuple[float, int, float]] = []  # time, robot, speed
        events = rospy.Subscriber("/quad/events", MissionEventMessage, self._on_event)
        self._subscribers = [events] + [
            rospy.Subscriber(topic, Odometry, self._on_odometry, robot)
            for robot, topic in enumerate(odometry)
        ]

    def _on_event(self, message: Any) -> None:
        stamp_s = message.header.stamp.to_sec()
        self.events.append(mission_event_from_message(message, stamp_s))

    def _on_odometry(self, message: Any, robot: int) -> None:
        v = message.twist.twist.linear
        self.now_s = message.header.stamp.to_sec()
        self.speeds_mps.append((self.now_s, robot, math.hypot(v.x, v.y)))
        p = message.pose.pose.position
        self._places_m[robot] = p.x, p.y

    @property
    def done(self) -> Set[int]:
        """Robots without further goals."""
        return {event.robot for event in self.events if event.event is Event.DONE}

    @property
    def ended(self) -> int:
        """Number of goals that have ended."""
        return sum(event.event in ENDED for event in self.events)

    def remaining_m(self, robot: int) -> float:
        """Distance of a robot to the goal that was sent last; inf before the first one."""
        sent = [e for e in self.events if e.event is Event.SENT and e.robot == robot]
        if not sent or robot not in self._places_m:
            return math.inf
        x, y = self._places_m[robot]
        return math.hypot(sent[-1].pose.x_m - x, sent[-1].pose.y_m - y)

    def first(self, robot: int, after_s: float, holds: Callable[[float], bool]) -> float:
        """First time after ``after_s`` at which ``holds`` accepts the speed; inf for never."""
        return next(
            (
                t
                for t, who, v in list(self.speeds_mps)
                if who == robot and t >= after_s and holds(v)
            ),
            math.inf,
        )


class Launch:
    """A roslaunch with its own roscore, or with the one that listens on ``port``."""

    def __init__(
        self,
        arguments: List[str],
        folder: Path,
        port: Optional[int] = None,
        prefix: Tuple[str, ...] = (),
        ip: str = "localhost",
    ) -> None:
        self.folder, self.port = folder, port or free_port()
        core = ["-p", str(self.port)] if port is None else []
        master = f"http://{'localhost' if ip == 'localhost' else HERE_IP}:{self.port}"
        self.log = (folder / f"launch-{time.monotonic():.3f}.log").open("w")
        self.process = subprocess.Popen(
            [*prefix, "roslaunch", *core, "quad", *arguments],
            stdout=self.log,
            stderr=subprocess.STDOUT,
            start_new_session=True,
            env={
                **os.environ,
                "ROS_MASTER_URI": master,
                "ROS_HOSTNAME": ip,
                "ROS_HOME": str(folder),
            },
        )
        os.environ.update(
            ROS_MASTER_URI=master, ROS_HOSTNAME=("localhost" if ip == "localhost" else HERE_IP)
        )

    def pid_of(self, node: str) -> int:
        """Process id of a node, or of the rosmaster for ""."""
        if not node:
            children = subprocess.run(
                ["ps", "-o", "pid=,args=", "--ppid", str(self.process.pid)],
                stdout=subprocess.PIPE,
                text=True,
                check=True,
            ).stdout
            return next(
                int(line.split()[0]) for line in children.splitlines() if "rosmaster" in line
            )
        uri = ServerProxy(os.environ["ROS_MASTER_URI"]).lookupNode("/faults", node)[2]
        return ServerProxy(uri).getPid("/faults")[2]

    def end(self, timeout_s: float = TIMEOUT_S) -> bool:
        """Wait for the end; interrupt the launch after the timeout. True if it ended by itself."""
        try:
            self.process.wait(timeout_s)
            return True
        except subprocess.TimeoutExpired:
            os.killpg(self.process.pid, signal.SIGINT)
            self.process.wait(60)
            return False
        finally:
            self.log.close()


def wait_for(holds: Callable[[], bool], what: str) -> None:
    end = time.monotonic() + TIMEOUT_S
    while not holds():
        if time.monotonic() > end:
            raise TimeoutError(what)
        time.sleep(0.02)


def answers(port: int) -> bool:
    host = HERE_IP if os.environ["ROS_HOSTNAME"] == HERE_IP else "localhost"
    with socket.socket() as probe:
        return probe.connect_ex((host, port)) == 0


def free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("localhost", 0))
        return probe.getsockname()[1]
