"""One robot's navigator whose inputs are topics: odometry, sensors, maps, tf and peers.

Callbacks store messages. `step` takes a snapshot, ticks the navigator when a tick is due and
publishes the results through the robot's interface.
"""

from __future__ import annotations

import math
from typing import Callable, List, Optional, Tuple

import rospy
from nav_msgs.msg import Odometry

from quad_nav.config import Configuration
from quad_nav.errors import PluginError
from quad_nav.geometry import Twist2D
from quad_nav.navigator.tick import RobotPoses
from quad_nav.ros.common.conversions import odometry_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import LocatedPose, Transforms
from quad_nav.ros.navigator import sensors, static_maps
from quad_nav.ros.navigator.health_meters import InputMeter
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.ros.navigator.robot_interface import RobotInterface
from quad_nav.scenario.navigator_host import NavigatorHost
from quad_nav.timing import is_due
from quad_nav.topics.publishing import Names, own_node
from quad_nav.topics.validation import odometry_problem

POLL_S = 0.05  # delay after which an idle navigator notices messages; a request wakes it
FIRST_POSE_S = 0.5
"""Longest wait for the first pose; then the navigator runs, and says what is missing."""


class RobotNavigator(NavigatorHost):
    """A navigator with its inputs and its interface.

    Attributes:
        number: Number of the robot.
        name: Name of the robot, for messages.
        due_s: Time at which `step` is due.
        has_request: Whether it is due now, for a goal or another request that has come.
        health: Meters of the navigator.
    """

    def __init__(
        self,
        configuration: Configuration,
        transforms: Transforms,
        peers: PeerTopics,
        names: Names = own_node,
    ) -> None:
        """Build the navigator and connect it; robots of a process share transforms and peers."""
        super().__init__(configuration)
        self.number, self.name = configuration.robot, f"quad{configuration.robot}"
        self.due_s, self.has_request = 0.0, False
        self._velocity = Twist2D()
        self._odometry_s: Optional[float] = None  # of the last message, at first of the first step
        self._start_s: Optional[float] = None  # when it starts at the latest, set by the first step
        self._last_pose: Optional[LocatedPose] = None
        self._transforms, self._peers = transforms, peers
        self._warnings = ThrottledWarnings()
        self._odometry_meter = InputMeter(rospy.resolve_name(names("odom")))
        self._odometry = rospy.Subscriber(names("odom"), Odometry, self._on_odometry, queue_size=1)
        self._sensors = sensors.connect(self, names)
        self._interface = RobotInterface(
            self,
            transforms,
            self._located_now,
            names,
            [self._odometry_meter, *(sensor.meter for sensor in self._sensors)],
        )
        self.health = self._interface.health

    @property
    def subscribers(self) -> List[rospy.Subscriber]:
        """Subscribers to the topics that the navigator needs."""
        return [self._odometry, *(sensor.subscriber for sensor in self._sensors)]

    def on_request(self, wake: Callable[[], None]) -> None:
        """Call a function when a goal or another request has come."""

        def note() -> None:
            self.has_request = True
            wake()

        self._interface.on_request = note

    def step(self, now_s: float) -> None:
        """Do the work that is due at a time; a plugin's mistake aborts the goal."""
        self.has_request = False
        with self._interface.lock:
            try:
                self._step(now_s)
            except PluginError as error:
                self._interface.abort(error)
            self.due_s = max(min(self.navigator.next_due_s, now_s + POLL_S), now_s)

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
                sensor.clear()
            super().restart(now_s)
            self._odometry_s = self._start_s = self.due_s = now_s
            self._interface.restart(now_s)

    def stop(self) -> None:
        """Publish a zero velocity; the quadcopter hovers."""
        self._interface.stop()

    def _on_odometry(self, message: Odometry) -> None:
        now_s = rospy.get_time()
        self._odometry_meter.add(message.header.stamp.to_sec(), now_s)
        odom_from_base, velocity = odometry_from_message(message)
        problem = odometry_problem(message.header.frame_id, odom_from_base, velocity)
        if problem:
            self._warnings.warn(f"{self.name}: odometry dropped: {problem}")
        else:
            self._velocity, self._odometry_s = velocity, now_s

    def _step(self, now_s: float) -> None:
        navigator = self.navigator
        for sensor in self._sensors:
            sensor.deliver(self._transforms)
        self._interface.poll(now_s)
        self._peers.publish(self.number, navigator.peers.intention, now_s)
        if not is_due(navigator.next_due_s, now_s) and not navigator.has_work:
            return
        for costmap in self.costmaps:
            poses = static_maps.map_poses(self.name, costmap, self._transforms, self._warnings)
            if poses:
                costmap.set_map_poses(poses)
        in_global, located = self._locate(now_s)
        if in_global is None and not navigator.stops_without_data:
            in_global = self._last_pose  # as upstream, which publishes it
        self._last_pose = in_global
        if self._start_s is None:
            self._start_s = now_s + FIRST_POSE_S
        if in_global is not None:
            self._start_s = -math.inf
        if now_s < self._start_s:
            return
        peers = self._peers.near(self.number, located.in_global, navigator.peers.reach_m)
        tick = self.tick(now_s, located, self._velocity, peers)
        self._interface.publish(tick, in_global, located)

    def _locate(self, now_s: float) -> Tuple[Optional[LocatedPose], RobotPoses]:
        """Return the robot's pose in the global costmap's frame, and in those of both costmaps.

        Without odometry the velocity is unknown, so the poses count as unknown as well.
        """
        timeout = self._odometry_timeout(now_s)
        if timeout:
            return None, RobotPoses(None, None, timeout)
        frames = [
            (one.params.global_frame, one.params.robot_base_frame, one.params.transform_tolerance_s)
            for one in self.costmaps
        ]
        in_global, in_local = self._transforms.locate_in(frames, now_s)
        return in_global, RobotPoses(
            in_global.pose.to_2d() if in_global else None,
            in_local.pose.to_2d() if in_local else None,
        )

    def _odometry_timeout(self, now_s: float) -> str:
        """Say that odometry has timed out, or that the first message has not come in time."""
        if self._odometry_s is None:
            self._odometry_s = now_s
        limit_s, received_s = self.navigator.params.sensor_timeout_s, self._odometry_s
        if limit_s <= 0.0 or now_s - received_s <= limit_s:
            return ""
        return f"no message on {self._odometry.resolved_name} for {now_s - received_s:.1f} s"

    def _located_now(self) -> RobotPoses:
        return self._locate(rospy.get_time())[1]
