"""One robot of a composed fleet: its navigator in the loop, and its ROS interface."""

from __future__ import annotations

import math
from typing import Dict, List, Optional, Sequence, Tuple

import rospy

from quad_nav.config import Configuration
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.scan_intake import Sink
from quad_nav.errors import PluginError
from quad_nav.geometry import Pose3D, Scan, Twist2D
from quad_nav.loop.navigator_group import LoopRobot
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.peers.peer import Peer
from quad_nav.ros.common.transforms import LocatedPose, Transforms
from quad_nav.ros.navigator import sensors, static_maps
from quad_nav.ros.navigator.health_meters import InputMeter
from quad_nav.ros.navigator.intention_topics import robot_publisher
from quad_nav.ros.navigator.robot_interface import RobotInterface
from quad_nav.sim.robot_state import RobotState
from quad_nav.topics.publishing import in_fleet

_MAP_FRAME = "map"


class ComposedRobot(LoopRobot):
    """A navigator that has its inputs from the loop, and everything else from topics.

    Sensors that the simulation does not have keep their topics, and so do static maps.

    Attributes:
        interface: Topics, services, action and parameters.
    """

    def __init__(
        self,
        configuration: Configuration,
        number: int,
        transforms: Transforms,
    ) -> None:
        """Build the navigator and its interface."""
        self._names = names = in_fleet(number)
        super().__init__(configuration, number)
        self._sensors = sensors.connect(self, names, self._lidar.sinks)
        self._transforms = transforms
        self._state: Optional[RobotState] = None
        self._odometry_meter = InputMeter(names("odom"))
        self._scan_meter = InputMeter(names("scan"), self._lidar.expected_period_s)
        own_meters = [self._odometry_meter, self._scan_meter][: 2 if self._lidar.sinks else 1]
        self.interface = RobotInterface(
            self,
            transforms,
            self._located_now,
            names,
            [*own_meters, *(sensor.meter for sensor in self._sensors)],
        )
        global_frame = self.costmaps[0].params.global_frame
        self._intention = robot_publisher(names, global_frame)

    def lidar_sinks(self) -> List[Sink]:
        """List the sources of layers that are the simulated LIDAR, in its own frame."""
        lidar, frames = (self._names("scan"), "LaserScan"), ("", f"Lidar{self._number}")
        return [
            sink
            for sink in super().lidar_sinks()
            if sensors.topic_of(sink, self._names) == lidar and sink.source.sensor_frame in frames
        ]

    @property
    def needs_transforms(self) -> bool:
        """True if a sensor of another node delivers messages, with stamps of the past."""
        return bool(self._sensors)

    @property
    def subscribers(self) -> List[rospy.Subscriber]:
        """Subscribers to the topics that the navigator needs."""
        return [sensor.subscriber for sensor in self._sensors]

    def add_scan(self, scan: Scan, map_from_lidar: Pose3D, now_s: float) -> str:
        """Hand a scan to the costmaps; a plugin's mistake aborts the goal."""
        self._scan_meter.add(scan.stamp_s, now_s)
        with self.interface.lock:
            try:
                reason = super().add_scan(scan, map_from_lidar, now_s)
            except PluginError as error:
                self.interface.abort(error)
                return ""
        if reason:
            self.interface.warnings.warn(
                sensors.rejection(self.interface.name, reason, self._lidar)
            )
        return reason

    def poll(self, now_s: float, state: RobotState) -> None:
        """Take the robot's state, and what has come from topics: goals, messages of sensors."""
        with self.interface.lock:
            self._state = state
            self._odometry_meter.add(now_s, now_s)
            for sensor in self._sensors:
                sensor.deliver(self._transforms)
            self.interface.poll(now_s)
            self.due_s = -math.inf  # goals, requests and parameters may have changed it
        self._intention.publish({self._number: self.navigator.peers.intention}, now_s)

    def navigate(
        self, now_s: float, state: RobotState, peers: Sequence[Peer]
    ) -> Tuple[Tick, RobotPoses]:
        """Tick the navigator and publish the results; a plugin's mistake aborts the goal."""
        with self.interface.lock:
            try:
                tick, located = super().navigate(now_s, state, peers)
                in_global = self._in_costmaps(state.map_from_base)
                frame = self.navigator.global_costmap.params.global_frame
                self.interface.publish(tick, LocatedPose(in_global[frame], now_s), located)
            except PluginError as error:
                self.interface.abort(error)
                return Tick(now_s, command=Twist2D()), RobotPoses(None, None)
        return tick, located

    def _map_poses(self, costmap: LayeredCostmap, now_s: float) -> Dict[str, Optional[Pose3D]]:
        """Return the pose of a costmap's frame in the frames of its maps, of which some are odd."""
        if set(costmap.map_frames) <= {_MAP_FRAME}:
            return super()._map_poses(costmap, now_s)
        interface = self.interface
        return static_maps.map_poses(interface.name, costmap, self._transforms, interface.warnings)

    def _located_now(self) -> RobotPoses:
        if self._state is None:
            return RobotPoses(None, None)
        return self._located(self._state.map_from_base)
