"""Provide the services of a navigator: `make_plan` and `clear_costmaps`."""

from __future__ import annotations

import functools
import threading
from typing import Callable, List, Optional, Tuple

import numpy as np
import rospy
from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from std_msgs.msg import Header
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from quad_nav.config.plugins import plugin_name
from quad_nav.errors import InvalidGoal, NoPath, PlanningError
from quad_nav.geometry import Pose2D
from quad_nav.navigator.tick import RobotPoses, State
from quad_nav.plan.carrot import Carrot
from quad_nav.ros.common.conversions import pose_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.nav_messages import goal_from_message, path_message
from quad_nav.ros.common.rospy_repairs import refuse_without_text
from quad_nav.ros.navigator.plan_topics import PlanTopics
from quad_nav.scenario.navigator_host import NavigatorHost
from quad_nav.topics.publishing import Names

Locate = Callable[[], RobotPoses]
"""Returns the robot's poses of now."""
MAX_TOLERANCE_M = 10.0  # of a plan that a service makes


class PlanServices:
    """Serve `~make_plan`, `~<planner>/make_plan` and `~clear_costmaps`."""

    def __init__(
        self,
        host: NavigatorHost,
        topics: PlanTopics,
        lock: threading.RLock,
        locate: Locate,
        names: Names,
    ) -> None:
        """Advertise the services; ``lock`` guards the navigator."""
        self._host, self._navigator = host, host.navigator
        self._topics, self._lock, self._locate, self._names = topics, lock, locate, names
        self._frame = host.navigator.global_costmap.params.global_frame
        self._warnings = ThrottledWarnings()
        self._services = [
            rospy.Service(names("~make_plan"), GetPlan, self._make_plan),
            rospy.Service(names("~clear_costmaps"), Empty, self._clear_costmaps),
        ]
        refuse_without_text(self._services[0])
        self._make_plan_name = self._services[0].resolved_name
        self._of_planner: List[rospy.Service] = []
        self.change_planner()

    def change_planner(self) -> None:
        """Advertise the service of the global planner in use, and that of no other one."""
        planner = plugin_name(self._navigator.params.base_global_planner)
        name = rospy.resolve_name(self._names(f"~{planner}/make_plan"))
        if [one.resolved_name for one in self._of_planner] == [name]:
            return
        for service in self._of_planner:
            service.shutdown()
        self._of_planner = []
        if not isinstance(self._navigator.planner, Carrot):
            handler = functools.partial(self._make_planner_plan, name)
            self._of_planner.append(rospy.Service(name, GetPlan, handler))

    def _make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        with self._lock:
            if self._navigator.state is not State.IDLE:
                raise self._refusal(
                    "move_base must be in an inactive state to make a plan for an external user"
                )
            here, start = self._locate(), None
            if not request.start.header.frame_id:
                start = here.in_global
                if start is None:
                    raise self._refusal("the robot pose is unknown")
            params = self._navigator.params
            if params.make_plan_clear_costmap:
                radius_m = self._host.configuration.clearing_radius_m
                self._navigator.free_surroundings(here, radius_m)
            poses, is_near = self._poses(self._make_plan_name, request, start, request.tolerance)
            if is_near and params.make_plan_add_unreachable_goal:
                poses.append(request.goal)
            return GetPlanResponse(Path(poses=poses))

    def _make_planner_plan(self, name: str, request: GetPlanRequest) -> GetPlanResponse:
        """Plan from pose to pose, as the planners' own services do: the tolerance is not read."""
        with self._lock:
            poses, _ = self._poses(name, request, None, 0.0)
            return GetPlanResponse(Path(Header(0, rospy.Time.now(), self._frame), poses))

    def _refusal(self, reason: str) -> rospy.ServiceException:
        """Return the error that a client gets; the original says nothing."""
        self._warnings.error(f"{self._make_plan_name}: refused: {reason}")
        explains = self._navigator.params.check_goals
        return rospy.ServiceException(reason if explains else "")

    def _poses(
        self, name: str, request: GetPlanRequest, start: Optional[Pose2D], tolerance_m: float
    ) -> Tuple[List[PoseStamped], bool]:
        """Plan, and publish what was found; ``name`` is the service's.

        Returns:
            The poses, none without a plan, and True if they lead to a point beside the goal.
        """
        now = rospy.Time.now()
        try:
            goal = self._in_plane("goal", request.goal)
            start = start or self._in_plane("start", request.start)
            if self._navigator.params.check_goals and not tolerance_m <= MAX_TOLERANCE_M:
                # Every cell within it may be planned to, while the robot stands still.
                raise InvalidGoal(
                    f"tolerance {tolerance_m:g} m, expected {MAX_TOLERANCE_M:g} m at most"
                )
            plan, is_near = self._navigator.plan_near(start, goal, tolerance_m)
        except (InvalidGoal, PlanningError) as error:
            self._warnings.warn(f"{name}: no plan: {error}", f"{name}: {type(error).__name__}")
            if isinstance(error, NoPath):
                self._topics.publish_no_plan(now)
            return [], False
        self._topics.publish_plan(plan, now)
        poses: List[PoseStamped] = path_message(plan, self._frame, now).poses
        end, wanted = poses[-1].pose, request.goal.pose
        end.position.z = wanted.position.z
        if plan[-1, 2] == goal.yaw_rad:  # planners copy the goal, whatever its quaternion
            end.orientation = wanted.orientation
        return poses, is_near

    def _in_plane(self, what: str, message: PoseStamped) -> Pose2D:
        """Return a pose of a request.

        Raises:
            InvalidGoal: It is in another frame, or nothing can be planned with it.
        """
        is_checked, frame = self._navigator.params.check_goals, message.header.frame_id
        if (frame.lstrip("/") if is_checked else frame) != self._frame.lstrip("/"):
            raise InvalidGoal(f"the {what} is in frame '{frame}', expected '{self._frame}'")
        if is_checked:
            return goal_from_message(message.pose).to_2d()
        pose = pose_from_message(message.pose).to_2d()
        if not np.isfinite((pose.x_m, pose.y_m)).all():
            raise InvalidGoal(f"the {what} is not on the global costmap")
        return pose

    def _clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            self._navigator.clear_costmaps(rospy.get_time())
        return EmptyResponse()
