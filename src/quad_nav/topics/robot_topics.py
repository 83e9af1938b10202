"""What a navigator says of its robot at each change: one row for each topic.

The node publishes the rows, the recorder writes them. A further topic is a further row, whose type
is a packaged one or one of ``msg/``, and a line in ``docs/topics.md``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Callable, Dict, List, Mapping, Optional, Tuple

from quad_nav.navigator.tick import State, Tick
from quad_nav.peers.right_of_way import YieldDecision
from quad_nav.topics.right_of_way import right_of_way


@dataclass(frozen=True)
class RobotStatus:
    """State of a navigator after a tick.

    Attributes:
        state: State of the state machine.
        yielding: Decision to yield to a peer; None without one.
        limited_by: Name of the robot that limits the command, "" if none does.
    """

    state: State
    yielding: Optional[YieldDecision] = None
    limited_by: str = ""


@dataclass(frozen=True)
class RobotTopic:
    """A latched topic, published when what it says changes.

    Attributes:
        name: Name below ``/move_base{i}``.
        kind: Type of its messages, such as ``quad/RightOfWay``.
        fields: Returns the fields of the message, apart from its header if it has one.
    """

    name: str
    kind: str
    fields: Callable[[RobotStatus], Mapping[str, Any]]


ROBOT_TOPICS = (
    RobotTopic("state", "std_msgs/String", lambda status: {"data": status.state.value}),
    RobotTopic(
        "right_of_way",
        "quad/RightOfWay",
        lambda status: right_of_way(status.yielding, status.limited_by).fields,
    ),
)


class RobotTopicSchedule:
    """Tells which topics of a robot have changed."""

    def __init__(self) -> None:
        """Start with nothing published."""
        self._status: Optional[RobotStatus] = None
        self._published: Dict[str, Mapping[str, Any]] = {}

    def pop(self, tick: Tick) -> List[Tuple[RobotTopic, Mapping[str, Any]]]:
        """Return the topics that say something else after a tick, with their fields."""
        before = self._status
        # A limit lasts until the next command: there are ticks without one in between.
        limited_by = tick.limited_by
        if before is not None and tick.command is None:
            limited_by = before.limited_by
        self._status = RobotStatus(tick.state, tick.yielding, limited_by)
        if self._status == before:
            return []
        present = [(topic, topic.fields(self._status)) for topic in ROBOT_TOPICS]
        changed = [one for one in present if one[1] != self._published.get(one[0].name)]
        self._published.update({topic.name: fields for topic, fields in changed})
        return changed
