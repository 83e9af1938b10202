"""Sensor topics of the costmaps' obstacle layers.

A message waits until tf knows the pose of its sensor at its stamp, as in upstream
move_base's message filter. When too many wait, the oldest is dropped.
"""

from __future__ import annotations

import threading
from collections import deque
from typing import Any, Callable, Deque, Dict, List, Optional, Sequence, Tuple

import numpy as np
import rospy
from numpy.typing import NDArray
from sensor_msgs.msg import PointCloud, PointCloud2, PointField

from quad_nav.costmap.scan_intake import ScanIntake, SensorPose, Sink, sinks_of
from quad_nav.errors import excerpt
from quad_nav.geometry import Pose3D
from quad_nav.ros.common.conversions import ScanMessage, scan_from_message
from quad_nav.ros.common.diagnostics import ThrottledWarnings
from quad_nav.ros.common.transforms import Transforms, TransformUnavailable
from quad_nav.ros.navigator.health_meters import InputMeter
from quad_nav.scenario.navigator_host import NavigatorHost
from quad_nav.topics.publishing import Names
from quad_nav.topics.validation import MAX_MAGNITUDE, MAX_POINTS, scan_problem, stamp_problem

MESSAGE_TYPES = {"LaserScan": ScanMessage, "PointCloud": PointCloud, "PointCloud2": PointCloud2}
QUEUE_LENGTH = 50
_FIELD_TYPES = {
    getattr(PointField, kind.upper()): kind
    for kind in ("int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64")
}


class Sensor:
    """One sensor topic of a robot and the layers that take its messages.

    Attributes:
        topic: Resolved name of the topic.
        data_type: Key of `MESSAGE_TYPES`.
        intake: Validates messages and hands them to the layers.
        meter: Counts the messages.
        subscriber: Fills the queue of waiting messages.
    """

    def __init__(self, host: NavigatorHost, topic: str, data_type: str, sinks: List[Sink]) -> None:
        self.topic = topic
        self.data_type = data_type
        self.intake = host.new_intake(sinks)
        self.meter = InputMeter(rospy.resolve_name(topic), self.intake.expected_period_s)
        self._robot = f"quad{host.configuration.robot}"
        self._waiting: Deque[Tuple[Any, float]] = deque(maxlen=QUEUE_LENGTH)
        self._warnings = ThrottledWarnings()
        self._lock = threading.Lock()
        self.subscriber = rospy.Subscriber(
            topic, MESSAGE_TYPES[data_type], self._store, queue_size=QUEUE_LENGTH
        )

    def _store(self, message: Any) -> None:
        now_s = rospy.get_time()
        self.meter.add(message.header.stamp.to_sec(), now_s)
        problem = stamp_problem(message.header.stamp.to_sec(), now_s)
        if problem:
            self._warn_dropped(problem)
            return
        with self._lock:
            self._waiting.append((message, now_s))

    def clear(self) -> None:
        """Forget waiting messages, after the clock has jumped."""
        with self._lock:
            self._waiting.clear()

    def discard_late(self) -> None:
        """Discard the waiting scans that are too old to be used, after the clock has stopped."""
        now_s = rospy.get_time()
        if self.data_type == "LaserScan":
            self._keep(lambda one: not self.intake.is_late(one.header.stamp.to_sec(), now_s))

    def _keep(self, is_kept: Callable[[Any], bool]) -> None:
        with self._lock:
            kept = [waiting for waiting in self._waiting if is_kept(waiting[0])]
            self._waiting = deque(kept, QUEUE_LENGTH)

    def _drop(self, message: Any) -> None:
        self._keep(lambda one: one is not message)

    def deliver(self, transforms: Transforms) -> None:
        """Hand every message whose transforms are known to the layers.

        One that waits for its transforms does not delay the others.
        """
        with self._lock:
            waiting = list(self._waiting)
        for message, received_s in waiting:
            try:
                poses = self._poses_if_known(transforms, message)
            except TransformUnavailable as error:
                self._drop(message)
                self._warn_dropped(f"frame '{excerpt(message.header.frame_id)}': {error}")
                continue
            if poses is not None:
                self._drop(message)
                self._hand_over(message, received_s, poses)

    def _warn_dropped(self, reason: str) -> None:
        self._warnings.warn(f"{self._robot}: {self.topic}: message dropped: {reason}")

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
        frame, latest_s = message.header.frame_id, message.header.stamp.to_sec()
        global_frame = self.intake.sinks[0].costmap.params.global_frame
        if transforms.locate(global_frame, frame, latest_s, 0.0) is None:
            return None  # the stamp is younger than tf's latest transform
        return self._poses(transforms, message)  # they may have come in this moment

    def _poses(self, transforms: Transforms, message: Any) -> List[SensorPose]:
        """Look up the sensor's poses for each sink, each pair of frames once."""
        stamp, frame = message.header.stamp, message.header.frame_id
        known: Dict[Tuple[str, str], Pose3D] = {}

        def pose(to_frame: str, from_frame: str) -> Pose3D:
            if (to_frame, from_frame) not in known:
                known[to_frame, from_frame] = transforms.lookup(to_frame, from_frame, stamp)
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
            if self.data_type != "LaserScan":
                points, stamp_s = _cloud_points(message), message.header.stamp.to_sec()
                self.intake.add_cloud(points, poses, stamp_s, received_s)
                return
            scan = scan_from_message(message)
            problem = scan_problem(scan)
            if problem:
                raise ValueError(problem)
            reason = self.intake.add_scan(scan, poses, received_s, rospy.get_time())
        except ValueError as error:
            self._warn_dropped(str(error))
            return
        if reason:
            self._warnings.warn(rejection(self._robot, reason, self.intake))


