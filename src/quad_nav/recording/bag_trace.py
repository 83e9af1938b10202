"""Build the trace of a flight from a recording of ``quad fly`` or ``rosbag record``.

``docs/recording.md`` lists the topics. Parts of the trace whose topics are missing are empty.
Times are seconds since the flight's start.
"""

from __future__ import annotations

import functools
import re
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path
from typing import Callable, Dict, Iterator, List, Optional, Tuple

import numpy as np

from quad_nav.errors import InputError
from quad_nav.files.user_files import limit_memory
from quad_nav.recording.bag_file import (
    FlightClock,
    Message,
    Progress,
    no_progress,
    read_messages,
)
from quad_nav.recording.bag_robot import BagRobot
from quad_nav.recording.messages import pose_from, stamp_ns
from quad_nav.recording.trace import FlightTrace
from quad_nav.sim.contacts import Contact
from quad_nav.sim.crowd_record import CrowdRecord
from quad_nav.sim.scene import BODY_RADIUS_M, Scene
from quad_nav.topics.contacts import CONTACTS_TOPIC, contact_from_message
from quad_nav.topics.estimates import ESTIMATE_KIND, TRUTH_KIND, TRUTH_TOPIC
from quad_nav.topics.flight_info import (
    FLIGHT_TOPIC,
    MAX_ROBOTS,
    FlightInfo,
    RobotInfo,
    flight_info_from_message,
)
from quad_nav.topics.mission_events import EVENTS_TOPIC, mission_event_from_message
from quad_nav.topics.obstacle_poses import (
    OBSTACLES_PERIOD_S,
    POSES_KIND,
    POSES_TOPIC,
    people_positions,
)
from quad_nav.topics.robot_topics import ROBOT_TOPICS

MAX_MEMORY_BYTES = 4 * 10**9
"""Limit for reading a recording: unpacked, it may be a thousand times larger."""
LONGEST_FLIGHT_S = 30 * 24 * 3600.0
"""Longer flights are refused: two clocks in one recording differ by decades."""
_LAST_PLACES_S = 1.5 * OBSTACLES_PERIOD_S  # at most, on a loaded machine
_NODE = r"/move_base([0-9]{1,4})"
# Topic, type, and what adds its messages.
_ROBOT_TOPICS: Tuple[Tuple[str, str, Callable[[BagRobot, Message], None]], ...] = (
    (r"/odom([0-9]{1,4})", "nav_msgs/Odometry", BagRobot.add_odometry),
    (r"/(?:amcl|slam)_pose([0-9]{1,4})", ESTIMATE_KIND, BagRobot.add_estimate),
    (r"/cmd_vel([0-9]{1,4})", "geometry_msgs/Twist", BagRobot.add_command),
    (f"{_NODE}/[^/]+/plan", "nav_msgs/Path", BagRobot.add_plan),
    (f"{_NODE}/feedback", "move_base_msgs/MoveBaseActionFeedback", BagRobot.add_cycle),
    (f"{_NODE}/recovery_status", "move_base_msgs/RecoveryStatus", BagRobot.add_recovery),
    *(
        (f"{_NODE}/{topic.name}", topic.kind, functools.partial(BagRobot.add_said, topic=topic))
        for topic in ROBOT_TOPICS
    ),
)


def read_trace(path: Path) -> FlightTrace:
    """Read the trace of a recorded flight.

    ``cycle_walls_s`` is empty: recordings do not hold the wall time of control cycles.

    Raises:
        InputError: The file is not a recording, is damaged or has no odometry.
    """
    return read_recording(path).trace(path)


def read_recording(path: Path, progress: Progress = no_progress) -> TraceReader:
    """Read what a trace is made of; ``progress`` is told often which share is read.

    Raises:
        InputError: The file is not a recording, or is damaged.
    """
    with _limited_memory(path):
        return _read(path, progress)


@contextmanager
def _limited_memory(path: Path) -> Iterator[None]:
    try:
        with limit_memory(MAX_MEMORY_BYTES):
            yield
    except MemoryError as error:
        raise InputError(
            [
                f"{path}: reading needs more than {MAX_MEMORY_BYTES / 1e9:g} GB of memory, "
                "expected less; shorten the recording with `rosbag filter`"
            ]
        ) from error


