"""Publish intentions of robots, and receive those of others.

`/move_base{j}/intention` is a `nav_msgs/Path` with the intention of robot j: `header.stamp` is the
time of publication, the poses are the path, and the stamps of the poses hold the negated priority
(`peers.peer.priority_of`), the time at which the goal was set. An empty path means that the robot
stays where it is.

`/quad/intentions` is a `sensor_msgs/PointCloud2` with the intentions of a host's robots. Each point
is one of a robot's path and has the robot's number and priority. A robot that stays where it is has
one point, which is NaN. A robot that is in no such message is heard from its own topic.
"""

from __future__ import annotations

from functools import partial
from typing import Any, Callable, Dict, Iterable, List, Mapping, Tuple

import numpy as np
import rospy
from nav_msgs.msg import Path
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud2, PointField

from quad_nav.errors import excerpt
from quad_nav.peers.peer import Intention, Peer, assumed_intention, idle_priority
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.nav_messages import path_message
from quad_nav.ros.common.rospy_repairs import sender_of
from quad_nav.ros.common.state_topics import OwnTopics
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.publishing import Names
from quad_nav.topics.validation import (
    MAX_LEAD_S,
    MAX_POINTS,
    MAX_POSES,
    MAX_TIME_S,
    path_problem,
    stamp_problem,
)

INTENTIONS_TOPIC = "/quad/intentions"
_INTENTION_TOPIC = "/move_base{}/intention"
REPEAT_S = 0.25
INTENTION_VALID_S = 2.0  # the navigator that published an older intention has died
_COLUMNS = (
    ("x", "<f4", PointField.FLOAT32),
    ("y", "<f4", PointField.FLOAT32),
    ("z", "<f4", PointField.FLOAT32),
    ("robot", "<u4", PointField.UINT32),
    ("priority", "<f8", PointField.FLOAT64),
)
_POINT = np.dtype([(name, kind) for name, kind, _ in _COLUMNS])
_FIELDS = [PointField(name, 4 * k, kind, 1) for k, (name, _, kind) in enumerate(_COLUMNS)]


class IntentionPublisher:
    """Publish the intentions of some robots: at once when one changes, else every `REPEAT_S`."""

    def __init__(
        self,
        topic: str,
        data_class: Any,
        convert: Callable[[Mapping[int, Intention], float], Any],
        own_connections: int = 0,
    ) -> None:
        """Advertise the topic.

        Args:
            topic: Its name.
            data_class: Type of its messages.
            convert: Makes a message of the intentions and the time.
            own_connections: Number of this node's own subscriptions to the topic.
        """
        self._publisher = rospy.Publisher(topic, data_class, queue_size=10)
        self._convert, self._own_connections = convert, own_connections
        self._sent_s = 0.0
        self._sent: Mapping[int, Intention] = {}

    def publish(self, intentions: Mapping[int, Intention], now_s: float) -> None:
        """Publish the present intentions if that is due and another node listens."""
        if self._publisher.get_num_connections() <= self._own_connections or not intentions:
            return
        is_same = intentions.keys() == self._sent.keys() and all(
            one.path is self._sent[robot].path and one.priority == self._sent[robot].priority
            for robot, one in intentions.items()
        )
        if not is_same or not 0.0 <= now_s - self._sent_s < REPEAT_S:
            self._sent_s, self._sent = now_s, dict(intentions)
            self._publisher.publish(self._convert(intentions, now_s))


def robot_publisher(names: Names, frame: str) -> IntentionPublisher:
    """Return the publisher of one robot's intention in ``frame``."""

    def convert(intentions: Mapping[int, Intention], now_s: float) -> Path:
        (intention,) = intentions.values()
        return intention_message(intention, frame, now_s)

    return IntentionPublisher(names("~intention"), Path, convert)


def host_publisher(frame: str, own_connections: int) -> IntentionPublisher:
    """Return the publisher of the intentions of all robots of a host, in one message."""

    def convert(intentions: Mapping[int, Intention], now_s: float) -> PointCloud2:
        return intentions_message(intentions, frame, now_s)

    return IntentionPublisher(INTENTIONS_TOPIC, PointCloud2, convert, own_connections)


