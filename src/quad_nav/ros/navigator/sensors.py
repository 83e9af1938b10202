"""Sensor topics into the costmaps' obstacle layers.

A message waits until tf knows where its sensor was at its stamp, as in the
original's message filter; the oldest of too many waiting ones is dropped.
"""

from __future__ import annotations

import struct
import threading
from collections import deque
from typing import Any, Deque, Dict, List, Optional, Sequence, Tuple

import numpy as np
import rospy
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud, PointCloud2

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.obstacle import ObstacleLayer
from quad_nav.costmap.scan_validator import ScanValidator
from quad_nav.geometry import Pose3D, Scan
from quad_nav.ros.common.conversions import ScanMessage, scan_from_message
from quad_nav.ros.common.node_tools import Names, ThrottledWarnings, own_node
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.validation import MAX_POINTS, scan_problem

MESSAGE_TYPES = {"LaserScan": ScanMessage, "PointCloud": PointCloud, "PointCloud2": PointCloud2}
QUEUE_LENGTH = 50
UNUSABLE = (ValueError, TypeError, ArithmeticError, struct.error)  # what a bad message leads to


class Sensor:
    """One topic and the (costmap, layer, source) that take what it brings."""

    def __init__(self, topic: str, data_type: str) -> None:
        self.topic = topic
        self.data_type = data_type
        self.targets: List[Tuple[LayeredCostmap, ObstacleLayer, str, str]] = []
        self.waiting: Deque = deque(maxlen=QUEUE_LENGTH)
        self._trust: Optional[ScanValidator] = None
        self._complaints = ThrottledWarnings()
        self._lock = threading.Lock()
        self.subscriber = rospy.Subscriber(
            topic, MESSAGE_TYPES[data_type], self._store, queue_size=QUEUE_LENGTH
        )

    @property
    def expected_period_s(self) -> float:
        """How often something is to come for every layer to be current, 0 if none minds."""
        periods_s = [
            layer.buffers[source].params.expected_update_period_s
            for _, layer, source, _ in self.targets
        ]
        return min((period_s for period_s in periods_s if period_s > 0.0), default=0.0)

    def _store(self, message) -> None:
        with self._lock:
            self.waiting.append((message, rospy.get_time()))

    def forget(self) -> None:
        """For a clock that has jumped: what waits is of another time."""
        with self._lock:
            self.waiting.clear()
        self._trust = None

    def deliver(self, transforms: Transforms, doubt: bool) -> None:
        """Hands over every message whose transforms are known.

        With ``doubt`` no scan that cannot be true.
        """
        while True:
            with self._lock:
                if not self.waiting:
                    return
                message, received_s = self.waiting[0]
            try:
                poses = self._poses_if_known(transforms, message)
            except TransformUnavailable as error:
                rospy.logwarn_throttle(
                    5.0,
                    "%s: a message in frame '%s' is dropped: %s",
                    self.topic,
                    message.header.frame_id,
                    error,
                )
                self._drop(message)
                continue
            if poses is None:
                return
            self._drop(message)
            if doubt:
                # What is seen is as old as its stamp, whenever it comes.
                received_s = min(received_s, message.header.stamp.to_sec())
            if not (doubt and self._is_doubtful(message, poses[0][0])):
                self._hand_over(message, received_s, poses)

    def _is_doubtful(self, message, global_from_sensor: Pose3D) -> bool:
        if self.data_type != "LaserScan":
            return False
        if self._trust is None:
            self._trust = ScanValidator(
                layer.buffers[source].params for _, layer, source, _ in self.targets
            )
        try:
            scan = _checked_scan(message)
        except UNUSABLE:
            return False  # when it is handed over it is said why
        why_not = self._trust.why_not(scan, global_from_sensor, rospy.get_time())
        if why_not:
            self._complaints.warn(f"{self.topic}: a scan is not believed: {why_not}")
        return bool(why_not)

    def _drop(self, message) -> None:
        with self._lock:
            if self.waiting and self.waiting[0][0] is message:
                self.waiting.popleft()

    def _poses_if_known(
        self, transforms: Transforms, message
    ) -> Optional[List[Tuple[Pose3D, Pose3D]]]:
        """None while the transforms may still come."""
        try:
            return self._poses(transforms, message)
        except TransformUnavailable as error:
            if not error.later:
                raise
        if self._is_ahead(transforms, message):
            return None
        return self._poses(transforms, message)  # they may have come in this moment

    def _is_ahead(self, transforms: Transforms, message) -> bool:
        """Whether the transform may still come: the stamp is younger than tf's latest."""
        costmap = self.targets[0][0]
        return (
            transforms.locate(
                costmap.params.global_frame,
                message.header.frame_id,
                message.header.stamp.to_sec(),
                0.0,
            )
            is None
        )

    def _poses(self, transforms: Transforms, message) -> List[Tuple[Pose3D, Pose3D]]:
        """For each target where its points and its origin are; what is the same is asked once."""
        stamp_s, frame = message.header.stamp.to_sec(), message.header.frame_id
        known: Dict[Tuple[str, str], Pose3D] = {}

        def pose(to_frame: str, from_frame: str) -> Pose3D:
            if (to_frame, from_frame) not in known:
                known[to_frame, from_frame] = transforms.lookup(to_frame, from_frame, stamp_s)
            return known[to_frame, from_frame]

        return [
            (
                pose(costmap.params.global_frame, frame),
                pose(costmap.params.global_frame, sensor_frame or frame),
            )
            for costmap, _, _, sensor_frame in self.targets
        ]

    def _hand_over(
        self, message, received_s: float, poses: Sequence[Tuple[Pose3D, Pose3D]]
    ) -> None:
        """Layers that see a message in the same way share what the first makes of it."""
        is_scan, stamp_s = self.data_type == "LaserScan", message.header.stamp.to_sec()
        try:
            seen: Any = _checked_scan(message) if is_scan else _cloud_points(message)
        except UNUSABLE as error:
            rospy.logwarn_throttle(5.0, "%s: a message is dropped: %s", self.topic, error)
            return
        made: Dict[tuple, Tuple[ObstacleLayer, str]] = {}
        for (costmap, layer, source, frame), (points_pose, origin_pose) in zip(self.targets, poses):
            way = (costmap.params.global_frame, frame, layer.way_of_seeing(source))
            first, its_source = made.setdefault(way, (layer, source))
            if first is not layer:
                layer.add_observation(source, first.newest(its_source), received_s)
            elif is_scan:
                layer.add_scan(source, seen, points_pose, received_s, origin_pose)
            else:
                layer.add_cloud(source, seen, points_pose, stamp_s, received_s, origin_pose)


