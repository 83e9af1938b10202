"""Publish clock, transforms, states, odometry, scans, contacts and health of the simulation."""

from __future__ import annotations

import math
from typing import List, Sequence

import rospy
from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus
from geometry_msgs.msg import PoseArray
from nav_msgs.msg import OccupancyGrid
from quad.msg import Contact as ContactMessage
from quad.msg import FlightInfo
from rosgraph_msgs.msg import Clock
from std_msgs.msg import Time
from visualization_msgs.msg import MarkerArray

from quad_nav.ros.common.conversions import (
    ScanMessage,
    key_values,
    scan_message,
    time_message,
)
from quad_nav.ros.common.diagnostics import DiagnosticsTopic
from quad_nav.ros.common.marker_messages import marker_array
from quad_nav.ros.common.nav_messages import map_message
from quad_nav.ros.common.own_messages import contact_message, flight_info_message
from quad_nav.ros.common.packed_messages import pose_array_message
from quad_nav.ros.simulator.pose_topics import PoseTopics
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.contacts import Contact
from quad_nav.sim.simulation import Simulation
from quad_nav.sim.simulation_params import FASTEST_RATE
from quad_nav.topics.contacts import CONTACTS_TOPIC
from quad_nav.topics.flight_info import FLIGHT_TOPIC, RESET_TOPIC, simulation_info, text_values
from quad_nav.topics.markers import (
    moving_markers,
    number_markers,
    quadcopter_markers,
    scene_markers,
)
from quad_nav.topics.obstacle_poses import OBSTACLES_PERIOD_S, OBSTACLES_TOPIC, POSES_TOPIC

_LAGS_BELOW = 0.9
"""The simulation lags if it reaches less than this part of the requested rate."""
_LAGGING_REPORTS = 3
"""Consecutive lagging reports that give a warning; starting nodes cause single ones."""


