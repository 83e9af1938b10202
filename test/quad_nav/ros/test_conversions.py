"""Conversions to messages and back return the input; log messages are escaped."""

import io
import logging
import math
import warnings

import numpy as np
import pytest

rospy = pytest.importorskip("rospy")

from sensor_msgs.msg import LaserScan  # noqa: E402

from quad_nav.errors import InputError  # noqa: E402
from quad_nav.geometry import Pose3D, Scan, Twist2D, quaternion_from_euler  # noqa: E402
from quad_nav.peers.peer import Intention, idle_priority, priority_of  # noqa: E402
from quad_nav.ros.common import conversions  # noqa: E402
from quad_nav.ros.common.readiness import escape_log_messages  # noqa: E402
from quad_nav.ros.navigator.intention_topics import (  # noqa: E402
    intention_from_message,
    intention_message,
)

POSE = Pose3D(1.0, -2.0, 0.5, quaternion_from_euler(0.1, -0.2, 2.0))
TWIST = Twist2D(0.3, -0.1, 0.7)
STAMP = rospy.Time(12, 345678901)


def frames(message):
    return message.header.frame_id, message.child_frame_id, message.header.stamp


def test_poses_twists_transforms_and_odometry():
    assert conversions.pose_from_message(conversions.pose_message(POSE)) == POSE
    assert conversions.twist_from_message(conversions.twist_message(TWIST)) == TWIST
    transform = conversions.transform_message(POSE, "odom0", "base_link0", STAMP)
    assert frames(transform) == ("odom0", "base_link0", STAMP)
    assert conversions.pose_from_transform(transform) == POSE
    odometry = conversions.odometry_message(
        POSE, (0.3, -0.1, 9.0), (9.0, 9.0, 0.7), ("odom0", "base_link0"), STAMP
    )
    assert frames(odometry) == ("odom0", "base_link0", STAMP)
    assert conversions.odometry_from_message(odometry) == (POSE, TWIST)


def test_scans():
    ranges = np.array([1.5, math.inf, 0.02, 60.0], dtype=np.float32)
    scan = Scan(12.25, -math.pi, math.pi / 2, 0.02, 60.0, ranges)
    message = conversions.scan_message(scan, "Lidar0")
    assert message.header.frame_id == "Lidar0"
    assert message.angle_max == pytest.approx(math.pi / 2)
    back = conversions.scan_from_message(message)
    np.testing.assert_array_equal(back.ranges_m, ranges)
    assert (back.stamp_s, back.angle_min_rad, back.angle_increment_rad) == (
        (12.25, -math.pi, math.pi / 2)
    )
    assert (back.range_min_m, back.range_max_m) == (0.02, 60.0)


@pytest.mark.parametrize("kind", ["made", "received"])
def test_scans_serialise_under_any_numpy(kind):
    """Without ``ndarray.tostring``: numpy 2.3 lacks it, an older one warns."""
    ranges = np.array([1.5, math.inf, 0.02], dtype=np.float32)
    message = conversions.scan_message(Scan(12.25, 0.0, 0.1, 0.02, 60.0, ranges), "Lidar0")
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        packed = io.BytesIO()
        message.serialize(packed)
        if kind == "received":
            message = conversions.ScanMessage().deserialize(packed.getvalue())
            packed = io.BytesIO()
            message.serialize(packed)
    plain = LaserScan().deserialize(packed.getvalue())
    assert (plain.ranges, plain.intensities) == (tuple(ranges.tolist()), ())
    assert conversions.scan_from_message(message).ranges_m.tolist() == ranges.tolist()


def test_intentions():
    sent = Intention(priority_of(1700000012.25, 3), np.array([[1.0, 2.0], [1.5, 2.5]]))
    message = intention_message(sent, "map", 1700000020.5)
    assert (message.header.frame_id, message.header.stamp.to_sec()) == ("map", 1700000020.5)
    received = intention_from_message(message, 3)
    assert received.priority == pytest.approx(sent.priority, abs=1e-6)
    np.testing.assert_array_equal(received.path, sent.path)
    staying = Intention(idle_priority(3))  # an empty path
    received = intention_from_message(intention_message(staying, "map", 1.0), 3)
    assert (received.priority, len(received.path)) == (staying.priority, 0)


def test_times_are_rounded_to_the_nanosecond():
    assert conversions.time_message(1.0 + 1.0 / 240) == rospy.Time(1, 4166667)
    assert conversions.time_message(2.9999999999) == rospy.Time(3, 0)


def test_control_characters_in_log_messages_are_escaped():
    found, logger = [], logging.getLogger("rosout")
    handler = logging.Handler()
    handler.emit = lambda record: found.append(record.getMessage())
    escape_log_messages()
    logger.addHandler(handler)
    rospy.logwarn("%s: %d of %.1f%%: %s", "a\x1b[2J", 3, 0.5, "b\nforged\u202e")
    rospy.logwarn(f"quad0: {chr(0x9B)}2J\r")
    rospy.logwarn("faults:\n%s", InputError(["one\n\x07", "two"]))
    logger.removeHandler(handler)
    assert found == [
        "a\\x1b[2J: 3 of 0.5%: b\\nforged\\u202e",
        "quad0: \\x9b2J\\r",
        "faults:\none\\n\\x07\ntwo",
    ]
