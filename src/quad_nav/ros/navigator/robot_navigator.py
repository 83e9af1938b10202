"""Connect one robot's navigator to ROS: topics, services, action and parameters.

Callbacks store messages. `step` takes a snapshot, ticks the navigator when a tick is due and
publishes the results. One lock guards the navigator against services and reconfiguration, which
run in rospy's threads.
"""

from __future__ import annotations

import threading
from typing import Any, Dict, List, Optional, Tuple

import rospy
from nav_msgs.msg import Odometry

from quad_nav import config
from quad_nav.errors import PluginError
from quad_nav.geometry import Pose3D, Twist2D
from quad_nav.navigator.tick import Outcome, RobotPoses, Tick
from quad_nav.ros.common.conversions import odometry_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator import sensors, static_maps
from quad_nav.ros.navigator.costmap_publisher import CostmapPublisher
from quad_nav.ros.navigator.goal_server import GoalServer
from quad_nav.ros.navigator.health_meters import InputMeter, NavigatorHealth
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.plan_services import PlanServices
from quad_nav.ros.navigator.plan_topics import PlanTopics
from quad_nav.ros.navigator.reconfigure import serve_namespaces
from quad_nav.scenario.assembly import apply_configuration, build_navigator
from quad_nav.topics.publishing import Names, own_node
from quad_nav.topics.validation import odometry_problem

POLL_S = 0.05  # delay after which an idle navigator notices a goal


