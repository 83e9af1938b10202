"""Convert dataclasses to messages and back, in pairs: `x_message` and `x_from_message`."""

from __future__ import annotations

from io import BytesIO
from typing import Any, List, Mapping, Tuple

import numpy as np
import rospy
from diagnostic_msgs.msg import KeyValue
from geometry_msgs.msg import (
    Point,
    Pose,
    PoseWithCovariance,
    PoseWithCovarianceStamped,
    Quaternion,
    Transform,
    TransformStamped,
    Twist,
    TwistWithCovariance,
    Vector3,
)
from nav_msgs.msg import Odometry
from numpy.typing import NDArray
from rospy.numpy_msg import numpy_msg
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Header

from quad_nav.geometry import Pose2D, Pose3D, Scan, Twist2D, covariance_36

_NO_COVARIANCE = [0.0] * 36
_NO_INTENSITIES = np.empty(0, dtype=np.float32)


def time_message(seconds: float) -> rospy.Time:
    """Round seconds to the nearest nanosecond."""
    whole = int(seconds)
    return rospy.Time(whole, round((seconds - whole) * 1e9))


def key_values(values: Mapping[str, str]) -> List[KeyValue]:
    """Convert the values of a diagnostic status."""
    return [KeyValue(key, value) for key, value in values.items()]


def twist_message(twist: Twist2D) -> Twist:
    """Convert a velocity in the body frame."""
    return Twist(Vector3(twist.vx_mps, twist.vy_mps, 0.0), Vector3(0.0, 0.0, twist.vyaw_radps))


def twist_from_message(message: Twist) -> Twist2D:
    """Return the planar part of a velocity.

    Nothing is checked: it may hold NaN or infinity, see `Twist2D.is_finite`.
    """
    return Twist2D(message.linear.x, message.linear.y, message.angular.z)


def pose_message(pose: Pose3D) -> Pose:
    """Convert a pose."""
    return Pose(Point(pose.x_m, pose.y_m, pose.z_m), Quaternion(*pose.quaternion))


def pose_estimate_message(
    pose: Pose2D, covariance: NDArray[np.float64], frame: str, stamp: rospy.Time
) -> PoseWithCovarianceStamped:
    """Convert a pose in a frame, with its covariance float64[3, 3] of x, y and yaw."""
    found = PoseWithCovariance(pose_message(pose.to_3d()), covariance_36(covariance).tolist())
    return PoseWithCovarianceStamped(Header(0, stamp, frame), found)


def pose_from_message(message: Pose) -> Pose3D:
    """Convert a pose.

    Nothing is checked: numbers may not be finite, the quaternion may not have unit length.
    """
    p, q = message.position, message.orientation
    return Pose3D(p.x, p.y, p.z, (q.x, q.y, q.z, q.w))


def transform_message(
    parent_from_child: Pose3D, parent: str, child: str, stamp: rospy.Time
) -> TransformStamped:
    """Convert a transform between two frames with its stamp."""
    return TransformStamped(Header(0, stamp, parent), child, transform(parent_from_child))


def transform(parent_from_child: Pose3D) -> Transform:
    """Convert a transform without stamp."""
    return Transform(
        Vector3(parent_from_child.x_m, parent_from_child.y_m, parent_from_child.z_m),
        Quaternion(*parent_from_child.quaternion),
    )


def pose_from_transform(message: TransformStamped) -> Pose3D:
    """Return the pose `parent_from_child`."""
    t, q = message.transform.translation, message.transform.rotation
    return Pose3D(t.x, t.y, t.z, (q.x, q.y, q.z, q.w))


def odometry_message(
    odom_from_base: Pose3D,
    linear_mps: Tuple[float, float, float],
    angular_radps: Tuple[float, float, float],
    frames: Tuple[str, str],
    stamp: rospy.Time,
) -> Odometry:
    """Make an odometry message without covariances.

    Args:
        odom_from_base: Pose of the body in the odometry frame.
        linear_mps: Linear velocity (x, y, z) in the body frame.
        angular_radps: Angular velocity (x, y, z) in the body frame.
        frames: Odometry frame and body frame.
        stamp: Time of the pose.
    """
    twist = Twist(Vector3(*linear_mps), Vector3(*angular_radps))
    return Odometry(
        Header(0, stamp, frames[0]),
        frames[1],
        PoseWithCovariance(pose_message(odom_from_base), _NO_COVARIANCE),
        TwistWithCovariance(twist, _NO_COVARIANCE),
    )


def odometry_from_message(message: Odometry) -> Tuple[Pose3D, Twist2D]:
    """Return the body's pose in the odometry frame and its velocity in the body frame."""
    return pose_from_message(message.pose.pose), twist_from_message(message.twist.twist)


class _Floats(np.ndarray):
    """An array with the method that the code of messages calls; numpy 2.3 removed it."""

    def tostring(self) -> bytes:
        return self.tobytes()


_ArrayScan: Any = numpy_msg(LaserScan)


class ScanMessage(_ArrayScan):
    """A LaserScan whose ranges are an array, which rospy serialises without conversion."""

    def serialize(self, buff: BytesIO) -> None:
        """Write the message."""
        for name in ("ranges", "intensities"):
            setattr(self, name, np.asarray(getattr(self, name), np.float32).view(_Floats))
        super().serialize(buff)


def scan_message(scan: Scan, frame: str) -> LaserScan:
    """Convert a scan.

    All beams have the same time: `time_increment` and `scan_time` are 0.
    """
    message = ScanMessage(
        angle_min=scan.angle_min_rad,
        angle_max=scan.angle_min_rad + (len(scan.ranges_m) - 1) * scan.angle_increment_rad,
        angle_increment=scan.angle_increment_rad,
        range_min=scan.range_min_m,
        range_max=scan.range_max_m,
        ranges=scan.ranges_m.astype(np.float32, copy=False),
        intensities=_NO_INTENSITIES,
    )
    message.header.frame_id, message.header.stamp = frame, time_message(scan.stamp_s)
    return message


def scan_from_message(message: LaserScan) -> Scan:
    """Convert a scan; `validation.scan_problem` checks the result."""
    return Scan(
        message.header.stamp.to_sec(),
        message.angle_min,
        message.angle_increment,
        message.range_min,
        message.range_max,
        np.array(message.ranges, dtype=np.float32),
    )