class SimulatorTopics:
    """Publishers of the simulator.

    States, odometry and scans are computed only for subscribers. A node that starts while the
    simulation is paused receives `/clock` and `/tf`, and no transform is sent twice with the same
    stamp, about which tf2 would warn.

    Attributes:
        lidar_enabled: Whether each LIDAR is on; services change it.
    """

    def __init__(
        self,
        simulation: Simulation,
        map_resolution_m: float,
        localizes: bool,
        scanned: Sequence[int],
    ) -> None:
        """Advertise the topics, and publish the scene and the flight info.

        Args:
            simulation: The simulation.
            map_resolution_m: Size of the cells of the scene's map; 0 for no map.
            localizes: Publish what only a simulation knows: the quadcopters' poses in ``map``.
            scanned: Numbers of the quadcopters whose scans are published here. Where their
                navigators share the process, their scans come from there.
        """
        self._simulation = simulation
        self.lidar_enabled = [True] * simulation.n_robots
        self._lagging_reports = 0
        self._poses = PoseTopics(simulation, localizes)
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
        self._scans = {i: rospy.Publisher(f"/scan{i}", ScanMessage, queue_size=10) for i in scanned}
        self._contacts = rospy.Publisher(CONTACTS_TOPIC, ContactMessage, queue_size=100)
        self._reset = rospy.Publisher(RESET_TOPIC, Time, queue_size=1, latch=True)
        self._diagnostics = DiagnosticsTopic()
        self._scene = rospy.Publisher("/simulation/scene", MarkerArray, queue_size=1, latch=True)
        self._quadcopters = rospy.Publisher(
            "/simulation/quadcopters", MarkerArray, queue_size=1, latch=True
        )
        self._obstacles = rospy.Publisher(OBSTACLES_TOPIC, MarkerArray, queue_size=1)
        self._obstacle_poses = rospy.Publisher(POSES_TOPIC, PoseArray, queue_size=1)
        self._obstacles_s, self._obstacles_listeners = -math.inf, 0  # at the last message
        self._publish_flight_info()
        self._scene.publish(marker_array(scene_markers(simulation.scene)))
        count = simulation.n_robots
        self._quadcopters.publish(
            marker_array(quadcopter_markers(count) + number_markers(count, simulation.scene))
        )
        if map_resolution_m > 0.0:
            self._publish_map(map_resolution_m)

    def _publish_map(self, resolution_m: float) -> None:
        self._map = rospy.Publisher("/map", OccupancyGrid, queue_size=1, latch=True)
        scene = scene_map(self._simulation.scene, resolution_m)
        self._map.publish(map_message(scene, time_message(self._simulation.now_s)))

    def _publish_flight_info(self) -> None:
        simulation = self._simulation
        info = simulation_info(simulation.scene, simulation.seed, simulation.params.jitter_m)
        self._flight = rospy.Publisher(FLIGHT_TOPIC, FlightInfo, queue_size=1, latch=True)
        self._flight.publish(flight_info_message(info))

    def publish_clock(self) -> None:
        """Publish the simulated time."""
        self._clock.publish(Clock(time_message(self._simulation.now_s)))

    def publish_reset(self) -> None:
        """Publish the simulated time as that of the last reset."""
        self._reset.publish(Time(time_message(self._simulation.now_s)))

    def publish_poses(self, with_transforms: bool = True) -> None:
        """Publish the transforms, and the states and the odometry that have subscribers."""
        self._poses.publish(with_transforms)
        self._publish_obstacles()

    def _publish_obstacles(self) -> None:
        """Publish the moving obstacles ten times a second, if there are any and subscribers.

        Who subscribes while the simulation is paused is told where they stand.
        """
        movers, now_s = self._simulation.movers, self._simulation.now_s
        if not movers:
            return
        publishers = self._obstacles, self._obstacle_poses
        in_rviz, programs = (one.get_num_connections() for one in publishers)
        listeners = in_rviz + programs
        is_due = abs(now_s - self._obstacles_s) >= OBSTACLES_PERIOD_S - 1e-6
        if is_due or listeners > self._obstacles_listeners:
            self._obstacles_s = now_s
            if in_rviz:
                self._obstacles.publish(marker_array(moving_markers(movers, now_s), now_s))
            if programs:
                self._obstacle_poses.publish(pose_array_message(movers.poses(now_s), now_s))
        self._obstacles_listeners = listeners

    def publish_scans(self) -> None:
        """Publish the scans of enabled LIDARs that have subscribers."""
        robots = [
            i
            for i, publisher in self._scans.items()
            if self.lidar_enabled[i] and publisher.get_num_connections()
        ]
        for i, scan in zip(robots, self._simulation.scans(robots)):
            self._scans[i].publish(scan_message(scan, f"Lidar{i}"))

    def publish_contact(self, contact: Contact) -> None:
        """Log and publish the start of a contact."""
        rospy.logwarn(
            "%s at (%.2f, %.2f) m, time %.2f s", contact, contact.x_m, contact.y_m, contact.time_s
        )
        self._contacts.publish(contact_message(contact, contact.time_s))

    def publish_health(self, paused: bool, rate: float, factor: float) -> None:
        """Publish the statuses of the clock and of all quadcopters.

        Args:
            paused: Whether the simulation is paused.
            rate: Requested simulated seconds per second.
            factor: Simulated seconds per second since the last call.
        """
        array = DiagnosticArray(
            status=[self._clock_health(paused, rate, factor), *self._robots_health()]
        )
        array.header.stamp = time_message(self._simulation.now_s)
        self._diagnostics.publish(array)

    def _clock_health(self, paused: bool, rate: float, factor: float) -> DiagnosticStatus:
        lags = not paused and factor < _LAGS_BELOW * rate and rate < FASTEST_RATE
        self._lagging_reports = self._lagging_reports + 1 if lags else 0
        if self._lagging_reports >= _LAGGING_REPORTS:
            rospy.logwarn_throttle(
                10.0 * rate,
                "simulator: simulation lags: %.2f simulated seconds per second, expected %g (use a"
                " lower rate:=)",
                factor,
                rate,
            )
        message = "paused" if paused else f"{'lagging: ' if lags else ''}{factor:.2f} x real time"
        return DiagnosticStatus(
            level=(
                DiagnosticStatus.WARN
                if self._lagging_reports >= _LAGGING_REPORTS
                else DiagnosticStatus.OK
            ),
            name="simulator: clock",
            hardware_id="simulator",
            message=message,
            values=key_values(
                text_values(
                    real_time_factor=factor, rate=rate, contacts=len(self._simulation.contacts)
                )
            ),
        )

    def _robots_health(self) -> List[DiagnosticStatus]:
        simulation = self._simulation
        return [
            DiagnosticStatus(
                level=DiagnosticStatus.OK if self.lidar_enabled[i] else DiagnosticStatus.WARN,
                name=f"simulator: quadcopter {i}",
                hardware_id=f"quad{i}",
                message=("hovering, no command" if hovering else "flying")
                + ("" if self.lidar_enabled[i] else ", LIDAR off"),
                values=key_values(
                    text_values(
                        contacts=sum(c.involves(f"quad{i}") for c in simulation.contacts),
                        lidar=self.lidar_enabled[i],
                    )
                ),
            )
            for i, hovering in enumerate(simulation.is_hovering)
        ]
