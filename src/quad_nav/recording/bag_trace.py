"""The trace of a flight from a recording: of ours or of ``rosbag record``.

Which topic tells what stands in ``docs/recording.md``. Parts of the trace whose topics
are missing are empty. Times are seconds since the flight's start.
"""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, Callable, Dict, List, Optional, Tuple

from quad_nav.errors import InputError
from quad_nav.files.memory_limit import at_most_more
from quad_nav.recording.bag_file import Message, read_messages
from quad_nav.recording.bag_info import (
    LONGEST_S,
    MOST_ROBOTS,
    checked_event,
    checked_flight,
    checked_pose,
    finite,
)
from quad_nav.recording.bag_robot import BagRobot
from quad_nav.recording.messages import pose_from, stamp_ns
from quad_nav.recording.trace import FlightTrace
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import BODY_RADIUS_M, Scene
from quad_nav.sim.scene_file import scene_from_document
from quad_nav.topics.flight_info import (
    CONTACT_STATUS,
    EVENTS_TOPIC,
    FLIGHT_TOPIC,
    contact_from_values,
    from_text,
)

MOST_MEMORY_BYTES = 4 * 10**9
"""For a recording that is read; what is packed in it may be a thousand times larger."""
LONGEST_FLIGHT_S = 30 * 24 * 3600.0
"""Stamps of two clocks in one recording are decades apart."""
_CONTACTS_TOPIC = "/simulation/contacts"
# Topic, type, and what a quadcopter's record takes of it.
_ROBOT_TOPICS: Tuple[Tuple[str, str, Callable[[BagRobot, Message], None]], ...] = (
    (r"/odom([0-9]{1,4})", "nav_msgs/Odometry", BagRobot.move),
    (r"/cmd_vel([0-9]{1,4})", "geometry_msgs/Twist", BagRobot.command),
    (r"/move_base([0-9]{1,4})/[^/]+/plan", "nav_msgs/Path", BagRobot.plan),
    (r"/move_base([0-9]{1,4})/state", "std_msgs/String", BagRobot.state),
    (r"/move_base([0-9]{1,4})/feedback", "move_base_msgs/MoveBaseActionFeedback", BagRobot.cycle),
    (r"/move_base([0-9]{1,4})/recovery_status", "move_base_msgs/RecoveryStatus", BagRobot.recovery),
)


def read_trace(path: Path) -> FlightTrace:
    """The trace of a recorded flight.

    ``cycle_walls_s`` is empty: the wall time of control cycles is not recorded.

    Raises:
        InputError: no recording, a damaged one, or one without odometry.
    """
    try:
        with at_most_more(MOST_MEMORY_BYTES):
            return _read(path)
    except MemoryError as error:
        raise InputError(
            [
                f"{path}: needs more than {MOST_MEMORY_BYTES / 1e9:g} GB of memory, "
                "expected less; `rosbag filter` makes a shorter recording"
            ]
        ) from error


def _read(path: Path) -> FlightTrace:
    reading = _Reading()
    for message in read_messages(path, _is_wanted):
        try:
            reading.take(message)
        except ValueError as error:
            raise InputError(
                [
                    f"{path}: {message.topic}: cannot be understood: "
                    f"{error}; expected what docs/recording.md says"
                ]
            ) from error
    return reading.trace(path)


def _is_wanted(topic: str, kind: str) -> bool:
    return (topic, kind) in _COMMON_TOPICS or _robot_topic(topic, kind) is not None


def _robot_topic(
    topic: str, kind: str
) -> Optional[Tuple[int, Callable[[BagRobot, Message], None]]]:
    for pattern, expected, take in _ROBOT_TOPICS:
        match = re.fullmatch(pattern, topic)
        if match and kind == expected:
            return int(match.group(1)), take
    return None