def rejection(robot: str, reason: str, intake: ScanIntake) -> str:
    """Say that a scan was rejected, and what happens next."""
    period_s = intake.expected_period_s
    then = f"; hovering after {period_s:g} s without a valid scan" if period_s > 0.0 else ""
    return f"{robot}: scan rejected: {reason}{then}"


def _cloud_points(message: Any) -> NDArray[np.float32]:
    """Return the finite points of a cloud, float32[n, 3] in the message's frame.

    Raises:
        ValueError: The cloud has too many points, or not the content that it declares.
    """
    is_list = isinstance(message, PointCloud)
    count = len(message.points) if is_list else message.width * message.height
    if count > MAX_POINTS:
        raise ValueError(f"{count} points, expected {MAX_POINTS} at most")
    with np.errstate(over="ignore", invalid="ignore"):
        if is_list:
            points = [(p.x, p.y, p.z) for p in message.points]
            cloud = np.array(points, dtype=np.float32).reshape(-1, 3)
        else:
            columns = [_column(message, name).ravel() for name in ("x", "y", "z")]
            cloud = np.stack([column.astype(np.float32) for column in columns], axis=1)
    return cloud[(np.abs(cloud) <= MAX_MAGNITUDE).all(axis=1)]


def _column(message: PointCloud2, name: str) -> NDArray[Any]:
    """Return one field of all points of a cloud, shape (height, width), as a view of its data.

    Raises:
        ValueError: The field is missing, or lies outside of the points or the data.
    """
    field = next((one for one in message.fields if one.name == name), None)
    if field is None or field.datatype not in _FIELD_TYPES:
        raise ValueError(f"no field {name} of a known datatype, expected x, y and z")
    datatype = np.dtype(_FIELD_TYPES[field.datatype])
    rows, columns = message.height, message.width
    row_step = message.row_step if rows > 1 else columns * message.point_step
    if columns and not field.offset + datatype.itemsize <= message.point_step:
        raise ValueError(
            f"field {name} at byte {field.offset}, expected it within point_step"
            f" {message.point_step}"
        )
    if row_step < columns * message.point_step:
        raise ValueError(
            f"row_step {row_step}, expected {columns} points of {message.point_step} bytes"
        )
    if rows * row_step > len(message.data):
        raise ValueError(f"{len(message.data)} bytes of data, expected {rows} rows of {row_step}")
    if rows * columns == 0:
        return np.empty((rows, columns), datatype)
    return np.ndarray(
        (rows, columns),
        datatype.newbyteorder(">" if message.is_bigendian else "<"),
        message.data,
        field.offset,
        (row_step, message.point_step),
    )


def topic_of(sink: Sink, names: Names) -> Tuple[str, str]:
    """Return the name of a sink's topic and its kind of messages, a key of `MESSAGE_TYPES`."""
    return names(sink.source.topic or sink.source.name), sink.source.data_type


def connect(host: NavigatorHost, names: Names, others: Sequence[Sink] = ()) -> List[Sensor]:
    """Subscribe to the topics of sources of obstacle layers, to each topic once.

    Args:
        host: Gets their messages.
        names: Resolves the names of topics.
        others: Sources that get their messages in another way.
    """
    takers: Dict[Tuple[str, str], List[Sink]] = {}
    for sink in sinks_of(host.costmaps):
        if sink not in others:
            takers.setdefault(topic_of(sink, names), []).append(sink)
    return [Sensor(host, *key, sinks) for key, sinks in takers.items()]
