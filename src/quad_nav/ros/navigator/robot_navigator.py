"""One robot's navigator on ROS: its topics, services, action and parameters.

Callbacks store; ``step`` takes a snapshot, ticks the navigator when it asks for it and
publishes what the tick says. One lock guards the navigator against services and
reconfiguration, which run in rospy's threads.
"""

from __future__ import annotations

import threading
from typing import List, Optional, Tuple

import rospy
from nav_msgs.msg import Odometry

from quad_nav import config
from quad_nav.geometry import Pose3D, Twist2D
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.ros.common.convert import twist_from_message
from quad_nav.ros.common.names import Names, own_node
from quad_nav.ros.common.throttled_warnings import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator import sensors, static_maps
from quad_nav.ros.navigator.costmap_publisher import CostmapPublisher
from quad_nav.ros.navigator.goal_server import GoalServer
from quad_nav.ros.navigator.health import InputMeter, NavigatorHealth
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.plan_services import PlanServices
from quad_nav.ros.navigator.plan_topics import PlanTopics
from quad_nav.ros.navigator.reconfigure import serve_namespaces
from quad_nav.scenario.assembly import apply_configuration, build_navigator
from quad_nav.topics.incoming import twist_problem

POLL_S = 0.05  # how soon a goal for an idle navigator is noticed


class RobotNavigator:
    """Connects a navigator to its topics, services and action.

    ``due_s`` is when ``step`` is to be called next.
    """

    def __init__(
        self,
        configuration: config.Configuration,
        transforms: Transforms,
        peers: PeerTopics,
        names: Names = own_node,
    ):
        self.number = configuration.robot
        self._name = "" if names is own_node else f"quad{self.number}: "
        self.due_s = 0.0
        self._complaints = ThrottledWarnings()
        self._configuration = configuration
        self._navigator = navigator = build_navigator(configuration)
        self._lock = threading.RLock()
        self._velocity = Twist2D()
        self._heard_s: Optional[float] = None  # when the odometry came last
        self._transforms, self._peers = transforms, peers
        costmaps = (navigator.global_costmap, navigator.local_costmap)
        self._publishers = {
            name: CostmapPublisher(f"{name}_costmap", costmap, self._lock, names)
            for name, costmap in zip(("global", "local"), costmaps)
        }
        self._topics = PlanTopics(navigator, names)
        self._odometry = rospy.Subscriber(names("odom"), Odometry, self._on_odometry, queue_size=1)
        self._sensors = sensors.connect(costmaps, names)
        self._maps = static_maps.connect(costmaps, self._lock, names)
        self._reconfigure = serve_namespaces(configuration, self._on_reconfigure, names)
        self._services = PlanServices(
            navigator,
            self._topics,
            self._lock,
            self._located_now,
            lambda: self._configuration.clearing_radius_m,
            names,
        )
        self._goals = GoalServer(transforms, navigator.global_costmap.params.global_frame, names)
        self.health = self._new_health(names)

    @property
    def subscribers(self) -> List[rospy.Subscriber]:
        """Whose silence would be a fault."""
        return [self._odometry, *(sensor.subscriber for sensor in self._sensors)]

    def _new_health(self, names: Names) -> NavigatorHealth:
        node = rospy.get_name() if names is own_node else names("~")
        return NavigatorHealth(
            node.strip("/"),
            f"quad{self.number}",
            [
                InputMeter(self._odometry),
                *(
                    InputMeter(sensor.subscriber, sensor.expected_period_s)
                    for sensor in self._sensors
                ),
            ],
        )

    def step(self, now_s: float) -> None:
        """Does what is due at a time."""
        with self._lock:
            self._step(now_s)
            self.due_s = max(min(self._navigator.next_due_s, now_s + POLL_S), now_s)

    def restart(self, now_s: float) -> None:
        """For a clock that has jumped back."""
        with self._lock:
            for sensor in self._sensors:
                sensor.forget()
            self._heard_s = None
            self._navigator.restart(now_s)
            self._goals.restart(now_s)
            for publisher in self._publishers.values():
                publisher.restart(now_s)
            self.due_s = now_s

    def stop(self) -> None:
        """Sends a last command: hover."""
        self._topics.stop()

    # -- callbacks -----------------------------------------------------------------

    def _on_odometry(self, message: Odometry) -> None:
        velocity = twist_from_message(message.twist.twist)
        problem = twist_problem(velocity)
        if problem:
            self._complaints.say(f"{self._name}odometry is dropped: {problem}")
        else:
            self._velocity, self._heard_s = velocity, rospy.get_time()

    def _on_reconfigure(self, namespace: str, changes: dict) -> config.Configuration:
        with self._lock:
            configuration = config.updated(self._configuration, namespace, changes)
            apply_configuration(self._navigator, configuration)
            self._configuration = configuration
            return configuration

    # -- a step --------------------------------------------------------------------

    def _step(self, now_s: float) -> None:
        navigator = self._navigator
        for sensor in self._sensors:
            sensor.deliver(
                self._transforms, self._configuration.scan_validator.reject_implausible_scans
            )
        self._goals.poll(navigator, now_s)
        self._peers.tell(self.number, navigator.intention, now_s)
        if navigator.next_due_s > now_s + 1e-9 and not navigator.has_work:
            return
        in_global, located = self._locate(now_s)
        peers = self._peers.near(self.number, located.in_global, navigator.peer_reach_m)
        tick = navigator.tick(now_s, located, self._velocity, peers)
        self.health.wanted_hz = navigator.params.controller_frequency_hz
        self.health.ticked(tick, located)
        self._publish(tick, in_global, located)

    def _locate(self, now_s: float) -> Tuple[Optional[Pose3D], RobotPoses]:
        """The robot's pose in the global costmap's frame, and in both.

        Without odometry it is not known how it moves, so where it is counts for nothing.
        """
        silence = self._odometry_silence(now_s)
        if silence:
            return None, RobotPoses(None, None, silence)
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

    def _odometry_silence(self, now_s: float) -> str:
        """Said when there was odometry and is none any more."""
        limit_s, heard_s = self._navigator.params.sensor_timeout_s, self._heard_s
        if limit_s <= 0.0 or heard_s is None or now_s - heard_s <= limit_s:
            return ""
        return f"nothing from {self._odometry.resolved_name} for {now_s - heard_s:.1f} s"

    def _located_now(self) -> Tuple[float, RobotPoses]:
        now_s = rospy.get_time()
        return now_s, self._locate(now_s)[1]

    def _publish(self, tick: Tick, in_global: Optional[Pose3D], located: RobotPoses) -> None:
        for warning in tick.warnings:
            self._complaints.say(self._name + warning)
        for note in tick.notes:
            rospy.loginfo("%s%s", self._name, note)
        if tick.planning_failed:
            self._complaints.say(f"{self._name}no plan: {tick.planning_failed}")
        if tick.recovery is not None:
            rospy.logwarn(
                "%srecovery %d of %d: %s",
                self._name,
                tick.recovery.index + 1,
                tick.recovery.total,
                tick.recovery.name,
            )
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
