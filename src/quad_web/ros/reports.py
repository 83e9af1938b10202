"""What the nodes say about a flight: scene and mission, goals, contacts, yields and their log."""

from __future__ import annotations

import json
import re
import threading
import time
from typing import Any, Dict, List, Mapping, Optional, Set, Tuple

from move_base_msgs.msg import RecoveryStatus
from quad.msg import Contact as ContactMessage
from quad.msg import FlightInfo, MissionEvent
from rosgraph_msgs.msg import Log
from roslib.message import get_message_class
from std_msgs.msg import String, Time
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.errors import InputError, excerpt
from quad_nav.geometry import yaw_from_quaternion
from quad_nav.mission.actions import Event
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.rospy_repairs import topic_of
from quad_nav.sim.contacts import Contact
from quad_nav.sim.scene import BODY_RADIUS_M, Scene
from quad_nav.topics.contacts import CONTACTS_TOPIC, contact_from_message
from quad_nav.topics.flight_info import FLIGHT_TOPIC, RESET_TOPIC, flight_info_from_message
from quad_nav.topics.mission_events import EVENTS_TOPIC, SUMMARY_TOPIC, mission_event_from_message
from quad_nav.topics.right_of_way import RightOfWay
from quad_nav.topics.robot_topics import COLUMNS, ROBOT_TOPICS
from quad_nav.topics.validation import MAX_MAGNITUDE
from quad_web.ros.intake import Newest, Topic
from quad_web.view.result import result_item
from quad_web.view.state import FleetState, Item

MAX_CONTACTS, MAX_GOALS, MAX_TEXT = 500, 20_000, 500
_LEVELS = {Log.WARN: "warning", Log.ERROR: "error", Log.FATAL: "error"}
_OUR_NODES = re.compile(r"/(simulator|sequencer|move_base\d+|fleet\d*|goal_router|web)")
_ROBOT = re.compile(r"quad(\d{1,4})\b")
_GOAL = re.compile(r"goal(\d{1,4})(_yaw)?")
_COLUMNS = {topic.name for topic in COLUMNS}
# The state comes with the diagnostics, which C++ move_base and a dead node do not publish.
_HEARD = {topic.name: topic for topic in ROBOT_TOPICS if topic.name != "state"}
_HINT = "quad report FILE.bag"
_CONTACT = "CONTACT with"  # the sequencer repeats what the simulator has logged
_ACTIVE_ALPHA, _REACHED_ALPHA = 0.95, 0.4  # of the spheres of goals, see topics.markers


