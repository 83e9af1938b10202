"""Sensor topics of the costmaps' obstacle layers.

A message waits until tf knows the pose of its sensor at its stamp, as in upstream
move_base's message filter. When too many wait, the oldest is dropped.
"""

from __future__ import annotations

import struct
import threading
from collections import deque
from typing import Any, Deque, Dict, List, Optional, Sequence, Tuple

import numpy as np
import rospy
from numpy.typing import NDArray
from sensor_msgs import point_cloud2
from sensor_msgs.msg import PointCloud, PointCloud2

from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.costmap.scan_intake import ScanIntake, SensorPose, Sink, sinks_of
from quad_nav.costmap.scan_validator import ScanValidatorParams
from quad_nav.geometry import Pose3D, Scan
from quad_nav.ros.common.conversions import ScanMessage, scan_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.topics.publishing import Names, own_node
from quad_nav.topics.validation import MAX_POINTS, scan_problem

MESSAGE_TYPES = {"LaserScan": ScanMessage, "PointCloud": PointCloud, "PointCloud2": PointCloud2}
QUEUE_LENGTH = 50
MESSAGE_ERRORS = (ValueError, TypeError, ArithmeticError, struct.error)  # of a bad message


class Sensor:
    """One sensor topic of a robot and the layers that take its messages.

    Attributes:
        topic: Resolved name of the topic.
        data_type: Key of `MESSAGE_TYPES`.
        intake: Validates messages and hands them to the layers.
        subscriber: Fills the queue of waiting messages.
    """

    def __init__(
        self,
        robot: str,
        topic: str,
        data_type: str,
        sinks: Sequence[Sink],
        params: ScanValidatorParams,
    ) -> None:
        self.topic = topic
        self.data_type = data_type
        self.intake = ScanIntake(sinks, params)
        self._robot = robot
        self._waiting: Deque[Tuple[Any, float]] = deque(maxlen=QUEUE_LENGTH)
        self._warnings = ThrottledWarnings()
        self._lock = threading.Lock()
        self.subscriber = rospy.Subscriber(
            topic, MESSAGE_TYPES[data_type], self._store, queue_size=QUEUE_LENGTH
        )

    def _store(self, message: Any) -> None:
        with self._lock:
            self._waiting.append((message, rospy.get_time()))

    def reset(self) -> None:
        """Forget waiting messages and earlier scans, after the clock has jumped."""
        with self._lock:
            self._waiting.clear()
        self.intake.reset()

    def deliver(self, transforms: Transforms) -> None:
        """Hand every message whose transforms are known to the layers."""
        while True:
            with self._lock:
                if not self._waiting:
                    return
                message, received_s = self._waiting[0]
            try:
                poses = self._poses_if_known(transforms, message)
            except TransformUnavailable as error:
                rospy.logwarn_throttle(
                    5.0,
                    "%s: %s: message in frame '%s' dropped: %s",
                    self._robot,
                    self.topic,
                    message.header.frame_id,
                    error,
                )
                self._drop(message)
                continue
            if poses is None:
                return
            self._drop(message)
            self._hand_over(message, received_s, poses)

    def _drop(self, message: Any) -> None:
        with self._lock:
            if self._waiting and self._waiting[0][0] is message:
                self._waiting.popleft()

    def _poses_if_known(self, transforms: Transforms, message: Any) -> Optional[List[SensorPose]]:
        """Look up the sensor's poses; None while the transforms may still come.

        Raises:
            TransformUnavailable: The transforms cannot come any more.
        """
        try:
            return self._poses(transforms, message)
        except TransformUnavailable as error:
            if not error.later:
                raise
        if self._is_ahead(transforms, message):
            return None
        return self._poses(transforms, message)  # they may have come in this moment

    def _is_ahead(self, transforms: Transforms, message: Any) -> bool:
        """Tell whether the message's stamp is younger than tf's latest transform."""
        return (
            transforms.locate(
                self.intake.sinks[0].costmap.params.global_frame,
                message.header.frame_id,
                message.header.stamp.to_sec(),
                0.0,
            )
            is None
        )

    def _poses(self, transforms: Transforms, message: Any) -> List[SensorPose]:
        """Look up the sensor's poses for each sink, each pair of frames once."""
        stamp_s, frame = message.header.stamp.to_sec(), message.header.frame_id
        known: Dict[Tuple[str, str], Pose3D] = {}

        def pose(to_frame: str, from_frame: str) -> Pose3D:
            if (to_frame, from_frame) not in known:
                known[to_frame, from_frame] = transforms.lookup(to_frame, from_frame, stamp_s)
            return known[to_frame, from_frame]

        return [
            SensorPose(
                pose(sink.costmap.params.global_frame, frame),
                pose(sink.costmap.params.global_frame, sink.source.sensor_frame or frame),
            )
            for sink in self.intake.sinks
        ]

    def _hand_over(self, message: Any, received_s: float, poses: List[SensorPose]) -> None:
        try:
            if self.data_type == "LaserScan":
                reason = self.intake.add_scan(
                    _checked_scan(message), poses, received_s, rospy.get_time()
                )
                if reason:
                    self._warn_rejected(reason)
            else:
                points, stamp_s = _cloud_points(message), message.header.stamp.to_sec()
                self.intake.add_cloud(points, poses, stamp_s, received_s)
        except MESSAGE_ERRORS as error:
            rospy.logwarn_throttle(
                5.0, "%s: %s: message dropped: %s", self._robot, self.topic, error
            )

    def _warn_rejected(self, reason: str) -> None:
        period_s = self.intake.expected_period_s
        then = f"; hovering after {period_s:g} s without a valid scan" if period_s > 0.0 else ""
        self._warnings.warn(f"{self._robot}: scan rejected: {reason}{then}")


def _checked_scan(message: Any) -> Scan:
    """Convert a scan.

    Raises:
        ValueError: The scan cannot be used.
    """
    scan = scan_from_message(message)
    problem = scan_problem(scan)
    if problem:
        raise ValueError(problem)
    return scan


def _cloud_points(message: Any) -> NDArray[np.float32]:
    """Return the finite points of a cloud, float32[n, 3] in the message's frame.

    Raises:
        ValueError: The cloud has too many points.
        Exception: What numpy and struct raise for a message shorter than it declares.
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


def connect(
    robot: str,
    costmaps: Sequence[LayeredCostmap],
    params: ScanValidatorParams,
    names: Names = own_node,
) -> List[Sensor]:
    """Subscribe to every source of every obstacle layer, to each topic once.

    Args:
        robot: Name with which log lines begin.
        costmaps: The robot's costmaps.
        params: Parameters of the scan validation.
        names: Resolves the names of topics.
    """
    sinks: Dict[Tuple[str, str], List[Sink]] = {}
    for sink in sinks_of(costmaps):
        source = sink.source
        key = (names(source.topic or source.name), source.data_type)
        sinks.setdefault(key, []).append(sink)
    return [Sensor(robot, *key, takers, params) for key, takers in sinks.items()]