def _read(path: Path, progress: Progress) -> TraceReader:
    def is_wanted(topic: str, kind: str) -> bool:
        if topic in (FLIGHT_TOPIC, EVENTS_TOPIC) and kind == "std_msgs/String":
            raise InputError(
                [f"{path}: {topic}: is {kind}, as quad 0.2.0 records it; read it with that version"]
            )
        return _is_wanted(topic, kind)

    reader = TraceReader()
    for message in read_messages(path, is_wanted, progress):
        try:
            reader.add(message)
        except ValueError as error:
            raise InputError(
                [
                    f"{path}: {message.topic}: invalid message: {error}; expected the format "
                    "of docs/recording.md"
                ]
            ) from error
    return reader


def _is_wanted(topic: str, kind: str) -> bool:
    return (topic, kind) in _COMMON_TOPICS or _robot_topic(topic, kind) is not None


@functools.lru_cache(maxsize=10_000)
def _robot_topic(
    topic: str, kind: str
) -> Optional[Tuple[int, Callable[[BagRobot, Message], None]]]:
    for pattern, expected, add in _ROBOT_TOPICS:
        match = re.fullmatch(pattern, topic)
        if match and kind == expected:
            return int(match.group(1)), add
    return None


@functools.lru_cache(maxsize=10_000)
def _odom_number(frame: str) -> Optional[int]:
    """Return the number of the robot that an odometry frame belongs to, None for other frames."""
    match = re.fullmatch(r"/?odom([0-9]{1,4})", frame)
    return int(match.group(1)) if match else None


