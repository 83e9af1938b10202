"""The ROS interface of one robot's navigator: what it publishes, and what people ask of it.

Topics, services, action, parameters and health are the same wherever the inputs come from: from
topics, see `robot_navigator`, or from the simulation in the same process, see `ros/composed`.
"""

from __future__ import annotations

import threading
from typing import Any, Callable, Dict, Optional, Sequence, Tuple

import rospy

from quad_nav import config
from quad_nav.costmap.scan_filter import ScanFilters
from quad_nav.costmap.scan_intake import ScanIntake
from quad_nav.errors import PluginError
from quad_nav.geometry import Pose3D
from quad_nav.navigator.navigator import Navigator
from quad_nav.navigator.tick import Outcome, RobotPoses, Tick
from quad_nav.ros.common.conversions import time_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator.costmap_publisher import CostmapPublisher
from quad_nav.ros.navigator.goal_server import GoalServer
from quad_nav.ros.navigator.health_meters import InputMeter, NavigatorHealth
from quad_nav.ros.navigator.obstacle_topics import ObstacleTopics
from quad_nav.ros.navigator.plan_services import PlanServices
from quad_nav.ros.navigator.plan_topics import PlanTopics
from quad_nav.ros.navigator.reconfigure import serve_namespaces
from quad_nav.scenario.assembly import reconfigure_robot
from quad_nav.topics.publishing import Names, own_node


class RobotInterface:
    """Topics, services, action and parameters of one robot.

    Attributes:
        name: Name of the robot, for messages.
        lock: Guards the navigator against services and reconfiguration, which run in rospy's
            threads.
        warnings: Logs the robot's warnings.
        health: Meters of the navigator.
    """

    def __init__(
        self,
        configuration: config.Configuration,
        navigator: Navigator,
        scan_filters: ScanFilters,
        transforms: Transforms,
        locate: Callable[[], Tuple[float, RobotPoses]],
        names: Names = own_node,
        intakes: Sequence[ScanIntake] = (),
        inputs: Sequence[InputMeter] = (),
    ) -> None:
        """Advertise topics, services, action and parameters.

        Args:
            configuration: Parameters of the robot.
            navigator: The navigator.
            scan_filters: Filters of the robot's scans.
            transforms: Transform tree, for goals in other frames.
            locate: Returns the time and the robot's poses.
            names: Names of the robot's topics, services and parameters.
            intakes: Those of the robot's sensors.
            inputs: Meters of the robot's inputs.
        """
        self.name = f"quad{configuration.robot}"
        self.lock = threading.RLock()
        self.warnings = ThrottledWarnings()
        self._configuration, self._navigator = configuration, navigator
        self._intakes, self._scan_filters = intakes, scan_filters
        self._advertise(names, transforms, locate)
        node = rospy.get_name() if names is own_node else names("~")
        self.health = NavigatorHealth(node.strip("/"), self.name, inputs)

    def _advertise(
        self, names: Names, transforms: Transforms, locate: Callable[[], Tuple[float, RobotPoses]]
    ) -> None:
        navigator = self._navigator
        costmaps = (navigator.global_costmap, navigator.local_costmap)
        self._publishers = {
            name: CostmapPublisher(f"{name}_costmap", costmap, self.lock, names)
            for name, costmap in zip(("global", "local"), costmaps)
        }
        self._topics = PlanTopics(self.name, navigator, names)
        self._obstacles = ObstacleTopics(
            self._scan_filters, navigator.local_costmap.params.global_frame, names
        )
        self._reconfigure = serve_namespaces(
            self.name, self._configuration, self._on_reconfigure, names
        )
        self._services = PlanServices(
            navigator,
            self._topics,
            self.lock,
            locate,
            lambda: self._configuration.clearing_radius_m,
            names,
        )
        self._goals = GoalServer(
            self._configuration.robot,
            transforms,
            navigator.global_costmap.params.global_frame,
            names,
        )

    def _on_reconfigure(self, namespace: str, changes: Dict[str, Any]) -> config.Configuration:
        with self.lock:
            configuration = config.updated(self._configuration, namespace, changes)
            reconfigure_robot(configuration, self._navigator, self._scan_filters, self._intakes)
            self._configuration = configuration
            return configuration

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

    def publish(
        self, tick: Tick, in_global: Optional[Pose3D], located: RobotPoses, wall_s: float
    ) -> None:
        """Publish and log the results of a tick.

        Args:
            tick: The tick.
            in_global: The robot's pose in the global frame, None if unknown.
            located: The poses that the navigator was given.
            wall_s: Wall time that the tick took.
        """
        self.health.expected_hz = self._navigator.params.controller_frequency_hz
        self.health.update(tick, located, wall_s)
        self._log(tick)
        if in_global is not None:
            self._topics.publish(tick, in_global)
            if tick.cycle:
                self._goals.publish_feedback(in_global, time_message(tick.now_s))
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
