"""The node ``move_base``: one robot's navigator on ROS.

Callbacks store; the main loop takes a snapshot, ticks the navigator at the times
it asks for, and publishes what the tick says. One lock guards the navigator
against services and reconfiguration, which run in rospy's threads.
"""
from __future__ import annotations

import sys
import threading
from typing import Optional

import rospy
from nav_msgs.msg import Odometry
from nav_msgs.srv import GetPlan, GetPlanResponse
from std_srvs.srv import Empty, EmptyResponse

from quad_nav import config
from quad_nav.assembly import apply_configuration, build_navigator
from quad_nav.errors import InputError, InvalidGoal, PlanningError
from quad_nav.geometry import Pose3D, Twist2D
from quad_nav.plugins import plugin_name
from quad_nav.ros import sensors, static_maps
from quad_nav.ros.convert import twist_from_message
from quad_nav.ros.costmap_publisher import CostmapPublisher
from quad_nav.ros.goal_server import GoalServer
from quad_nav.ros.nav_messages import goal_from_message, path_message
from quad_nav.ros.peer_topics import PeerTopics
from quad_nav.ros.plan_topics import PlanTopics
from quad_nav.ros.reconfigure import serve_namespaces
from quad_nav.ros.signals import init_node
from quad_nav.ros.silence import SilenceWatch
from quad_nav.ros.transforms import Transforms
from quad_nav.tick import Located, State, Tick
from quad_nav.warm_up import warm_up

IDLE_POLL_S = 0.05  # how soon a goal for an idle navigator is noticed
WARN_AGAIN_S = 5.0
EXIT_BAD_INPUT = 2


