"""Publish the results of a tick on the topics of move_base: command, plans, scores, state."""

from __future__ import annotations

from typing import Any, List

import numpy as np
import rospy
from geometry_msgs.msg import Twist
from move_base_msgs.msg import RecoveryStatus
from nav_msgs.msg import OccupancyGrid, Path
from roslib.message import get_message_class
from sensor_msgs.msg import PointCloud2

from quad_nav.config.plugins import plugin_name
from quad_nav.control.controller import Control
from quad_nav.control.dwa_planner import DwaPlanner
from quad_nav.geometry import Pose3D
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.tick import Tick
from quad_nav.plan.global_planner import SearchPlanner
from quad_nav.plan.navfn import Navfn
from quad_nav.ros.common.conversions import time_message, twist_message
from quad_nav.ros.common.nav_messages import (
    cloud_message,
    cost_cloud_message,
    path_message,
    pose_stamped,
    potential_message,
)
from quad_nav.ros.common.own_messages import stamped
from quad_nav.topics.publishing import Names
from quad_nav.topics.robot_topics import ROBOT_TOPICS, RobotTopicSchedule

_TRAJECTORY = ("x", "y", "z", "theta", "cost")


class PlanTopics:
    """Publish command, plans, scores, state, right of way and recoveries."""

    def __init__(self, navigator: Navigator, names: Names) -> None:
        self._navigator = navigator
        self._global_frame = navigator.global_costmap.params.global_frame
        self._local_frame = navigator.local_costmap.params.global_frame
        self._names = names
        self._command = rospy.Publisher(names("cmd_vel"), Twist, queue_size=1)
        self._of_planners: List[rospy.Publisher] = []
        self.change_planners()
        self._schedule = RobotTopicSchedule()
        self._of_robot = {
            topic.name: rospy.Publisher(
                names(f"~{topic.name}"),
                get_message_class(topic.kind),
                queue_size=10,
                latch=topic.is_latched,
            )
            for topic in ROBOT_TOPICS
        }
        self._recovery = rospy.Publisher(
            names("move_base/recovery_status"), RecoveryStatus, queue_size=1
        )

    def change_planners(self) -> None:
        """Advertise the topics of the planners in use, and those of no other ones.

        A topic that stays is advertised twice for a moment, so that its subscribers stay.
        """
        before, self._of_planners = self._of_planners, []
        params = self._navigator.params
        planner = f"~{plugin_name(params.base_global_planner)}"
        controller = f"~{plugin_name(params.base_local_planner)}"
        self._plan = self._advertise(f"{planner}/plan", Path, 2)
        if isinstance(self._navigator.planner, SearchPlanner):
            self._potential = self._advertise(f"{planner}/potential", OccupancyGrid)
        self._global_plan = self._advertise(f"{controller}/global_plan", Path)
        self._local_plan = self._advertise(f"{controller}/local_plan", Path)
        self._cost_cloud = self._advertise(f"{controller}/cost_cloud", PointCloud2)
        if isinstance(self._navigator.controller, DwaPlanner):
            self._trajectory_cloud = self._advertise(f"{controller}/trajectory_cloud", PointCloud2)
        for publisher in before:
            publisher.unregister()

    def _advertise(self, name: str, type_: Any, queue_size: int = 1) -> rospy.Publisher:
        publisher = rospy.Publisher(self._names(name), type_, queue_size=queue_size)
        self._of_planners.append(publisher)
        return publisher

    def publish(self, tick: Tick, pose: Pose3D, pose_s: float) -> None:
        """Publish the results of a tick; `pose` is the robot's in the global frame at `pose_s`."""
        now = time_message(tick.now_s)
        for topic, fields in self._schedule.pop(tick, pose.to_2d()):
            publisher = self._of_robot[topic.name]
            if topic.is_latched or publisher.get_num_connections():
                publisher.publish(stamped(publisher.data_class, fields, tick.now_s))
        if tick.command is not None:
            self._command.publish(twist_message(tick.command))
        if tick.plan is not None:
            self.publish_plan(tick.plan, now)
        if tick.no_path:
            self.publish_no_plan(now)
        if tick.plan is not None or tick.no_path:
            self._publish_potential(now)
        if tick.recovery is not None:
            self._recovery.publish(
                RecoveryStatus(
                    pose_stamped(pose, self._global_frame, time_message(pose_s)),
                    tick.recovery.index,
                    tick.recovery.total,
                    tick.recovery.name,
                )
            )
        if tick.control is not None:
            self._publish_control(tick.control, now)
        if tick.cycle:
            self._publish_trajectories(now)

    def publish_plan(self, plan: np.ndarray, now: rospy.Time) -> None:
        """Publish a plan.

        NavFn's plan is published twice, as in C++ move_base: without and with the goal pose.

        Args:
            plan: float64, shape (n, 3): x and y in m, yaw in rad, in the global frame.
            now: Stamp of the message.
        """
        if self._plan.get_num_connections() == 0:
            return
        message = path_message(plan, self._global_frame, now)
        if isinstance(self._navigator.planner, Navfn):
            self._plan.publish(Path(message.header, message.poses[:-1]))
        self._plan.publish(message)

    def publish_no_plan(self, now: rospy.Time) -> None:
        """Remove the previous plan from displays."""
        if self._plan.get_num_connections() > 0:
            self._plan.publish(path_message(np.zeros((0, 3)), self._global_frame, now))

    def _publish_potential(self, now: rospy.Time) -> None:
        planner = self._navigator.planner
        if (
            isinstance(planner, SearchPlanner)
            and planner.params.publish_potential
            and planner.potential is not None
            and self._potential.get_num_connections() > 0
        ):
            self._potential.publish(
                potential_message(
                    self._navigator.global_costmap.spec,
                    planner.potential,
                    planner.params.publish_scale,
                    self._global_frame,
                    now,
                )
            )

    def _publish_control(self, control: Control, now: rospy.Time) -> None:
        if len(control.global_plan) and self._global_plan.get_num_connections() > 0:
            self._global_plan.publish(
                path_message(control.global_plan, self._local_frame, rospy.Time(0))
            )
        if len(control.local_plan) and self._local_plan.get_num_connections() > 0:
            self._local_plan.publish(path_message(control.local_plan, self._local_frame, now))
        if self._cost_cloud.get_num_connections() > 0:
            points = self._navigator.controller.cost_cloud()
            if len(points):
                spec = self._navigator.local_costmap.spec
                cells = spec.size_x * spec.size_y
                self._cost_cloud.publish(cost_cloud_message(points, cells, self._local_frame, now))

    def _publish_trajectories(self, now: rospy.Time) -> None:
        controller = self._navigator.controller
        if (
            isinstance(controller, DwaPlanner)
            and controller.params.publish_traj_pc
            and self._trajectory_cloud.get_num_connections() > 0
        ):
            points, params = controller.pop_trajectories(), controller.params
            own, upstream = self._local_frame, params.global_frame_id
            frame = own if params.stamp_frame_of_costmap else upstream
            if points is not None:
                self._trajectory_cloud.publish(cloud_message(points, _TRAJECTORY, frame, now))

    def stop(self) -> None:
        """Publish a zero velocity."""
        self._command.publish(Twist())
