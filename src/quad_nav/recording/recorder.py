"""Record a flight as the topics of the ROS interface, for ``rosbag play`` and RViz.

The recording's clock is the simulator's. It starts at 1 s, because ROS nodes take a time of 0
for a stopped clock.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, List

from quad_nav.geometry import Pose3D, Scan, covariance_36
from quad_nav.mission.actions import Action, SendGoal
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.offline.flight import Flight, FlightObserver
from quad_nav.recording import messages
from quad_nav.recording.navigator_topics import NavigatorTopics
from quad_nav.recording.record_file import START_NS, TopicWriter, create, stamp_at
from quad_nav.sim.contacts import Contact
from quad_nav.sim.lidar import base_from_lidar
from quad_nav.sim.odometry import pose_in
from quad_nav.sim.robot_state import RobotState
from quad_nav.topics.contacts import CONTACTS_TOPIC, contact_fields
from quad_nav.topics.estimates import TRUTH_TOPIC
from quad_nav.topics.flight_info import FLIGHT_TOPIC, FlightInfo, mission_info, simulation_info
from quad_nav.topics.markers import (
    goal_markers,
    moving_markers,
    number_markers,
    quadcopter_markers,
    scene_markers,
)
from quad_nav.topics.mission_events import EVENTS_TOPIC, mission_event
from quad_nav.topics.obstacle_poses import OBSTACLES_PERIOD_S, OBSTACLES_TOPIC, POSES_TOPIC
from quad_nav.topics.publishing import FlownPath

_SIMULATOR, _SEQUENCER = "/simulator", "/sequencer"


class Recorder(FlightObserver):
    """Writes a flight to a bag.

    If the file cannot be written, the flight stops; messages recorded until then stay readable.

    Raises:
        InputError: The file cannot be created.
    """

    needs_single_process = True

    def __init__(self, path: Path, title: str = "flight") -> None:
        self._topics = TopicWriter(create(path))
        self._title = title
        self._navigators: List[NavigatorTopics] = []
        self._paths: List[FlownPath[bytes]] = []

    @property
    def stop_reason(self) -> str:
        """Reason to stop the flight: the file cannot be written; empty otherwise."""
        return self._topics.problem

    def on_start(self, flight: Flight) -> None:
        """Write the scene, the goals and the initial state."""
        self._flight = flight
        self._obstacles_s = -math.inf  # when they were written last
        self._navigators = [
            NavigatorTopics(index, flight.offline_robots[index], self._topics)
            for index in range(len(flight.robots))
        ]
        self._paths = [FlownPath(_path_pose) for _ in flight.robots]
        self._write_flight()
        count = len(flight.robots)
        scene = messages.marker_array(scene_markers(flight.setup.scene))
        self._write("/simulation/scene", START_NS, scene, _SIMULATOR, latched=True)
        bodies = [*quadcopter_markers(count), *number_markers(count, flight.setup.scene)]
        shown = messages.marker_array(bodies)
        self._write("/simulation/quadcopters", START_NS, shown, _SIMULATOR, latched=True)
        self._write_goals(0.0)
        self.on_move(flight)

    def on_contact(self, contact: Contact) -> None:
        """Write a contact."""
        stamp = stamp_at(contact.time_s)
        content = messages.stamped("quad/Contact", contact_fields(contact), stamp)
        self._write(CONTACTS_TOPIC, stamp, content, _SIMULATOR)

    def on_scan(self, robot: int, scan: Scan, map_from_lidar: Pose3D) -> None:
        """Write a LIDAR scan."""
        stamp = stamp_at(scan.stamp_s)
        content = messages.laser_scan(scan, f"Lidar{robot}", stamp)
        self._write(f"/scan{robot}", stamp, content, _SIMULATOR)
        localization = self._flight.loop.group.localization
        estimate = None if localization is None else localization.estimate(robot)
        if localization is not None and estimate is not None:
            content = messages.pose_estimate(*estimate, stamp)
            name = localization.name
            self._write(f"/{name}_pose{robot}", stamp, content, f"/{name}")

    def on_move(self, flight: Flight) -> None:
        """Write clock, transforms, odometry and paths of one step."""
        now_s, stamp = flight.now_s, stamp_at(flight.now_s)
        self._write("/clock", stamp, messages.clock(stamp), _SIMULATOR, latched=True)
        transforms = [
            transform
            for robot, state in enumerate(flight.states)
            for transform in self._transforms(robot, state.map_from_base, stamp)
        ]
        moved = messages.message("tf2_msgs/TFMessage", transforms)
        self._write("/tf", stamp, moved, _SIMULATOR, latched=True)
        if flight.loop.group.localization is not None:
            truth = messages.true_states(flight.states, stamp)
            self._write(TRUTH_TOPIC, stamp, truth, _SIMULATOR)
        if now_s >= self._obstacles_s + OBSTACLES_PERIOD_S - 1e-6:
            self._write_obstacles(flight)
        for robot, state in enumerate(flight.states):
            self._write_odometry(robot, state, stamp)
            self._write_flown_path(robot, state, now_s)
            self._navigators[robot].action.write_due_status(now_s)

    def on_action(self, robot: int, now_s: float, action: Action) -> None:
        """Write an action of the sequencer."""
        stamp, event = stamp_at(now_s), mission_event(robot, now_s, action)
        content = messages.stamped("quad/MissionEvent", event.fields, stamp)
        self._write(EVENTS_TOPIC, stamp, content, _SEQUENCER)
        if isinstance(action, SendGoal):
            self._navigators[robot].action.send(now_s, action.pose)
        self._write_goals(now_s)

    def on_tick(self, robot: int, tick: Tick, located: RobotPoses, wall_s: float) -> None:
        """Write the topics of a navigator's tick."""
        navigator = self._navigators[robot]
        if navigator.action.is_waiting and not self._flight.robots[robot].goal_waits:
            navigator.action.accept(tick.now_s)
        navigator.write(tick, located)

    def on_end(self, flight: Flight) -> None:
        """Write the final flight information and complete the file."""
        if self._obstacles_s < flight.now_s:
            self._write_obstacles(flight)
        self._write_flight()
        self._topics.close()

    def _write_obstacles(self, flight: Flight) -> None:
        self._obstacles_s, movers = flight.now_s, flight.simulation.movers
        if movers:
            stamp = stamp_at(flight.now_s)
            shown = messages.marker_array(moving_markers(movers, flight.now_s), stamp=stamp)
            self._write(OBSTACLES_TOPIC, stamp, shown, _SIMULATOR)
            poses = messages.pose_array(movers.poses(flight.now_s), stamp)
            self._write(POSES_TOPIC, stamp, poses, _SIMULATOR)

    def _transforms(self, robot: int, map_from_base: Pose3D, stamp: int) -> List[Any]:
        odom, base, lidar = f"odom{robot}", f"base_link{robot}", f"Lidar{robot}"
        map_from_odom = self._flight.simulation.map_from_frame(odom, robot)
        localization = self._flight.loop.group.localization
        told = map_from_odom if localization is None else localization.map_from_odom(robot)
        return [
            messages.transform(told.to_3d(), "map", odom, stamp),
            messages.transform(pose_in(map_from_odom, map_from_base), odom, base, stamp),
            messages.transform(base_from_lidar, base, lidar, stamp),
        ]

    def _write_odometry(self, robot: int, state: RobotState, stamp: int) -> None:
        simulation = self._flight.simulation
        map_from_odom = simulation.map_from_frame(f"odom{robot}", robot)
        errors = simulation.odometry
        odometry = messages.odometry(
            pose_in(map_from_odom, state.map_from_base),
            state.linear_mps,
            state.angular_radps,
            (f"odom{robot}", f"base_link{robot}"),
            stamp,
            *(() if errors is None else (covariance_36(errors.covariances[robot]),)),
        )
        self._write(f"/odom{robot}", stamp, odometry, _SIMULATOR)

    def _write_flown_path(self, robot: int, state: RobotState, now_s: float) -> None:
        """Write the whole path again if it has grown."""
        path, stamp = self._paths[robot], stamp_at(now_s)
        if path.add(now_s, state.map_from_base):
            data = messages.path_bytes(path.poses, "map", stamp)
            self._topics.write_bytes(
                f"/path{robot}", "nav_msgs/Path", stamp, data, _SEQUENCER, True
            )

    def _write_flight(self) -> None:
        flight = self._flight
        setup = flight.setup
        info = FlightInfo(self._title, setup.config_name, flight.reason)
        info = info.merged(simulation_info(setup.scene, setup.seed, setup.simulation.jitter_m))
        mission = mission_info(
            {robot.name: robot.sequencer.sequence for robot in flight.robots},
            [robot.configuration.to_tree() for robot in flight.robots],
            setup.robot_radius_m,
        )
        content = messages.flight_info(info.merged(mission))
        self._write(FLIGHT_TOPIC, stamp_at(flight.now_s), content, _SIMULATOR, latched=True)

    def _write_goals(self, now_s: float) -> None:
        sequencers = [robot.sequencer for robot in self._flight.robots]
        markers = goal_markers(sequencers, self._flight.setup.scene.altitude_m)
        shown = messages.marker_array(markers, replaces_all=True)
        self._write("/goals", stamp_at(now_s), shown, _SEQUENCER, latched=True)

    def _write(
        self, topic: str, stamp: int, content: Any, node: str, latched: bool = False
    ) -> None:
        self._topics.write(topic, stamp, content, node, latched)


def _path_pose(stamp_s: float, pose: Pose3D) -> bytes:
    upright = messages.planar_pose(pose.to_2d(), pose.z_m)
    return messages.encode(messages.pose_stamped(upright, "map", stamp_at(stamp_s)))
