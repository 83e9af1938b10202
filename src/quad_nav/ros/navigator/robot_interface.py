"""The ROS interface of one robot's navigator: what it publishes, and what people ask of it.

Topics, services, action, parameters, maps and health are the same wherever the other inputs come
from: topics, see `robot_navigator`, or the simulation in the same process, see `ros/composed`.
"""

from __future__ import annotations

import threading
from typing import Any, Callable, Dict, Optional, Sequence, Tuple

import rospy

from quad_nav import config
from quad_nav.config.planners import SLOTS
from quad_nav.config.plugins import plugin_name
from quad_nav.errors import InputError, PluginError
from quad_nav.navigator.tick import Outcome, RobotPoses, Tick
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import LocatedPose, Transforms
from quad_nav.ros.navigator import static_maps
from quad_nav.ros.navigator.costmap_publisher import CostmapPublisher
from quad_nav.ros.navigator.goal_server import GoalServer
from quad_nav.ros.navigator.health_meters import InputMeter, NavigatorHealth
from quad_nav.ros.navigator.obstacle_topics import ObstacleTopics
from quad_nav.ros.navigator.plan_services import Locate, PlanServices
from quad_nav.ros.navigator.plan_topics import PlanTopics
from quad_nav.ros.navigator.reconfigure import ParameterServers
from quad_nav.scenario.navigator_host import NavigatorHost
from quad_nav.scenario.warm_up import warm_up
from quad_nav.topics.publishing import Names, own_node


class RobotInterface:
    """Topics, services, action and parameters of one robot.

    Attributes:
        name: Name of the robot, for messages.
        lock: Guards the navigator against services and reconfiguration, which run in rospy's
            threads.
        warnings: Logs the robot's warnings.
        on_request: Called when a goal or another request has come.
        health: Meters of the navigator.
    """

    def __init__(
        self,
        host: NavigatorHost,
        transforms: Transforms,
        locate: Locate,
        names: Names,
        inputs: Sequence[InputMeter],
    ) -> None:
        """Advertise all; ``transforms`` are for goals in other frames."""
        number = host.configuration.robot
        self.name = f"quad{number}"
        self.lock = threading.RLock()
        self.warnings = ThrottledWarnings()
        self.on_request: Callable[[], None] = lambda: None
        self._host, self._navigator = host, host.navigator
        self._publishers = {
            name: CostmapPublisher(f"{name}_costmap", costmap, self.lock, names)
            for name, costmap in zip(("global", "local"), host.costmaps)
        }
        global_frame, local_frame = (one.params.global_frame for one in host.costmaps)
        self._topics = PlanTopics(host.navigator, names)
        self._obstacles = ObstacleTopics(host.scan_filters, local_frame, names)
        self._names, self._changing = names, threading.Lock()
        self._services = PlanServices(host, self._topics, self.lock, locate, names)
        with self._changing:
            self._parameters = ParameterServers(
                self.name, host.configuration, self._on_reconfigure, names
            )
        self._goals = GoalServer(number, transforms, global_frame, names, lambda: self.on_request())
        self._maps = static_maps.connect(host.costmaps, self.lock, names)
        node = rospy.get_name() if names is own_node else names("~")
        self.health = NavigatorHealth(node.strip("/"), self.name, inputs)

    def _on_reconfigure(self, namespace: str, changes: Dict[str, Any]) -> config.Configuration:
        with self._changing:
            before = self._host.configuration
            stored = self._stored_planners(changes)
            changed = config.updated(before, namespace, changes, stored)
            if planners_of(changed) == planners_of(before):
                with self.lock:
                    self._host.reconfigure(changed)
            else:
                self._change_planners(changed)
        self.on_request()
        return changed

    def _stored_planners(self, changes: Dict[str, Any]) -> Dict[str, Any]:
        """Return the parameters of the planners among the changes, as the server has them."""
        names = [plugin_name(changes[key]) for key in SLOTS if key in changes]
        stored = {name: rospy.get_param(self._names(f"~{name}"), None) for name in names}
        return {name: found for name, found in stored.items() if found is not None}

    def _change_planners(self, configuration: config.Configuration) -> None:
        """Fly on with other planners; their kernels are compiled before the robot stops."""
        try:
            warm_up(configuration)
            with self.lock:
                self._host.reconfigure(configuration)
                self._topics.change_planners()
        except PluginError as error:
            raise InputError([str(error)]) from error
        rospy.loginfo("%s: planners: %s", self.name, " and ".join(planners_of(configuration)))
        self._services.change_planner()
        self._parameters.change_planners(configuration)

    def poll(self, now_s: float) -> None:
        """Pass a waiting goal or cancel request to the navigator, if it accepts one now."""
        self._goals.poll(self._navigator, now_s)

    def restart(self, now_s: float) -> None:
        """Restart all schedules after a clock jump."""
        self._goals.restart(now_s)
        self._obstacles.restart(now_s)
        for publisher in self._publishers.values():
            publisher.restart(now_s)

    def stop(self) -> None:
        """Publish a zero velocity; the quadcopter hovers."""
        self._topics.stop()

    def abort(self, error: PluginError) -> None:
        """Log a plugin's mistake, stop, and abort the goal."""
        self.warnings.error(f"{self.name}: {error}")
        self.stop()
        self._navigator.cancel()
        self._goals.finish(Outcome(False, str(error)))

    def publish(self, tick: Tick, in_global: Optional[LocatedPose], located: RobotPoses) -> None:
        """Publish and log the results of a tick.

        Args:
            tick: The tick.
            in_global: The robot's pose in the global frame, None if unknown.
            located: The poses that the navigator was given.
        """
        self.health.expected_hz = self._navigator.params.controller_frequency_hz
        self.health.update(tick, located, self._host.wall_s)
        self._log(tick)
        if in_global is not None:
            if tick.cycle:
                stamp = time_message(in_global.stamp_s)
                self._goals.publish_feedback(in_global.pose, stamp)
            self._topics.publish(tick, *in_global)
        elif tick.command is not None:
            self._topics.stop()
        self._obstacles.publish(tick.now_s)
        poses = {"global": located.in_global, "local": located.in_local}
        for name, window in tick.windows.items():
            pose = poses[name]
            assert pose is not None  # a costmap is updated at a known pose only
            self._publishers[name].publish(tick.now_s, pose, window)
        self._goals.finish(tick.outcome)

    def _log(self, tick: Tick) -> None:
        for warning in tick.warnings:
            self.warnings.warn(f"{self.name}: {warning}")
        for note in tick.notes:
            rospy.loginfo("%s: %s", self.name, note)
        if tick.planning_failed:
            self.warnings.warn(f"{self.name}: no plan: {tick.planning_failed}")
        if tick.recovery is not None:
            rospy.logwarn(
                "%s: recovery %d of %d: %s",
                self.name,
                tick.recovery.index + 1,
                tick.recovery.total,
                tick.recovery.name,
            )


def planners_of(configuration: config.Configuration) -> Tuple[str, str]:
    """Return the names of a configuration's planners."""
    params = configuration.navigator
    return params.base_global_planner, params.base_local_planner
