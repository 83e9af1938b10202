"""Topics of a navigator's action ``move_base``, as actionlib's server publishes them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, List, Optional

from quad_nav.geometry import Pose2D
from quad_nav.navigator.tick import Outcome
from quad_nav.recording.messages import constant, header, message, planar_pose, pose_stamped, time
from quad_nav.recording.record_file import TopicWriter, stamp_at
from quad_nav.timing import is_due

STATUS_PERIOD_S = 0.2
ENDED_GOALS_STAY_S = 5.0

_STATUS = "actionlib_msgs/GoalStatus"
_ACTIVE, _PREEMPTED, _SUCCEEDED, _ABORTED = (
    constant(_STATUS, name) for name in ("ACTIVE", "PREEMPTED", "SUCCEEDED", "ABORTED")
)
_ACCEPTED_TEXT = "This goal has been accepted by the simple action server"
_REPLACED_TEXT = (
    "This goal was canceled because another goal was recieved by the simple action server"
)


@dataclass
class _Goal:
    pose: Pose2D
    sent: int  # nanoseconds
    name: str
    status: int
    text: str
    ended_s: Optional[float] = None

    def message(self) -> Any:
        return message(_STATUS, (time(self.sent), self.name), self.status, self.text)


class ActionTopics:
    """Goals, status, feedback and results of one robot's action server."""

    def __init__(self, robot: int, topics: TopicWriter, global_frame: str = "map") -> None:
        self._global_frame = global_frame
        self._topics = topics
        self._robot = robot
        self._node = f"/move_base{robot}"
        self._goals: List[_Goal] = []
        self._waiting: Optional[_Goal] = None
        self._active: Optional[_Goal] = None
        self._count = 0
        self._next_status_s = 0.0

    @property
    def is_waiting(self) -> bool:
        """True if a sent goal is not accepted yet."""
        return self._waiting is not None

    def send(self, now_s: float, pose: Pose2D) -> None:
        """Write a goal that the sequencer sends."""
        stamp = stamp_at(now_s)
        self._count += 1
        name = f"{self._node}-{self._count}-{stamp / 1e9:.3f}"
        self._waiting = _Goal(pose, stamp, name, _ACTIVE, _ACCEPTED_TEXT)
        goal = pose_stamped(planar_pose(pose), "map", stamp)
        self._topics.write(f"/move_base_simple/goal{self._robot}", stamp, goal, "/sequencer")
        # As quad's node forwards it: the action server assigns the id on arrival.
        self._write("goal", now_s, "move_base_msgs/MoveBaseActionGoal", (time(0), ""), (goal,))

    def accept(self, now_s: float) -> None:
        """Accept the waiting goal; the active goal, if any, is preempted."""
        assert self._waiting is not None
        if self._active is not None:
            self._end(now_s, _PREEMPTED, _REPLACED_TEXT)
        goal, self._waiting = self._waiting, None
        self._active = goal
        self._goals.append(goal)
        pose = pose_stamped(planar_pose(goal.pose), "map", goal.sent)
        self._topics.write(f"{self._node}/current_goal", stamp_at(now_s), pose, self._node)
        self._write_status(now_s)

    def feedback(self, now_s: float, pose: Pose2D) -> None:
        """Write the feedback of a control cycle at ``pose`` in the global costmap's frame."""
        if self._active is None:
            return
        here = pose_stamped(planar_pose(pose), self._global_frame, stamp_at(now_s))
        kind = "move_base_msgs/MoveBaseActionFeedback"
        self._write("feedback", now_s, kind, self._active.message(), (here,))

    def finish(self, now_s: float, outcome: Outcome) -> None:
        """Write the result of the active goal."""
        if self._active is not None:
            self._end(now_s, _SUCCEEDED if outcome.succeeded else _ABORTED, outcome.text)

    def write_due_status(self, now_s: float) -> None:
        """Write the goal status if its period is over."""
        if is_due(self._next_status_s, now_s):
            self._write_status(now_s)

    def _end(self, now_s: float, status: int, text: str) -> None:
        goal, self._active = self._active, None
        assert goal is not None
        goal.status, goal.text, goal.ended_s = status, text, now_s
        self._write("result", now_s, "move_base_msgs/MoveBaseActionResult", goal.message(), ())
        self._write_status(now_s)

    def _write_status(self, now_s: float) -> None:
        self._next_status_s = now_s + STATUS_PERIOD_S
        self._goals = [
            goal
            for goal in self._goals
            if goal.ended_s is None or now_s < goal.ended_s + ENDED_GOALS_STAY_S
        ]
        shown = [goal.message() for goal in self._goals]
        self._write("status", now_s, "actionlib_msgs/GoalStatusArray", shown)

    def _write(self, name: str, now_s: float, kind: str, *fields: Any) -> None:
        """Write a message of the action, whose header has the time and no frame."""
        stamp = stamp_at(now_s)
        content = message(kind, header("", stamp), *fields)
        self._topics.write(f"{self._node}/{name}", stamp, content, self._node)