class RobotNavigator:
    """A navigator with its topics, services and action.

    Attributes:
        number: Number of the robot.
        name: Name of the robot, for messages.
        due_s: Time at which `step` is due.
        health: Meters of the navigator.
    """

    def __init__(
        self,
        configuration: config.Configuration,
        transforms: Transforms,
        peers: PeerTopics,
        names: Names = own_node,
    ) -> None:
        """Build the navigator and connect it.

        Args:
            configuration: Parameters of the robot.
            transforms: Transform tree, shared by the robots of the process.
            peers: States of the peers, shared as well.
            names: Names of the robot's topics, services and parameters.
        """
        self.number = configuration.robot
        self.name = f"quad{self.number}"
        self.due_s = 0.0
        self._warnings, self._configuration = ThrottledWarnings(), configuration
        self._navigator = navigator = build_navigator(configuration)
        self._lock = threading.RLock()
        self._velocity = Twist2D()
        self._odometry_s: Optional[float] = None  # time of the last odometry message
        self._transforms, self._peers = transforms, peers
        costmaps = (navigator.global_costmap, navigator.local_costmap)
        self._publishers = {
            name: CostmapPublisher(f"{name}_costmap", costmap, self._lock, names)
            for name, costmap in zip(("global", "local"), costmaps)
        }
        self._topics = PlanTopics(navigator, names)
        self._odometry = rospy.Subscriber(names("odom"), Odometry, self._on_odometry, queue_size=1)
        self._sensors = sensors.connect(self.name, costmaps, configuration.scan_validator, names)
        self._maps = static_maps.connect(costmaps, self._lock, names)
        self._reconfigure = serve_namespaces(self.name, configuration, self._on_reconfigure, names)
        self._services = self._advertise_services(names)
        self._goals = GoalServer(
            self.name, transforms, navigator.global_costmap.params.global_frame, names
        )
        self.health = self._new_health(names)

    @property
    def subscribers(self) -> List[rospy.Subscriber]:
        """Subscribers to the topics that the navigator needs."""
        return [self._odometry, *(sensor.subscriber for sensor in self._sensors)]

    def _advertise_services(self, names: Names) -> PlanServices:
        return PlanServices(
            self._navigator,
            self._topics,
            self._lock,
            self._located_now,
            lambda: self._configuration.clearing_radius_m,
            names,
        )

    def _new_health(self, names: Names) -> NavigatorHealth:
        node = rospy.get_name() if names is own_node else names("~")
        return NavigatorHealth(
            node.strip("/"),
            self.name,
            [
                InputMeter(self._odometry),
                *(
                    InputMeter(sensor.subscriber, sensor.intake.expected_period_s)
                    for sensor in self._sensors
                ),
            ],
        )

    def step(self, now_s: float) -> None:
        """Do the work that is due at a time; a plugin's mistake aborts the goal."""
        with self._lock:
            try:
                self._step(now_s)
            except PluginError as error:
                self._warnings.error(f"{self.name}: {error}")
                self._topics.stop()
                self._navigator.cancel()
                self._goals.finish(Outcome(False, str(error)))
            self.due_s = max(min(self._navigator.next_due_s, now_s + POLL_S), now_s)

    def restart(self, now_s: float) -> None:
        """Discard messages and restart all schedules after a clock jump."""
        with self._lock:
            for sensor in self._sensors:
                sensor.reset()
            self._odometry_s = None
            self._navigator.restart(now_s)
            self._goals.restart(now_s)
            for publisher in self._publishers.values():
                publisher.restart(now_s)
            self.due_s = now_s

    def stop(self) -> None:
        """Publish a zero velocity; the quadcopter hovers."""
        self._topics.stop()

    # -- callbacks -----------------------------------------------------------------

    def _on_odometry(self, message: Odometry) -> None:
        odom_from_base, velocity = odometry_from_message(message)
        problem = odometry_problem(message.header.frame_id, odom_from_base, velocity)
        if problem:
            self._warnings.warn(f"{self.name}: odometry dropped: {problem}")
        else:
            self._velocity, self._odometry_s = velocity, rospy.get_time()

    def _on_reconfigure(self, namespace: str, changes: Dict[str, Any]) -> config.Configuration:
        with self._lock:
            configuration = config.updated(self._configuration, namespace, changes)
            apply_configuration(self._navigator, configuration)
            for sensor in self._sensors:
                sensor.intake.reconfigure(configuration.scan_validator)
            self._configuration = configuration
            return configuration

    # -- a step --------------------------------------------------------------------

    def _step(self, now_s: float) -> None:
        navigator = self._navigator
        for sensor in self._sensors:
            sensor.deliver(self._transforms)
        self._goals.poll(navigator, now_s)
        self._peers.publish(self.number, navigator.peers.intention, now_s)
        if navigator.next_due_s > now_s + 1e-9 and not navigator.has_work:
            return
        for costmap in (navigator.global_costmap, navigator.local_costmap):
            static_maps.place_maps(self.name, costmap, self._transforms, self._warnings)
        in_global, located = self._locate(now_s)
        peers = self._peers.near(self.number, located.in_global, navigator.peers.reach_m)
        tick = navigator.tick(now_s, located, self._velocity, peers)
        self.health.expected_hz = navigator.params.controller_frequency_hz
        self.health.update(tick, located)
        self._publish(tick, in_global, located)

    def _locate(self, now_s: float) -> Tuple[Optional[Pose3D], RobotPoses]:
        """Return the robot's pose in the global costmap's frame, and in those of both costmaps.

        Without odometry the velocity is unknown, so the poses count as unknown as well.
        """
        timeout = self._odometry_timeout(now_s)
        if timeout:
            return None, RobotPoses(None, None, timeout)
        costmaps = (self._navigator.global_costmap.params, self._navigator.local_costmap.params)
        in_global, in_local = self._transforms.locate_in(
            [
                (params.global_frame, params.robot_base_frame, params.transform_tolerance_s)
                for params in costmaps
            ],
            now_s,
        )
        return in_global, RobotPoses(
            in_global.to_2d() if in_global else None, in_local.to_2d() if in_local else None
        )

    def _odometry_timeout(self, now_s: float) -> str:
        """Say that odometry has timed out; "" before the first message."""
        limit_s, received_s = self._navigator.params.sensor_timeout_s, self._odometry_s
        if limit_s <= 0.0 or received_s is None or now_s - received_s <= limit_s:
            return ""
        return f"no message on {self._odometry.resolved_name} for {now_s - received_s:.1f} s"

    def _located_now(self) -> Tuple[float, RobotPoses]:
        now_s = rospy.get_time()
        return now_s, self._locate(now_s)[1]

    def _publish(self, tick: Tick, in_global: Optional[Pose3D], located: RobotPoses) -> None:
        for warning in tick.warnings:
            self._warnings.warn(f"{self.name}: {warning}")
        for note in tick.notes:
            rospy.loginfo("%s: %s", self.name, note)
        if tick.planning_failed:
            self._warnings.warn(f"{self.name}: no plan: {tick.planning_failed}")
        if tick.recovery is not None:
            rospy.logwarn(
                "%s: recovery %d of %d: %s",
                self.name,
                tick.recovery.index + 1,
                tick.recovery.total,
                tick.recovery.name,
            )
        if in_global is not None:
            self._topics.publish(tick, in_global)
            if tick.cycle:
                self._goals.publish_feedback(in_global, rospy.Time.from_sec(tick.now_s))
        elif tick.command is not None:
            self._topics.stop()
        poses = {"global": located.in_global, "local": located.in_local}
        for name, window in tick.windows.items():
            pose = poses[name]
            assert pose is not None  # a costmap is updated at a known pose only
            self._publishers[name].publish(tick.now_s, pose, window)
        self._goals.finish(tick.outcome)