class TraceReader:
    """Collects the messages of a recording and builds a ``FlightTrace``.

    Attributes:
        robots: Messages of each robot.
        info: Facts of ``/quad/flight``, merged.
        contacts: Contacts, at times on the recording's clock.
        clocks_ns: Time of recording, and time on ``/clock``, of each of its messages.
    """

    def __init__(self) -> None:
        self.robots: Dict[int, BagRobot] = {}
        self.info = FlightInfo()
        self.contacts: List[Contact] = []
        self.clocks_ns: List[Tuple[int, int]] = []
        self._clock_ns: Optional[int] = None

    def add(self, message: Message) -> None:
        """Add a message.

        Messages without a stamp of their own get the last time of ``/clock``: a recorder that was
        started before the simulation stores wall times.

        Raises:
            ValueError: The message is invalid.
        """
        common = _COMMON_TOPICS.get((message.topic, message.kind))
        if self._clock_ns is not None and common is not TraceReader.set_clock:
            message = message._replace(stamp_ns=self._clock_ns)
        if common is not None:
            common(self, message)
            return
        found = _robot_topic(message.topic, message.kind)
        assert found is not None
        robot, add = found
        add(self._robot(robot), message)

    def _robot(self, robot: int) -> BagRobot:
        if robot >= MAX_ROBOTS:
            raise ValueError(f"quadcopter {robot}, expected 0 to {MAX_ROBOTS - 1}")
        return self.robots.setdefault(robot, BagRobot())

    def add_flight(self, message: Message) -> None:
        """Update the flight's information from ``/quad/flight``."""
        self.info = self.info.merged(flight_info_from_message(message.content))

    def set_clock(self, message: Message) -> None:
        """Update the recording's clock from ``/clock``."""
        self._clock_ns = stamp_ns(message.content.clock)
        self.clocks_ns.append((message.stamp_ns, self._clock_ns))

    def add_event(self, message: Message) -> None:
        """Add an event of ``/quad/events``."""
        time_s = stamp_ns(message.content.header.stamp) / 1e9
        event = mission_event_from_message(message.content, time_s)
        self._robot(event.robot).events.append(event)

    def add_contact(self, message: Message) -> None:
        """Add a contact."""
        time_s = stamp_ns(message.content.header.stamp) / 1e9
        self.contacts.append(contact_from_message(message.content, time_s))

    def add_truth(self, message: Message) -> None:
        """Add where the robots are, from ``/quad/truth``."""
        time_s = stamp_ns(message.content.header.stamp) / 1e9
        for name, place in zip(message.content.joint_names, message.content.transforms):
            match = re.fullmatch(r"quad([0-9]{1,4})", name)
            if match:
                pose = pose_from(place.translation, place.rotation)
                self._robot(int(match.group(1))).add_truth(time_s, pose)

    def add_transforms(self, message: Message) -> None:
        """Update the robots' odometry frames from ``/tf``."""
        for transform in message.content.transforms:
            number = _odom_number(transform.child_frame_id)
            if number is not None and transform.header.frame_id.lstrip("/") == "map":
                robot = self._robot(number)
                pose = pose_from(transform.transform.translation, transform.transform.rotation)
                time_s = stamp_ns(transform.header.stamp) / 1e9
                robot.set_odom_frame(time_s, transform.child_frame_id.lstrip("/"), pose)

    def trace(self, path: Path) -> FlightTrace:
        """Build the trace.

        Raises:
            InputError: The recording has no odometry, too long a flight or an invalid scene.
        """
        info = self.info
        scene = info.read_scene(f"{path}: {FLIGHT_TOPIC}")
        self._check_times(path)
        start_s = self.start_s
        infos = dict(enumerate(info.robots))
        traces = tuple(
            robot.trace(start_s, infos.get(number, RobotInfo(f"quad{number}")))
            for number, robot in self.flown_robots.items()
        )
        contacts = tuple(replace(one, time_s=one.time_s - start_s) for one in self.contacts)
        return FlightTrace(
            info.title or path.stem,
            traces,
            contacts,
            scene,
            BODY_RADIUS_M if info.robot_radius_m is None else info.robot_radius_m,
            info.seed,
            info.config_name,
            info.versions,
            info.reason,
            info.jitter_m,
            self._people(path, scene, max(one.times_s[-1] for one in traces)),
        )

    @property
    def start_s(self) -> float:
        """Start of the flight on the recording's clock; there must be odometry."""
        firsts_s = (robot.moves[0][0] for robot in self.flown_robots.values())
        return min(firsts_s) if self.info.start_s is None else self.info.start_s

    @property
    def flown_robots(self) -> Dict[int, BagRobot]:
        """The robots with odometry, by number."""
        return {number: robot for number, robot in sorted(self.robots.items()) if robot.moves}

    def _check_times(self, path: Path) -> None:
        if not self.flown_robots:
            raise InputError(
                [f"{path}: no odometry; expected messages nav_msgs/Odometry on /odom0, ..."]
            )
        for number, robot in self.flown_robots.items():
            length_s = robot.moves[-1][0] - robot.moves[0][0]
            if length_s > LONGEST_FLIGHT_S:
                raise InputError(
                    [
                        f"{path}: /odom{number}: {length_s:g} s from first to last, expected"
                        f" {LONGEST_FLIGHT_S:g} s at most"
                    ]
                )

    @property
    def clock(self) -> FlightClock:
        """The clock of the flight; there must be odometry."""
        return FlightClock(self.clocks_ns, self.start_s)

    def _people(self, path: Path, scene: Optional[Scene], end_s: float) -> Optional[CrowdRecord]:
        """Read where people were who react; None without such people.

        Up to the last pose of a robot they stand where they were seen last, if that was in the
        topic's last period.
        """
        record = None if scene is None else CrowdRecord.of(scene)
        if scene is None or record is None:
            return None
        stamps_ns, places = [], []
        with _limited_memory(path):
            for message in read_messages(path, lambda *topic: topic == (POSES_TOPIC, POSES_KIND)):
                try:
                    places.append(people_positions(message.content.poses, scene))
                except ValueError as error:
                    raise InputError([f"{path}: {POSES_TOPIC}: {error}"]) from error
                stamps_ns.append(message.stamp_ns)
        times_s = self.clock.times_s(np.array(stamps_ns, np.int64)).tolist()
        if times_s and 0.0 < end_s - times_s[-1] <= _LAST_PLACES_S:
            times_s.append(end_s)
            places.append(places[-1])
        for time_s, positions in zip(times_s, places):
            record.add(time_s, positions)
        return record


_COMMON_TOPICS: Dict[Tuple[str, str], Callable[[TraceReader, Message], None]] = {
    (FLIGHT_TOPIC, "quad/FlightInfo"): TraceReader.add_flight,
    ("/clock", "rosgraph_msgs/Clock"): TraceReader.set_clock,
    (EVENTS_TOPIC, "quad/MissionEvent"): TraceReader.add_event,
    (CONTACTS_TOPIC, "quad/Contact"): TraceReader.add_contact,
    (TRUTH_TOPIC, TRUTH_KIND): TraceReader.add_truth,
    ("/tf", "tf2_msgs/TFMessage"): TraceReader.add_transforms,
    ("/tf_static", "tf2_msgs/TFMessage"): TraceReader.add_transforms,
}
