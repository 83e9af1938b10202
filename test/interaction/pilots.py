"""A navigator that flies straight to its goals, with the topics of move_base."""

from __future__ import annotations

import math

import rospy
from actionlib_msgs.msg import GoalID, GoalStatus, GoalStatusArray
from geometry_msgs.msg import PoseStamped, Twist
from move_base_msgs.msg import MoveBaseActionResult

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.ros.common import conversions

PERIOD_S = 0.1
SPEED_MPS = 0.5
NEAR_M = 0.05
REPLACED = "This goal was canceled because another goal was recieved by the simple action server"


class Pilot:
    """Stands in for the navigator of one quadcopter.

    Attributes:
        goal: Where it flies to, in ``map``; None without a goal.
        received: How many goals it has got from topics.
        aborts: Fault: it gives up the goal that it has, or gets next.
    """

    def __init__(self, number, pose):
        """Prepare.

        Args:
            number: Number of the robot.
            pose: Returns where the robot is, in ``map``.
        """
        self._number, self._pose = number, pose
        self.goal, self.received, self.aborts = None, 0, False
        self._status, self._count = None, 0

    def run(self):
        """Fly, for ever: the main function of the node."""
        action, i = f"/move_base{self._number}", self._number
        self._results = rospy.Publisher(f"{action}/result", MoveBaseActionResult, queue_size=9)
        self._statuses = rospy.Publisher(f"{action}/status", GoalStatusArray, queue_size=9)
        self._commands = rospy.Publisher(f"/cmd_vel{i}", Twist, queue_size=1)
        rospy.Subscriber(f"{action}/cancel", GoalID, lambda _: self._end(GoalStatus.PREEMPTED))
        rospy.Subscriber(f"/move_base_simple/goal{i}", PoseStamped, self._on_goal)
        while True:
            self._step()
            self._statuses.publish(GoalStatusArray(status_list=self._status_list()))
            rospy.rostime.wallsleep(PERIOD_S)

    def _status_list(self):
        return [] if self._status is None else [self._status]

    def _on_goal(self, message):
        self._end(GoalStatus.PREEMPTED, REPLACED)
        self.received, self._count = self.received + 1, self._count + 1
        now, place = rospy.Time.now(), message.pose.position
        name = f"{rospy.get_name()}-{self._count}-{now.to_sec()}"
        self._status = GoalStatus(GoalID(now, name), GoalStatus.ACTIVE, "")
        self.goal = Pose2D(place.x, place.y)

    def _end(self, status, text=""):
        if self.goal is None:
            return
        self.goal = None
        self._status = GoalStatus(self._status.goal_id, status, text)
        self._results.publish(MoveBaseActionResult(status=self._status))
        self._commands.publish(Twist())

    def _step(self):
        if self.goal is None:
            return
        if self.aborts:
            self.aborts = False
            self._end(GoalStatus.ABORTED, "Robot is oscillating.")
            return
        pose = self._pose()
        x_m, y_m = pose.inverse_transform(self.goal.x_m, self.goal.y_m)
        away_m = math.hypot(x_m, y_m)
        if away_m < NEAR_M:
            self._end(GoalStatus.SUCCEEDED, "Goal reached.")
            return
        gain = min(SPEED_MPS / away_m, 1.0)
        twist = Twist2D(gain * x_m, gain * y_m)
        self._commands.publish(conversions.twist_message(twist))
