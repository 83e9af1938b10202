"""Where robots believe themselves, as amcl or slam tell of them."""

from __future__ import annotations

import struct
from dataclasses import replace
from typing import Dict, FrozenSet, List, Optional, Tuple

import numpy as np
from geometry_msgs.msg import PoseArray, PoseWithCovarianceStamped
from numpy.typing import NDArray

from quad_nav.errors import excerpt
from quad_nav.geometry import Pose2D
from quad_nav.ros.common.conversions import pose_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.packed_messages import StatesMessage
from quad_nav.ros.common.true_states import TrueStates
from quad_nav.topics.estimates import TRUTH_TOPIC, planar_covariance
from quad_nav.topics.validation import pose_problem
from quad_web.ros.health import FleetHealth
from quad_web.ros.intake import Newest, Topic
from quad_web.ros.poses import MAP
from quad_web.view.localization import Located
from quad_web.view.state import Item

_COUNT = struct.Struct("<I")
_NOWHERE = Located()
_FRAME = 16  # where it begins, after sequence number, stamp and length


class Localizations:
    """The last estimates of all robots that are localized."""

    def __init__(self, robots: int, health: FleetHealth) -> None:
        """Start without estimates; the diagnostics tell who is localized, and by what."""
        self._robots, self._health = range(robots), health
        self._poses: Dict[str, Newest] = {}  # by topic, as the next
        self._clouds: Dict[str, Newest] = {}
        self._true = TrueStates()
        self._last: Dict[int, Located] = {}
        self._to_compare: Dict[int, float] = {}  # stamps of poses whose truth has not come
        self._shown: Dict[int, Tuple[Located, bool]] = {}  # the last items: of what, and lost
        self._warnings = ThrottledWarnings()

    def topics(self, shown: FrozenSet[int]) -> Dict[str, Topic]:
        """Return the topics to subscribe to; ``shown`` are the robots with particles."""
        names = {i: self._health.localization(i)[0] for i in self._robots}
        poses = [f"/{name}_pose{i}" for i, name in names.items() if name]
        clouds = [f"/particlecloud{i}" for i in sorted(shown) if names[i] == "amcl"]
        self._poses = {
            one: self._poses.get(one) or Newest(one, PoseWithCovarianceStamped) for one in poses
        }
        self._clouds = {one: self._clouds.get(one) or Newest(one, PoseArray) for one in clouds}
        topics = {name: one.topic for name, one in {**self._poses, **self._clouds}.items()}
        truth = {TRUTH_TOPIC: Topic(StatesMessage, self._true.add)}
        return {**topics, **(truth if poses else {})}

    def located(self, robot: int) -> Optional[Located]:
        """Return where a robot believes itself, None without a localization."""
        name, is_lost = self._health.localization(robot)
        if not name:
            return None
        return replace(self._last.get(robot, _NOWHERE), is_lost=is_lost, searches=name == "amcl")

    def items(self, shown: FrozenSet[int]) -> List[Item]:
        """Read what has come, and return the items of some robots that are new."""
        for topic, newest in [*self._poses.items(), *self._clouds.items()]:
            try:
                self._read(topic, newest)
            except ValueError as error:
                self._warnings.warn(f"web: {topic}: message dropped: {error}", topic)
        self._compare()
        items = []
        for robot in shown:
            located = self.located(robot)
            if located is None:
                self._shown.pop(robot, None)
                continue
            state = self._last.get(robot, _NOWHERE), located.is_lost
            if self._shown.get(robot) != state:
                self._shown[robot] = state
                items.append(located.item(robot))
        for robot in self._shown.keys() - shown:
            del self._shown[robot]
        return items

    @property
    def keys(self) -> FrozenSet[str]:
        """Keys of the items that are shown."""
        return frozenset(f"localization/{robot}" for robot in self._shown)

    def _read(self, topic: str, newest: Newest) -> None:
        """Take a message, if there is one.

        Raises:
            ValueError: It is not valid.
        """
        robot = int(topic.lstrip("/abcdefghijklmnopqrstuvwxyz_"))
        last = self._last.get(robot, _NOWHERE)
        if topic in self._clouds:
            data = newest.take_bytes()
            if data is not None:
                self._last[robot] = replace(last, particles=cloud_places(data))
            return
        message = newest.take()
        if message is None:
            return
        pose, frame = pose_from_message(message.pose.pose), message.header.frame_id
        problem = pose_problem(pose) or _frame_problem(frame)
        if problem:
            raise ValueError(problem)
        covariance = planar_covariance(message.pose.covariance)
        self._last[robot] = replace(last, pose=pose.to_2d(), covariance=covariance, truth=None)
        self._to_compare[robot] = message.header.stamp.to_sec()

    def _compare(self) -> None:
        """Find the true poses; they come later than the estimates, or before."""
        for robot, stamp_s in list(self._to_compare.items()):
            true = self._true.find(robot, stamp_s)
            if true is not None:
                self._last[robot] = replace(self._last[robot], truth=Pose2D(*true.tolist()))
                del self._to_compare[robot]


def cloud_places(data: bytes) -> NDArray[np.float64]:
    """Return the places float64[n, 2] of a ``PoseArray``: rospy would make objects of thousands.

    Raises:
        ValueError: The bytes are not such a message, or it is not in ``map``.
    """
    try:
        start = _FRAME + _COUNT.unpack_from(data, _FRAME - _COUNT.size)[0]
        (count,) = _COUNT.unpack_from(data, start)
    except struct.error as error:
        raise ValueError(f"it cannot be read: {error}") from error
    problem = _frame_problem(data[_FRAME:start].decode())
    if problem:
        raise ValueError(problem)
    poses = np.frombuffer(data, "<f8", 7 * count, start + _COUNT.size)
    return poses.reshape(count, 7)[:, :2]


def _frame_problem(frame: str) -> str:
    is_map = frame.lstrip("/") == MAP
    return "" if is_map else f"in frame '{excerpt(frame)}', expected {MAP}"
