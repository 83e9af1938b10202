"""What a navigator says of its robot: one row for each topic.

The node publishes the rows and the recorder writes them; the reader of recordings and the page read
them. A further topic is a further row, whose type is a packaged one or one of ``msg/``, and a line
in ``docs/topics.md``.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.tick import State, Tick
from quad_nav.peers.right_of_way import YieldDecision
from quad_nav.timing import is_due
from quad_nav.topics.right_of_way import right_of_way, right_of_way_from_message

_STATES = {state.value: state for state in State}


@dataclass(frozen=True)
class RobotStatus:
    """State of a navigator after a tick.

    Attributes:
        state: State of the state machine.
        yielding: Decision to yield to a peer; None without one.
        limited_by: Name of the robot that limits the command, "" if none does.
        goal: Its goal; None without one.
        pose: Its pose, in the frame of the goal; None if it is unknown.
        velocity: Its velocity, in its own frame.
    """

    state: State
    yielding: Optional[YieldDecision] = None
    limited_by: str = ""
    goal: Optional[Pose2D] = None
    pose: Optional[Pose2D] = None
    velocity: Twist2D = Twist2D()


def goal_distance_m(goal: Optional[Pose2D], pose: Optional[Pose2D]) -> float:
    """Return the distance from a pose to a goal in the same frame; NaN without one of them."""
    return math.nan if goal is None or pose is None else pose.distance_to(goal)


@dataclass(frozen=True)
class RobotTopic:
    """A topic of each robot.

    Attributes:
        name: Name below ``/move_base{i}``.
        kind: Type of its messages, such as ``quad/RightOfWay``.
        fields: Returns the fields of the message, apart from its header if it has one.
        read: Returns what a message of rospy or of a recording says, None if that is unknown here;
            raises ValueError for a message that is not valid.
        period_s: Time between messages; 0 if there is one at each change, which is latched.
        column: Heading of the number in the page's table of robots; "" if it is not there.
    """

    name: str
    kind: str
    fields: Callable[[RobotStatus], Mapping[str, Any]]
    read: Callable[[Any], Any]
    period_s: float = 0.0
    column: str = ""

    @property
    def is_latched(self) -> bool:
        """True if a new subscriber gets the last message."""
        return self.period_s == 0.0


def _number(
    name: str, column: str, value: Callable[[RobotStatus], float], period_s: float
) -> RobotTopic:
    """Return the topic of a number."""
    return RobotTopic(
        name,
        "std_msgs/Float64",
        lambda status: {"data": value(status)},
        lambda message: float(message.data),
        period_s,
        column,
    )


ROBOT_TOPICS = (
    RobotTopic(
        "state",
        "std_msgs/String",
        lambda status: {"data": status.state.value},
        lambda message: _STATES.get(message.data),
    ),
    RobotTopic(
        "right_of_way",
        "quad/RightOfWay",
        lambda status: right_of_way(status.yielding, status.limited_by).fields,
        right_of_way_from_message,
    ),
    _number("goal_distance", "dist m", lambda one: goal_distance_m(one.goal, one.pose), 0.5),
)
COLUMNS = tuple(topic for topic in ROBOT_TOPICS if topic.column)
"""The topics that have a column in the page's table of robots."""


class RobotTopicSchedule:
    """Tells which topics of a robot are due."""

    def __init__(self) -> None:
        """Start with nothing published."""
        self._limited_by = ""
        self._published: Dict[str, Tuple[float, Mapping[str, Any]]] = {}

    def pop(self, tick: Tick, pose: Optional[Pose2D]) -> List[Tuple[RobotTopic, Mapping[str, Any]]]:
        """Return the topics that are due after a tick, with their fields.

        Args:
            tick: The tick.
            pose: The robot's pose in the global costmap's frame.
        """
        if tick.command is not None:  # a limit lasts until the next command
            self._limited_by = tick.limited_by
        status = RobotStatus(
            tick.state, tick.yielding, self._limited_by, tick.goal, pose, tick.velocity
        )
        due = []
        for topic in ROBOT_TOPICS:
            last_s, last = self._published.get(topic.name, (-math.inf, None))
            if not is_due(topic.period_s, abs(tick.now_s - last_s)):
                continue
            fields = topic.fields(status)
            if topic.period_s or fields != last:
                self._published[topic.name] = tick.now_s, fields
                due.append((topic, fields))
        return due