def _checked_scan(message) -> Scan:
    """Raises ValueError for one that cannot be used."""
    scan = scan_from_message(message)
    problem = scan_problem(scan)
    if problem:
        raise ValueError(problem)
    return scan


def _cloud_points(message) -> np.ndarray:
    """float32[n, 3] in the message's frame, without points that are nowhere.

    Raises what numpy and struct raise for a message that is not as long as it says.
    """
    count = (
        len(message.points) if isinstance(message, PointCloud) else message.width * message.height
    )
    if count > MAX_POINTS:
        raise ValueError(f"{count} points, expected {MAX_POINTS} at most")
    if isinstance(message, PointCloud):
        points = [(p.x, p.y, p.z) for p in message.points]
    else:
        points = list(point_cloud2.read_points(message, field_names=("x", "y", "z")))
    cloud = np.array(points, dtype=np.float32).reshape(-1, 3)
    return cloud[np.isfinite(cloud).all(axis=1)]


def connect(costmaps: Sequence[LayeredCostmap], names: Names = own_node) -> List[Sensor]:
    """Subscribes to every source of every obstacle layer, each topic once."""
    sensors: Dict[Tuple[str, str], Sensor] = {}
    for costmap in costmaps:
        for layer in costmap.layers.values():
            if not isinstance(layer, ObstacleLayer):
                continue
            for source in layer.params.sources:
                key = (names(source.topic or source.name), source.data_type)
                if key not in sensors:
                    sensors[key] = Sensor(*key)
                sensors[key].targets.append((costmap, layer, source.name, source.sensor_frame))
    return list(sensors.values())