class MoveBaseNode:
    """Connects a navigator to its topics, services and action."""

    def __init__(self, configuration: config.Configuration):
        self._configuration = configuration
        self._navigator = build_navigator(configuration)
        self._lock = threading.RLock()
        self._velocity = Twist2D()
        self._transforms = Transforms()
        navigator = self._navigator
        costmaps = (navigator.global_costmap, navigator.local_costmap)
        self._publishers = {
            "global": CostmapPublisher("global_costmap", navigator.global_costmap, self._lock),
            "local": CostmapPublisher("local_costmap", navigator.local_costmap, self._lock)}
        self._topics = PlanTopics(navigator)
        self._peers = PeerTopics(configuration.robot, configuration.robots, self._transforms,
                                 navigator.global_costmap.params.global_frame)
        self._odometry = rospy.Subscriber("odom", Odometry, self._on_odometry, queue_size=1)
        self._sensors = sensors.connect(costmaps)
        self._maps = static_maps.connect(costmaps, self._lock)
        self._silence = SilenceWatch(
            [self._odometry, *self._peers.subscribers,
             *(sensor.subscriber for sensor in self._sensors)])
        self._reconfigure = serve_namespaces(configuration, self._on_reconfigure)
        planner = plugin_name(navigator.params.base_global_planner)
        self._services = [
            rospy.Service("~make_plan", GetPlan, self._make_plan),
            rospy.Service(f"~{planner}/make_plan", GetPlan, self._make_planner_plan),
            rospy.Service("~clear_costmaps", Empty, self._clear_costmaps)]
        self._goals = GoalServer(self._transforms, navigator.global_costmap.params.global_frame)

    # -- callbacks -----------------------------------------------------------------

    def _on_odometry(self, message: Odometry) -> None:
        self._velocity = twist_from_message(message.twist.twist)

    def _on_reconfigure(self, namespace: str, changes: dict) -> config.Configuration:
        with self._lock:
            configuration = config.updated(self._configuration, namespace, changes)
            apply_configuration(self._navigator, configuration)
            self._configuration = configuration
            return configuration

    # -- services ------------------------------------------------------------------

    def _make_plan(self, request) -> GetPlanResponse:
        with self._lock:
            if self._navigator.state is not State.IDLE:
                raise rospy.ServiceException(
                    "move_base must be in an inactive state to make a plan for an external user")
            if self._navigator.params.make_plan_clear_costmap:
                self._free_surroundings(rospy.get_time())
            return self._plan_response(request, self._navigator.make_plan)

    def _make_planner_plan(self, request) -> GetPlanResponse:
        with self._lock:
            return self._plan_response(request, self._navigator.make_plan)

    def _free_surroundings(self, now_s: float) -> None:
        in_global = self._locate(self._navigator.global_costmap, now_s)
        self._navigator.free_surroundings(
            self._located(in_global, now_s), self._configuration.clearing_radius_m)

    def _plan_response(self, request, make_plan) -> GetPlanResponse:
        frame = self._navigator.global_costmap.params.global_frame
        if request.goal.header.frame_id.lstrip("/") != frame:
            raise rospy.ServiceException(
                f"the goal is in frame '{request.goal.header.frame_id}', expected '{frame}'")
        try:
            goal = goal_from_message(request.goal.pose).to_2d()
            if request.start.header.frame_id:
                start = goal_from_message(request.start.pose).to_2d()
            else:
                here = self._locate(self._navigator.global_costmap, rospy.get_time())
                if here is None:
                    raise rospy.ServiceException("the robot's pose is unknown")
                start = here.to_2d()
            plan = make_plan(start, goal, request.tolerance)
        except InvalidGoal as error:
            raise rospy.ServiceException(str(error)) from error
        except PlanningError as error:
            rospy.logwarn("make_plan: %s", error)
            return GetPlanResponse()
        now = rospy.Time.now()
        self._topics.plan(plan, now)
        response = GetPlanResponse()
        response.plan.poses = path_message(plan, frame, now).poses
        return response

    def _clear_costmaps(self, _) -> EmptyResponse:
        with self._lock:
            self._navigator.clear_costmaps(rospy.get_time())
        return EmptyResponse()

    # -- the loop ------------------------------------------------------------------

    def spin(self) -> None:
        rospy.on_shutdown(self._topics.stop)
        while rospy.get_time() == 0.0 and not rospy.is_shutdown():
            self._silence.check_clock()
            rospy.rostime.wallsleep(0.05)
        while not rospy.is_shutdown():
            now_s = rospy.get_time()
            with self._lock:
                self._step(now_s)
                due_s = self._navigator.next_due_s
            self._silence.check(now_s)
            try:
                rospy.sleep(min(max(due_s - rospy.get_time(), 0.001), IDLE_POLL_S))
            except rospy.exceptions.ROSTimeMovedBackwardsException:
                rospy.logwarn("time moved backwards: the schedule starts anew")
                with self._lock:
                    self._navigator.restart(rospy.get_time())

    def _step(self, now_s: float) -> None:
        navigator = self._navigator
        for sensor in self._sensors:
            sensor.deliver(self._transforms)
        self._goals.poll(navigator, now_s)
        self._peers.tell(navigator.intention, now_s)
        if navigator.next_due_s > now_s + 1e-9 and not navigator.has_work:
            return
        in_global = self._locate(navigator.global_costmap, now_s)
        located = self._located(in_global, now_s)
        tick = navigator.tick(now_s, located, self._velocity, self._peers.peers(now_s))
        self._publish(tick, in_global, located)

    def _locate(self, costmap, now_s: float) -> Optional[Pose3D]:
        params = costmap.params
        return self._transforms.locate(
            params.global_frame, params.robot_base_frame, now_s, params.transform_tolerance_s)

    def _located(self, in_global: Optional[Pose3D], now_s: float) -> Located:
        in_local = self._locate(self._navigator.local_costmap, now_s)
        return Located(in_global.to_2d() if in_global else None,
                       in_local.to_2d() if in_local else None)

    def _publish(self, tick: Tick, in_global: Optional[Pose3D], located: Located) -> None:
        for warning in tick.warnings:
            rospy.logwarn_throttle_identical(WARN_AGAIN_S, warning)
        for note in tick.notes:
            rospy.loginfo("%s", note)
        if tick.planning_failed:
            rospy.logwarn_throttle_identical(WARN_AGAIN_S, "no plan: " + tick.planning_failed)
        if tick.recovery is not None:
            rospy.logwarn("recovery %d of %d: %s", tick.recovery.index + 1, tick.recovery.total,
                          tick.recovery.name)
        if in_global is not None:
            self._topics.publish(tick, in_global)
            if tick.cycle:
                self._goals.feedback(in_global, rospy.Time.from_sec(tick.now_s))
        elif tick.command is not None:
            self._topics.stop()
        poses = {"global": located.in_global, "local": located.in_local}
        for name, window in tick.windows.items():
            pose = poses[name]
            assert pose is not None  # a costmap is updated at a known pose only
            self._publishers[name].updated(tick.now_s, pose, window)
        self._goals.finish(tick.outcome)


def main() -> int:
    """Exit status: 0 at shutdown, 2 for parameters that cannot be used."""
    init_node("move_base")
    name = rospy.get_name()
    try:
        configuration = config.load(rospy.get_param("~", {}), name)
        for warning in configuration.warnings:
            rospy.logwarn("%s", warning)
        warm_up(configuration)
        node = MoveBaseNode(configuration)
    except InputError as error:
        rospy.logfatal("%s: its parameters can't be used:\n%s", name, error)
        print(f"{name}: its parameters can't be used:\n{error}", file=sys.stderr)
        return EXIT_BAD_INPUT
    try:
        node.spin()
    except rospy.ROSInterruptException:
        return 0  # a shutdown ends the loop's sleep in this way
    return 0