class IntentionListener:
    """Receive the intentions of robots."""

    def __init__(
        self,
        robots: Iterable[int],
        transforms: Transforms,
        frame: str,
        own: Iterable[int] = (),
        only_published: bool = False,
    ) -> None:
        """Subscribe to the intentions of hosts.

        Args:
            robots: Numbers of the robots.
            transforms: Converts their intentions to `frame`.
            frame: Frame of the intentions.
            own: Numbers of the robots that this node flies.
            only_published: Whether it is not known which robots there are: see `OwnTopics`.
        """
        self._transforms, self._frame = transforms, frame
        self._robots, self._own = frozenset(robots), frozenset(own)
        self._warnings = ThrottledWarnings()
        self._intentions: Dict[int, Tuple[float, Intention]] = {}  # with the time
        self._own_topics = OwnTopics(
            max(self._robots, default=0) + 1,
            self._robots,
            self._subscribe,
            _INTENTION_TOPIC.format if only_published else None,
        )
        self.subscribers: List[rospy.Subscriber] = []
        if self._robots:
            self.subscribers.append(
                rospy.Subscriber(INTENTIONS_TOPIC, PointCloud2, self._on_intentions, queue_size=10)
            )

    def _subscribe(self, robot: int) -> rospy.Subscriber:
        return rospy.Subscriber(
            _INTENTION_TOPIC.format(robot),
            Path,
            partial(self._on_intention, robot),
            queue_size=1,
        )

    def _on_intentions(self, message: PointCloud2) -> None:
        sent_s, frame = message.header.stamp.to_sec(), message.header.frame_id
        sender = excerpt(sender_of(message) or "an unnamed node")
        if sender == rospy.get_name():
            return
        try:
            received = intentions_from_message(message, self._robots | self._own)
            if stamp_problem(sent_s, rospy.get_time()):
                raise ValueError(stamp_problem(sent_s, rospy.get_time()))
            for robot in self._own.intersection(received):
                del received[robot]
                self._warnings.warn(
                    f"quad{robot}: {sender} flies quad{robot} too, and neither avoids the other;"
                    " expected one navigator for each robot: set another number with"
                    ' <param name="robot" value="..." /> in the <node> of one of them'
                )
            received = self._in_own_frame(received, frame)
        except (ValueError, TransformUnavailable) as error:
            self._warnings.warn(
                f"{INTENTIONS_TOPIC}: intentions dropped: {error}", kind=INTENTIONS_TOPIC
            )
            return
        self._own_topics.hear(np.array(list(received), np.int64))
        for robot, intention in received.items():
            self._intentions[robot] = sent_s, intention

    def _on_intention(self, number: int, message: Path) -> None:
        if self._own_topics.is_in_bulk(number):
            return
        intention = intention_from_message(message, number)
        if len(intention.path):
            try:
                frame = message.header.frame_id
                intention = self._in_own_frame({number: intention}, frame)[number]
            except TransformUnavailable as error:
                self._warnings.warn(
                    f"quad{number}: intention dropped, expecting straight flight: {error}",
                    kind=f"quad{number}",
                )
                self._intentions.pop(number, None)
                return
        self._intentions[number] = message.header.stamp.to_sec(), intention

    def _in_own_frame(self, received: Dict[int, Intention], frame: str) -> Dict[int, Intention]:
        """Convert intentions, by robot, from another frame.

        Raises:
            TransformUnavailable: The transform is not known.
        """
        if not received or frame.lstrip("/") == self._frame.lstrip("/"):
            return received
        try:
            own_from_frame = self._transforms.lookup(self._frame, frame).to_2d()
        except TransformUnavailable as error:
            raise TransformUnavailable(f"frame '{frame}': {error}") from error
        return {robot: one.transformed(own_from_frame) for robot, one in received.items()}

    def set(self, number: int, intention: Intention, now_s: float) -> None:
        """Store the intention of a robot that needs no topic."""
        self._intentions[number] = now_s, intention

    def of(self, number: int, peer: Peer, now_s: float) -> Intention:
        """Return the intention of a robot with this state: the last received or an assumed one."""
        self._own_topics.check()
        received = self._intentions.get(number)
        if received is None:
            return assumed_intention(peer)
        sent_s, intention = received
        if not -MAX_LEAD_S <= now_s - sent_s <= INTENTION_VALID_S:
            return Intention(idle_priority(number))
        return intention


