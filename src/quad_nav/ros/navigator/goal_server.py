"""Receive goals through actionlib and `move_base_simple/goal`, and report their results.

The action is named `move_base` in the node's namespace, as in C++ move_base. The launch files
remap its five topics into the robot's own namespace, `/move_base{i}`. Requests to cancel are heard
there with any launch file: those of the sequencer, which stops robots with them.
"""

from __future__ import annotations

import math
from collections import deque
from dataclasses import replace
from typing import Callable, Deque, Optional

import rospy
from actionlib_msgs.msg import GoalID
from geometry_msgs.msg import PoseStamped
from move_base_msgs.msg import MoveBaseAction, MoveBaseActionGoal, MoveBaseFeedback, MoveBaseResult

from quad_nav.errors import InvalidGoal, excerpt
from quad_nav.geometry import Pose3D
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.tick import Outcome
from quad_nav.ros.common.conversions import pose_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.nav_messages import goal_from_message, pose_stamped, upright
from quad_nav.ros.common.polled_actions import PolledActionServer
from quad_nav.ros.common.rospy_repairs import reaches
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.publishing import Names


class GoalServer:
    """Pass the newest goal to the navigator when it accepts one."""

    def __init__(
        self,
        number: int,
        transforms: Transforms,
        global_frame: str,
        names: Names,
        on_request: Callable[[], None],
    ) -> None:
        """Start the server of robot ``number``, whose navigator has goals in ``global_frame``.

        ``on_request`` is called when a goal or a request to cancel has come.
        """
        self._robot = robot = f"quad{number}"
        self._transforms = transforms
        self._global_frame = global_frame
        self._current_goal = rospy.Publisher(names("~current_goal"), PoseStamped, queue_size=10)
        self._warnings = ThrottledWarnings()
        self._server = PolledActionServer(
            names("move_base"),
            MoveBaseAction,
            lambda line: self._warnings.warn(f"{robot}: {line}"),
            on_request,
        )
        self._on_request = on_request
        self._untransformed: Optional[PoseStamped] = None  # upstream's goal in another frame
        own_cancel, cancel = f"/move_base{number}/cancel", names("move_base/cancel")
        if rospy.resolve_name(cancel) != own_cancel:
            self._cancel = rospy.Subscriber(own_cancel, GoalID, self._server.cancel)
        self._action_goal = rospy.Publisher(
            names("move_base/goal"), MoveBaseActionGoal, queue_size=1
        )
        self._simple_goals: Deque[PoseStamped] = deque(maxlen=1)
        self._simple = rospy.Subscriber(
            names("move_base_simple/goal"), PoseStamped, self._store, queue_size=1
        )

    def restart(self, now_s: float) -> None:
        """Restart the status schedule after a clock jump, and adapt stamps from the future."""
        self._server.restart(now_s)

    def _store(self, message: PoseStamped) -> None:
        self._simple_goals.append(message)
        self._on_request()

    def _forward(self) -> None:
        """Publish the newest simple goal as an action goal, as C++ move_base does."""
        if not self._simple_goals or not self._hears_itself():
            return
        goal = MoveBaseActionGoal()
        goal.header.stamp = rospy.Time.now()
        goal.goal.target_pose = self._simple_goals.pop()
        self._action_goal.publish(goal)

    def _hears_itself(self) -> bool:
        """Return whether this node's action server is connected to its own topic.

        The connection is made through the master, like any other. On a busy machine it takes a
        while after the start, and a goal published before that is lost.
        """
        return reaches(self._action_goal, rospy.get_name())

    def poll(self, navigator: Navigator, now_s: float) -> None:
        """Pass a waiting goal or cancel to the navigator, if it accepts one now."""
        self._forward()
        self._server.publish_status(now_s)
        if not navigator.accepts_goal(now_s):
            return
        # A new goal is stored before it requests the preemption, so read them the other way round:
        # otherwise one that arrives between the two would count as a cancel request.
        is_preempted = self._server.is_active() and self._server.is_preempt_requested()
        if self._server.is_new_goal_available():
            self._accept(navigator, now_s)
        elif is_preempted:
            self._untransformed = None
            navigator.cancel()
            self._server.set_preempted(MoveBaseResult())
        if self._untransformed is not None:
            self._head_for(navigator, self._untransformed, now_s)

    def _accept(self, navigator: Navigator, now_s: float) -> None:
        message = self._server.accept_new_goal().target_pose
        self._untransformed = None
        try:
            if not navigator.params.check_goals:
                upright(pose_from_message(message.pose))
                self._head_for(navigator, message, now_s)
                return
            pose = self._in_global_frame(message)
        except InvalidGoal as error:
            if navigator.params.check_goals:
                navigator.cancel()
            else:
                navigator.end_goal()  # the last command stays in force
            self._warnings.error(f"{self._robot}: {error}")
            self._server.set_aborted(MoveBaseResult(), str(error))
            return
        navigator.set_goal(pose.to_2d(), now_s)
        self._current_goal.publish(pose_stamped(pose, self._global_frame, message.header.stamp))

    def _head_for(self, navigator: Navigator, message: PoseStamped, now_s: float) -> None:
        """Pass a goal as upstream does: one that cannot be transformed is tried in every cycle."""
        goal = self._transformed(message)
        is_known = goal.header.frame_id == self._global_frame
        pose = pose_from_message(goal.pose)
        is_finite = math.isfinite(pose.x_m) and math.isfinite(pose.y_m)
        navigator.set_goal(pose.to_2d() if is_known and is_finite else None, now_s)
        self._current_goal.publish(goal)
        self._untransformed = None if is_known else goal

    def _transformed(self, message: PoseStamped) -> PoseStamped:
        """Return a goal in the global frame by the transform at its stamp, else as it came."""
        frame, stamp = message.header.frame_id, message.header.stamp
        try:
            if frame.startswith("/"):
                raise TransformUnavailable(f"frame '{excerpt(frame)}' begins with a slash")
            pose = self._transforms.lookup(self._global_frame, frame, stamp or None)
        except TransformUnavailable as error:
            self._warnings.warn(f"{self._robot}: goal not transformed: {error}")
            return message
        goal = pose.compose(upright(pose_from_message(message.pose)))
        return pose_stamped(_as_of_matrix(goal), self._global_frame, stamp)

    def _in_global_frame(self, message: PoseStamped) -> Pose3D:
        pose = goal_from_message(message.pose)
        frame = message.header.frame_id
        if frame.lstrip("/") == self._global_frame:
            return pose
        try:
            return self._transforms.lookup(self._global_frame, frame).compose(pose)
        except TransformUnavailable as error:
            raise InvalidGoal(
                f"Aborting on goal because its frame '{excerpt(frame)}' cannot be transformed to "
                f"'{self._global_frame}': {error}"
            ) from error

    def publish_feedback(self, pose: Pose3D, now: rospy.Time) -> None:
        """Publish the pose in the global frame for listeners, while a goal is active."""
        listeners = self._server.action_server.feedback_pub.get_num_connections()
        if listeners and self._server.is_active():
            self._server.publish_feedback(
                MoveBaseFeedback(pose_stamped(pose, self._global_frame, now))
            )

    def finish(self, outcome: Optional[Outcome]) -> None:
        """Report the result of the active goal, if there is one."""
        if outcome is None or not self._server.is_active():
            return
        self._untransformed = None
        if outcome.succeeded:
            self._server.set_succeeded(MoveBaseResult(), outcome.text)
        else:
            self._server.set_aborted(MoveBaseResult(), outcome.text)


def _as_of_matrix(pose: Pose3D) -> Pose3D:
    """Return a pose with the sign of the quaternion that tf2 computes from its rotation matrix."""
    x, y, z, w = pose.quaternion
    leading = w if 4.0 * w * w > 1.0 else max((x, y, z), key=abs)  # the trace is 4 w^2 - 1
    return pose if leading >= 0.0 else replace(pose, quaternion=(-x, -y, -z, -w))