class _Reading:
    """What the messages so far have told."""

    def __init__(self) -> None:
        self.robots: Dict[int, BagRobot] = {}
        self.info: Dict[str, Any] = {}
        self.contacts: List[Contact] = []
        self._clock_ns: Optional[int] = None

    def take(self, message: Message) -> None:
        """What has no stamp of its own came at the time that ``/clock`` said before.

        A recorder that was started before the simulation notes the wall time.
        """
        if self._clock_ns is not None:
            message = message._replace(stamp_ns=self._clock_ns)
        common = _COMMON_TOPICS.get((message.topic, message.kind))
        if common is not None:
            common(self, message)
            return
        found = _robot_topic(message.topic, message.kind)
        assert found is not None
        robot, take = found
        take(self._robot(robot), message)

    def _robot(self, robot: int) -> BagRobot:
        if robot >= MOST_ROBOTS:
            raise ValueError(f"quadcopter {robot}, expected 0 to {MOST_ROBOTS - 1}")
        return self.robots.setdefault(robot, BagRobot())

    def take_flight(self, message: Message) -> None:
        self.info.update(checked_flight(from_text(message.content.data) or {}))

    def take_clock(self, message: Message) -> None:
        self._clock_ns = stamp_ns(message.content.clock)

    def take_event(self, message: Message) -> None:
        event = from_text(message.content.data)
        if event is not None:
            event = checked_event(event)
            self._robot(event["robot"]).event(event)

    def take_contact(self, message: Message) -> None:
        status = message.content
        if status.name == CONTACT_STATUS:
            contact = contact_from_values(
                status.hardware_id, {pair.key: pair.value for pair in status.values}
            )
            finite((contact.x_m, contact.y_m))
            finite((contact.time_s,), LONGEST_S)
            self.contacts.append(contact)

    def take_transforms(self, message: Message) -> None:
        for transform in message.content.transforms:
            match = re.fullmatch(r"/?odom([0-9]{1,4})", transform.child_frame_id)
            if match and transform.header.frame_id.lstrip("/") == "map":
                self._robot(int(match.group(1))).map_from_odom = checked_pose(
                    pose_from(transform.transform.translation, transform.transform.rotation)
                )

    def trace(self, path: Path) -> FlightTrace:
        flown = {number: robot for number, robot in sorted(self.robots.items()) if robot.has_moved}
        if not flown:
            raise InputError(
                [
                    f"{path}: has no odometry; expected messages nav_msgs/Odometry on "
                    "/odom0 and so on"
                ]
            )
        for number, robot in flown.items():
            if robot.last_s - robot.first_s > LONGEST_FLIGHT_S:
                raise InputError(
                    [
                        f"{path}: /odom{number}: {robot.last_s - robot.first_s:g} s from "
                        f"first to last, expected {LONGEST_FLIGHT_S:g} s at most"
                    ]
                )
        start_s = self.info.get("start_s")
        if start_s is None:
            start_s = min(robot.first_s for robot in flown.values())
        told = self.info.get("robots", [])
        robots = tuple(
            robot.trace(number, start_s, told[number] if number < len(told) else {})
            for number, robot in flown.items()
        )
        contacts = tuple(
            Contact(c.time_s - start_s, c.robot, c.other, c.x_m, c.y_m) for c in self.contacts
        )
        return FlightTrace(
            self.info.get("title", path.stem),
            robots,
            contacts,
            self._scene(path),
            self.info.get("robot_radius_m", BODY_RADIUS_M),
            self.info.get("seed"),
            self.info.get("config", ""),
            self.info.get("versions", {}),
            self.info.get("reason", ""),
        )

    def _scene(self, path: Path) -> Optional[Scene]:
        document = self.info.get("scene")
        if document is None:
            return None
        if isinstance(document, dict) and {"world", "map"} & set(document):
            raise InputError(
                [
                    f"{path}: {FLIGHT_TOPIC}: scene: names another file, expected all "
                    "of it in the recording"
                ]
            )
        return scene_from_document(document, f"{path}: {FLIGHT_TOPIC}: scene")


_COMMON_TOPICS: Dict[Tuple[str, str], Callable[[_Reading, Message], None]] = {
    (FLIGHT_TOPIC, "std_msgs/String"): _Reading.take_flight,
    ("/clock", "rosgraph_msgs/Clock"): _Reading.take_clock,
    (EVENTS_TOPIC, "std_msgs/String"): _Reading.take_event,
    (_CONTACTS_TOPIC, "diagnostic_msgs/DiagnosticStatus"): _Reading.take_contact,
    ("/tf", "tf2_msgs/TFMessage"): _Reading.take_transforms,
    ("/tf_static", "tf2_msgs/TFMessage"): _Reading.take_transforms,
}
