"""One robot's navigator whose inputs are topics: odometry, sensors, maps, tf and peers.

Callbacks store messages. `step` takes a snapshot, ticks the navigator when a tick is due and
publishes the results through the robot's interface.
"""

from __future__ import annotations

import time
from typing import List, Optional, Tuple

import rospy
from nav_msgs.msg import Odometry

from quad_nav.config import Configuration
from quad_nav.errors import PluginError
from quad_nav.geometry import Pose3D, Twist2D
from quad_nav.navigator.tick import RobotPoses
from quad_nav.ros.common.conversions import odometry_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator import sensors, static_maps
from quad_nav.ros.navigator.health_meters import InputMeter, NavigatorHealth
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.robot_interface import RobotInterface
from quad_nav.scenario.assembly import build_navigator, build_scan_filters
from quad_nav.timing import is_due
from quad_nav.topics.publishing import Names, own_node
from quad_nav.topics.validation import odometry_problem

POLL_S = 0.05  # delay after which an idle navigator notices a goal
FIRST_POSE_S = 0.5
"""Longest wait for the first pose; then the navigator runs, and says what is missing."""


class RobotNavigator:
    """A navigator with its inputs and its interface.

    Attributes:
        number: Number of the robot.
        name: Name of the robot, for messages.
        due_s: Time at which `step` is due.
    """

    def __init__(
        self,
        configuration: Configuration,
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
        self.number, self.name = configuration.robot, f"quad{configuration.robot}"
        self.due_s = 0.0
        self._warnings = ThrottledWarnings()
        self._navigator = navigator = build_navigator(configuration)
        self._velocity = Twist2D()
        self._odometry_s: Optional[float] = None  # of the last message, at first of the first step
        self._start = NavigatorStart()
        self._transforms, self._peers = transforms, peers
        costmaps = (navigator.global_costmap, navigator.local_costmap)
        self._odometry = rospy.Subscriber(names("odom"), Odometry, self._on_odometry, queue_size=1)
        self._scan_filters = build_scan_filters(configuration)
        self._sensors = sensors.connect(self.name, costmaps, self._scan_filters, names)
        self._interface = RobotInterface(
            configuration,
            navigator,
            self._scan_filters,
            transforms,
            self._located_now,
            names,
            [sensor.intake for sensor in self._sensors],
            [InputMeter.of(self._odometry), *(sensor.meter() for sensor in self._sensors)],
        )
        self._maps = static_maps.connect(costmaps, self._interface.lock, names)

    @property
    def health(self) -> NavigatorHealth:
        """Meters of the navigator."""
        return self._interface.health

    @property
    def subscribers(self) -> List[rospy.Subscriber]:
        """Subscribers to the topics that the navigator needs."""
        return [self._odometry, *(sensor.subscriber for sensor in self._sensors)]

    def step(self, now_s: float) -> None:
        """Do the work that is due at a time; a plugin's mistake aborts the goal."""
        with self._interface.lock:
            try:
                self._step(now_s)
            except PluginError as error:
                self._interface.abort(error)
            self.due_s = max(min(self._navigator.next_due_s, now_s + POLL_S), now_s)

    def discard_late_scans(self) -> None:
        """Discard the scans that were queued while the clock stood still."""
        for sensor in self._sensors:
            sensor.discard_late()

    def restart(self, now_s: float) -> None:
        """Discard messages and restart all schedules after a clock jump.

        It does not wait for a pose again: a robot that flies without one has to be stopped.
        """
        with self._interface.lock:
            for sensor in self._sensors:
                sensor.reset()
            self._odometry_s = now_s
            self._start.end()
            self._navigator.restart(now_s)
            self._interface.restart(now_s)
            self.due_s = now_s

    def stop(self) -> None:
        """Publish a zero velocity; the quadcopter hovers."""
        self._interface.stop()

    def _on_odometry(self, message: Odometry) -> None:
        odom_from_base, velocity = odometry_from_message(message)
        problem = odometry_problem(message.header.frame_id, odom_from_base, velocity)
        if problem:
            self._warnings.warn(f"{self.name}: odometry dropped: {problem}")
        else:
            self._velocity, self._odometry_s = velocity, rospy.get_time()

    def _step(self, now_s: float) -> None:
        navigator = self._navigator
        for sensor in self._sensors:
            sensor.deliver(self._transforms)
        self._interface.poll(now_s)
        self._peers.publish(self.number, navigator.peers.intention, now_s)
        if not is_due(navigator.next_due_s, now_s) and not navigator.has_work:
            return
        for costmap in (navigator.global_costmap, navigator.local_costmap):
            static_maps.place_maps(self.name, costmap, self._transforms, self._warnings)
        in_global, located = self._locate(now_s)
        if not self._start.is_over(now_s, in_global is not None):
            return
        peers = self._peers.near(self.number, located.in_global, navigator.peers.reach_m)
        tracks = self._scan_filters.tracks(now_s)
        start_s = time.perf_counter()
        tick = navigator.tick(now_s, located, self._velocity, peers, tracks)
        self._interface.publish(tick, in_global, located, time.perf_counter() - start_s)

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
        """Say that odometry has timed out, or that the first message has not come in time."""
        if self._odometry_s is None:
            self._odometry_s = now_s
        limit_s, received_s = self._navigator.params.sensor_timeout_s, self._odometry_s
        if limit_s <= 0.0 or now_s - received_s <= limit_s:
            return ""
        return f"no message on {self._odometry.resolved_name} for {now_s - received_s:.1f} s"

    def _located_now(self) -> Tuple[float, RobotPoses]:
        now_s = rospy.get_time()
        return now_s, self._locate(now_s)[1]


class NavigatorStart:
    """Tell when a navigator starts: with its first pose, or a while after its first step."""

    def __init__(self) -> None:
        self._first_step_s: Optional[float] = None
        self._is_over = False

    def is_over(self, now_s: float, is_located: bool) -> bool:
        """Return whether the navigator runs in a step at a time, with or without a pose."""
        if self._first_step_s is None:
            self._first_step_s = now_s
        if is_located or now_s - self._first_step_s >= FIRST_POSE_S:
            self._is_over = True
        return self._is_over

    def end(self) -> None:
        """Wait no longer."""
        self._is_over = True