def intention_message(intention: Intention, frame: str, now_s: float) -> Path:
    """Convert an intention in `frame` to a message."""
    path = np.column_stack((intention.path, np.zeros(len(intention.path))))
    message = path_message(path, frame, time_message(-intention.priority))
    message.header.stamp = time_message(now_s)
    return message


def intention_from_message(message: Path, number: int) -> Intention:
    """Convert the message of robot `number`; an invalid one counts as "stays where it is"."""
    if not message.poses:
        return Intention(idle_priority(number))
    path = np.array(
        [(p.pose.position.x, p.pose.position.y) for p in message.poses[: MAX_POSES + 1]]
    )
    problem = path_problem(path)
    if problem:
        rospy.logwarn_throttle(5.0, f"quad{number}: intention dropped: {problem}")
        return Intention(idle_priority(number))
    return Intention(-message.poses[0].header.stamp.to_sec(), path)


def intentions_message(
    intentions: Mapping[int, Intention], frame: str, now_s: float
) -> PointCloud2:
    """Convert the intentions of robots in `frame` to one message."""
    counts = [max(len(one.path), 1) for one in intentions.values()]
    points = np.zeros(sum(counts), _POINT)
    start = 0
    for (robot, one), count in zip(intentions.items(), counts):
        rows = points[start : start + count]
        rows["robot"], rows["priority"] = robot, one.priority
        rows["x"] = one.path[:, 0] if len(one.path) else np.nan
        rows["y"] = one.path[:, 1] if len(one.path) else np.nan
        start += count
    message = PointCloud2(height=1, width=len(points), is_dense=False, fields=_FIELDS)
    message.header.frame_id, message.header.stamp = frame, time_message(now_s)
    message.point_step, message.row_step = _POINT.itemsize, points.nbytes
    message.data = points.tobytes()
    return message


def intentions_from_message(message: PointCloud2, robots: Iterable[int]) -> Dict[int, Intention]:
    """Convert the message to the intentions of some robots.

    An invalid path counts as "stays where it is".

    Raises:
        ValueError: If the message has other fields, or not as much data as it says.
    """
    if message.fields != _FIELDS or message.point_step != _POINT.itemsize or message.is_bigendian:
        raise ValueError(f"its fields are not {', '.join(field.name for field in _FIELDS)}")
    count = message.width * message.height
    if count > MAX_POINTS or count * _POINT.itemsize != len(message.data):
        raise ValueError(f"{len(message.data)} bytes for {count} points")
    points = np.frombuffer(message.data, _POINT)
    starts = np.flatnonzero(np.diff(points["robot"].astype(np.int64), prepend=-1))
    parts = zip(points["robot"][starts].tolist(), np.split(points, starts[1:]))
    return {robot: _intention(robot, part) for robot, part in parts if robot in robots}


def _intention(robot: int, points: NDArray[np.void]) -> Intention:
    """Return the intention of a robot from its points."""
    priority = float(points["priority"][0])
    path = np.column_stack((points["x"], points["y"])).astype(np.float64)
    problem = path_problem(path)
    if not -MAX_TIME_S <= priority <= 0.0:
        problem = f"priority {priority:g}, expected a negated time"
    elif len(path) == 1 and np.isnan(path).all():
        return Intention(priority)
    if problem:
        rospy.logwarn_throttle(5.0, f"quad{robot}: intention dropped: {problem}")
        return Intention(idle_priority(robot))
    return Intention(priority, path)
