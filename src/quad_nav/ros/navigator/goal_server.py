"""Goals from actionlib and from ``move_base_simple/goal``, and what becomes of them.

The action is called ``move_base`` in the node's namespace, as the original's;
the launch files remap its five topics into the robot's own namespace.
"""

from __future__ import annotations

from collections import deque
from typing import Deque, Optional

import actionlib
import rospy
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseResult

from quad_nav.errors import InvalidGoal
from quad_nav.geometry import Pose3D
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.tick import Outcome
from quad_nav.ros.common.names import Names, own_node
from quad_nav.ros.common.nav_messages import goal_from_message, pose_stamped
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.timing import Schedule


class GoalServer:
    """Hands the newest goal to the navigator when it accepts one."""

    def __init__(self, transforms: Transforms, global_frame: str, names: Names = own_node):
        self._transforms = transforms
        self._global_frame = global_frame
        self._current_goal = rospy.Publisher(names("~current_goal"), PoseStamped, queue_size=1)
        self._server = actionlib.SimpleActionServer(
            names("move_base"), MoveBaseAction, auto_start=False
        )
        self._server.register_goal_callback(None)
        self._action_goal = rospy.Publisher(
            names("move_base/goal"), MoveBaseActionGoal, queue_size=1
        )
        self._server.start()
        self._simple_goals: Deque[PoseStamped] = deque(maxlen=1)
        self._status = Schedule(self._take_over_status())
        self._status.start(0.0)
        self._simple = rospy.Subscriber(
            names("move_base_simple/goal"), PoseStamped, self._store, queue_size=1
        )

    def _take_over_status(self) -> float:
        """How often the status is told, in Hz, from now on by ``poll``.

        actionlib has a thread for it that wakes up with every message of ``/clock``.
        """
        server = self._server.action_server
        if server.status_timer is not None:
            server.status_timer.shutdown()
        return max(server.status_frequency, 0.0)

    def restart(self, now_s: float) -> None:
        """For a clock that has jumped back."""
        self._status.start(now_s)

    def _store(self, message: PoseStamped) -> None:
        self._simple_goals.append(message)

    def _forward(self) -> None:
        """A goal without an action client becomes an action goal, visibly.

        The newest only, however many have come.
        """
        if not self._simple_goals:
            return
        goal = MoveBaseActionGoal()
        goal.header.stamp = rospy.Time.now()
        goal.goal.target_pose = self._simple_goals.pop()
        self._action_goal.publish(goal)

    def poll(self, navigator: Navigator, now_s: float) -> None:
        """Passes on a waiting goal or cancel, if this is a moment to take it."""
        self._forward()
        if self._status.pop(now_s):
            self._server.action_server.publish_status()
        if not navigator.accepts_goal(now_s):
            return
        if self._server.is_new_goal_available():
            self._accept(navigator, now_s)
        elif self._server.is_active() and self._server.is_preempt_requested():
            navigator.cancel()
            self._server.set_preempted(MoveBaseResult())

    def _accept(self, navigator: Navigator, now_s: float) -> None:
        message = self._server.accept_new_goal().target_pose
        try:
            pose = self._in_global_frame(message)
        except InvalidGoal as error:
            navigator.cancel()
            rospy.logerr("%s", error)
            self._server.set_aborted(MoveBaseResult(), str(error))
            return
        navigator.set_goal(pose.to_2d(), now_s)
        self._current_goal.publish(pose_stamped(pose, self._global_frame, message.header.stamp))

    def _in_global_frame(self, message: PoseStamped) -> Pose3D:
        pose = goal_from_message(message.pose)
        frame = message.header.frame_id
        if frame.lstrip("/") == self._global_frame:
            return pose
        try:
            return self._transforms.lookup(self._global_frame, frame).compose(pose)
        except TransformUnavailable as error:
            raise InvalidGoal(
                f"Aborting on goal because its frame '{frame}' can't be transformed to "
                f"'{self._global_frame}': {error}"
            ) from error

    def feedback(self, pose: Pose3D, now: rospy.Time) -> None:
        if self._server.is_active():
            self._server.publish_feedback(
                MoveBaseFeedback(pose_stamped(pose, self._global_frame, now))
            )

    def finish(self, outcome: Optional[Outcome]) -> None:
        if outcome is None or not self._server.is_active():
            return
        if outcome.succeeded:
            self._server.set_succeeded(MoveBaseResult(), outcome.text)
        else:
            self._server.set_aborted(MoveBaseResult(), outcome.text)
