"""Provide the services of a navigator: `make_plan` and `clear_costmaps`."""

from __future__ import annotations

import threading
from typing import Callable, List

import rospy
from nav_msgs.srv import GetPlan, GetPlanRequest, GetPlanResponse
from std_srvs.srv import Empty, EmptyRequest, EmptyResponse

from quad_nav.config.plugins import plugin_name
from quad_nav.errors import InvalidGoal, PlanningError
from quad_nav.geometry import Pose2D
from quad_nav.navigator.tick import RobotPoses, State
from quad_nav.ros.common.nav_messages import goal_from_message, path_message
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
        self._topics, self._lock, self._locate = topics, lock, locate
        self._names = names
        self._services = [
            rospy.Service(names("~make_plan"), GetPlan, self._make_plan),
            rospy.Service(names("~clear_costmaps"), Empty, self._clear_costmaps),
        ]
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
        self._of_planner = [rospy.Service(name, GetPlan, self._make_planner_plan)]

    def _make_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        with self._lock:
            if self._navigator.state is not State.IDLE:
                raise rospy.ServiceException(
                    "move_base must be in an inactive state to make a plan for an external user"
                )
            if self._navigator.params.make_plan_clear_costmap:
                radius_m = self._host.configuration.clearing_radius_m
                self._navigator.free_surroundings(self._locate(), radius_m)
            return self._plan_response(request)

    def _make_planner_plan(self, request: GetPlanRequest) -> GetPlanResponse:
        with self._lock:
            return self._plan_response(request)

    def _plan_response(self, request: GetPlanRequest) -> GetPlanResponse:
        frame = self._navigator.global_costmap.params.global_frame
        self._check_frame("goal", request.goal.header.frame_id, frame)
        if request.start.header.frame_id:
            self._check_frame("start", request.start.header.frame_id, frame)
        if not abs(request.tolerance) <= MAX_TOLERANCE_M:
            # Every cell within it may be planned to, while the robot stands still.
            raise rospy.ServiceException(
                f"tolerance {request.tolerance:g} m, expected {MAX_TOLERANCE_M:g} m at most"
            )
        try:
            goal = goal_from_message(request.goal.pose).to_2d()
            plan = self._navigator.make_plan(self._start(request), goal, request.tolerance)
        except InvalidGoal as error:
            raise rospy.ServiceException(str(error)) from error
        except PlanningError as error:
            rospy.logwarn("%s: no plan: %s", self._services[0].resolved_name, error)
            return GetPlanResponse()
        now = rospy.Time.now()
        self._topics.publish_plan(plan, now)
        response = GetPlanResponse()
        response.plan.poses = path_message(plan, frame, now).poses
        return response

    def _check_frame(self, what: str, frame: str, expected: str) -> None:
        if frame.lstrip("/") != expected.lstrip("/"):
            raise rospy.ServiceException(f"the {what} is in frame '{frame}', expected '{expected}'")

    def _start(self, request: GetPlanRequest) -> Pose2D:
        if request.start.header.frame_id:
            return goal_from_message(request.start.pose).to_2d()
        here = self._locate().in_global
        if here is None:
            raise rospy.ServiceException("the robot pose is unknown")
        return here

    def _clear_costmaps(self, _: EmptyRequest) -> EmptyResponse:
        with self._lock:
            self._navigator.clear_costmaps(rospy.get_time())
        return EmptyResponse()