class FlightReports:
    """Receives what the nodes say; its attributes are what they have said so far.

    Attributes:
        scene: The scene, None before the simulator has published it.
        radius_m: Radius of a robot's hull.
        trees: Parameters of each robot's navigator as the mission has loaded them.
        contacts: The last contacts.
        result: How the mission has ended, the item of the page; None while it flies.
        recoveries: Number of the last recovery behaviour of each robot's goal, and of all.
        sent_s: Wall time, monotonic, at which each robot's sequencer has sent its last goal.
        version: Counts changes of scene, radius and trees.
        resets: Counts resets of the simulation.
    """

    def __init__(self, robots: int, state: FleetState) -> None:
        """Start without reports; the log of events of ``state`` gets what the nodes log."""
        self.scene: Optional[Scene] = None
        self.radius_m = BODY_RADIUS_M
        self.trees: Dict[int, Mapping[str, Any]] = {}
        self.contacts: List[Contact] = []
        self.result: Optional[Item] = None
        self.version = self.resets = 0
        self._robots, self._state = robots, state
        self._failed: Set[Tuple[int, int]] = set()
        self._goals = Newest("/goals", MarkerArray)
        self._rows: List[Dict[str, Any]] = []
        self._said: Dict[int, Dict[str, Any]] = {robot: {} for robot in range(robots)}
        self.recoveries: Dict[int, Tuple[int, int]] = {}
        self.sent_s: Dict[int, float] = {}
        self._lock = threading.Lock()
        self._warnings = ThrottledWarnings()

    def topics(self, has_clients: bool) -> Dict[str, Topic]:
        """Return the topics to subscribe to."""
        topics = {
            FLIGHT_TOPIC: Topic(FlightInfo, self._on_flight),
            EVENTS_TOPIC: Topic(MissionEvent, self._on_event),
            SUMMARY_TOPIC: Topic(String, self._on_summary),
            RESET_TOPIC: Topic(Time, self._on_reset),
            CONTACTS_TOPIC: Topic(ContactMessage, self._on_contact),
            "/rosout_agg": Topic(Log, self._on_log),
        }
        if not has_clients:
            return topics
        topics["/goals"] = self._goals.topic
        for robot in range(self._robots):
            node = f"/move_base{robot}"
            topics[f"{node}/recovery_status"] = Topic(RecoveryStatus, self._on_recovery)
            for name, topic in _HEARD.items():
                topics[f"{node}/{name}"] = Topic(get_message_class(topic.kind), self._on_said)
        return topics

    def forget_navigator(self, robot: int) -> None:
        """Forget what a navigator has said that does not say anything any more."""
        self._said[robot].clear()

    # -- the flight ----------------------------------------------------------------------

    def _on_flight(self, message: FlightInfo) -> None:
        """Merge the facts of a publisher; nothing that comes is trusted."""
        try:
            info = flight_info_from_message(message)
            scene = info.read_scene(FLIGHT_TOPIC)
        except (InputError, ValueError) as error:
            self._warnings.warn(f"web: {FLIGHT_TOPIC}: message dropped: {error}", kind="flight")
            return
        if scene is not None:
            self.scene = scene
        if info.robot_radius_m is not None:
            self.radius_m = info.robot_radius_m
        for number, robot in enumerate(info.robots[: self._robots]):
            self.trees[number] = robot.parameters
        self.version += 1

    def _on_reset(self, _: Time) -> None:
        self.resets += 1
        self._failed.clear()

    def _on_event(self, message: MissionEvent) -> None:
        try:
            event = mission_event_from_message(message, message.header.stamp.to_sec())
        except ValueError as error:
            self._warnings.warn(f"web: {EVENTS_TOPIC}: message dropped: {error}", kind="event")
            return
        robot, goal = event.robot, event.goal
        if event.event is Event.DONE or robot >= self._robots or goal >= MAX_GOALS:
            return
        is_failure = event.event is Event.SKIPPED
        (self._failed.add if is_failure else self._failed.discard)((robot, goal))
        if event.event is Event.SENT:
            self.recoveries.pop(robot, None)
            self.sent_s[robot] = time.monotonic()

    def _on_summary(self, message: String) -> None:
        try:
            summary = json.loads(message.data) if message.data else None
            self.result = None if summary is None else result_item(summary, _HINT)
        except (ValueError, LookupError, TypeError, AttributeError, RecursionError) as error:
            text = excerpt(f"{SUMMARY_TOPIC}: message dropped: {error!r}", MAX_TEXT)
            self._warnings.warn(f"web: {text}", kind="summary")

    def _on_contact(self, message: ContactMessage) -> None:
        try:
            contact = contact_from_message(message, message.header.stamp.to_sec())
        except ValueError as error:
            self._warnings.warn(f"web: {CONTACTS_TOPIC}: message dropped: {error}", "contact")
            return
        with self._lock:
            self.contacts = [*self.contacts[1 - MAX_CONTACTS :], contact]
        place = f"({contact.x_m:.2f}, {contact.y_m:.2f}) m"
        text = excerpt(f"CONTACT: {contact} at {place}", MAX_TEXT)
        self._state.add_event(contact.time_s, text, "error", self._robot_of(contact.robot))

    def _on_log(self, message: Log) -> None:
        level = _LEVELS.get(message.level, "info")
        is_ours = _OUR_NODES.fullmatch(message.name) is not None
        if message.level < Log.INFO or (level == "info" and not is_ours):
            return
        text = message.msg
        if is_ours and (_CONTACT in text or " touches " in text):
            return  # `_on_contact` has it
        self._state.add_event(
            message.header.stamp.to_sec(),
            excerpt(" ".join(text.split()), MAX_TEXT),
            level,
            self._robot_of(text) if is_ours else None,
        )

    def _robot_of(self, text: str) -> Optional[int]:
        found = _ROBOT.match(text)
        robot = int(found[1]) if found else self._robots
        return robot if robot < self._robots else None

    # -- robots --------------------------------------------------------------------------

    def _on_recovery(self, message: RecoveryStatus) -> None:
        robot, _ = _origin(message)
        if robot is not None:
            count = max(0, message.current_recovery_number) + 1
            self.recoveries[robot] = count, max(count, message.total_number_of_recoveries)

    def _on_said(self, message: Any) -> None:
        robot, name = _origin(message)
        if robot not in self._said:  # also None
            return
        try:
            self._said[robot][name] = _HEARD[name].read(message)
        except ValueError as error:
            topic = f"/move_base{robot}/{name}"
            self._warnings.warn(f"web: {topic}: message dropped: {error}", kind=name)

    def right_of_way(self, robot: int) -> RightOfWay:
        """Return what a robot does for its peers."""
        return self._said[robot].get("right_of_way") or RightOfWay()

    def columns(self, robot: int) -> Dict[str, float]:
        """Return the numbers that a navigator has told of the topics in ``COLUMNS``."""
        return {name: value for name, value in self._said[robot].items() if name in _COLUMNS}

    def goal_rows(self) -> List[Dict[str, Any]]:
        """Return the rows of the item ``goals``, from the markers of the sequencer."""
        try:
            message = self._goals.take()
        except ValueError as error:
            self._warnings.warn(f"web: /goals: message dropped: {error}", kind="goals")
            return self._rows
        if message is not None:
            self._rows = self._read_goals(message)
        return [
            {**row, "state": "failed"}
            if row["state"] == "reached" and (row["robot"], row["index"]) in self._failed
            else row
            for row in self._rows
        ]

    def _read_goals(self, message: MarkerArray) -> List[Dict[str, Any]]:
        yaws: Dict[Tuple[int, int], float] = {}
        rows = []
        for marker in message.markers[: 3 * MAX_GOALS]:
            found = _GOAL.fullmatch(marker.ns)
            if not found or int(found[1]) >= self._robots or marker.action != Marker.ADD:
                continue
            key = int(found[1]), marker.id
            at, turn = marker.pose.position, marker.pose.orientation
            if not (abs(at.x) <= MAX_MAGNITUDE and abs(at.y) <= MAX_MAGNITUDE):
                continue
            if found[2]:
                yaws[key] = yaw_from_quaternion((turn.x, turn.y, turn.z, turn.w))
                continue
            alpha = marker.color.a
            ended = "reached" if alpha < _REACHED_ALPHA else "pending"
            state = "active" if alpha > _ACTIVE_ALPHA else ended
            rows.append({"robot": key[0], "index": key[1], "x": at.x, "y": at.y, "state": state})
        return [{**row, "yaw": yaws.get((row["robot"], row["index"]))} for row in rows]


def _origin(message: Any) -> Tuple[Optional[int], str]:
    """Return the number of the robot whose topic a message came from, and the name below it."""
    topic = topic_of(message)
    found = re.match(r"/move_base(\d{1,4})/", topic)
    return (int(found[1]), topic[found.end() :]) if found else (None, "")
