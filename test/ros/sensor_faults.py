"""Inject faults into the topics of the simulator on their way to the other nodes."""

from __future__ import annotations

import copy
import math
from collections import deque

import numpy as np
import rospy
from nav_msgs.msg import Odometry
from rosgraph_msgs.msg import Clock
from tf2_msgs.msg import TFMessage

from quad_nav.ros.common.conversions import ScanMessage

ROBOTS = 2


class SensorFaults:
    """Forwards ``/true/...``. ``fault`` names the fault of quadcopter 0's topics, "" for none;
    ``back_s`` is how far all clocks and stamps are set back."""

    def __init__(self):
        self.fault = ""
        self.back_s = 0.0
        self._kept_scan = None
        self._late_scans = deque()
        self._clock = rospy.Publisher("/clock", Clock, queue_size=10, latch=True)
        self._tf = rospy.Publisher("/tf", TFMessage, queue_size=10, latch=True)
        self._odometry = [
            rospy.Publisher(f"/odom{i}", Odometry, queue_size=10) for i in range(ROBOTS)
        ]
        self._scans = [
            rospy.Publisher(f"/scan{i}", ScanMessage, queue_size=10) for i in range(ROBOTS)
        ]
        self._subscribers = [
            rospy.Subscriber("/true/clock", Clock, self._on_clock, tcp_nodelay=True),
            rospy.Subscriber("/true/tf", TFMessage, self._on_tf, tcp_nodelay=True),
        ]
        for i in range(ROBOTS):
            self._subscribers += [
                rospy.Subscriber(
                    f"/true/odom{i}", Odometry, self._on_odometry, i, tcp_nodelay=True
                ),
                rospy.Subscriber(f"/true/scan{i}", ScanMessage, self._on_scan, i, tcp_nodelay=True),
            ]

    def _stamp(self, stamp, back_s=0.0):
        return rospy.Time.from_sec(max(stamp.to_sec() - self.back_s - back_s, 0.001))

    def _on_clock(self, message):
        self._clock.publish(Clock(self._stamp(message.clock)))

    def _on_tf(self, message):
        if self.fault == "no tf":
            return
        for transform in message.transforms:
            transform.header.stamp = self._stamp(
                transform.header.stamp, 2.0 if self.fault == "old tf" else 0.0
            )
            if self.fault == "odometry jumps" and transform.child_frame_id == "base_link0":
                transform.transform.translation.y += 0.5
        self._tf.publish(message)

    def _on_odometry(self, message, i):
        message.header.stamp = self._stamp(message.header.stamp)
        if i == 0 and self.fault == "no odometry":
            return
        if i == 0 and self.fault == "odometry jumps":
            message.pose.pose.position.y += 0.5
        self._odometry[i].publish(message)

    def _on_scan(self, message, i):
        message.header.stamp = self._stamp(message.header.stamp)
        if i == 0:
            message = self._with_fault(message)
        if message is not None:
            self._scans[i].publish(message)

    def _with_fault(self, scan):
        """The scan with the fault, None for no message."""
        fault = self.fault
        ranges = {"NaN": math.nan, "zeros": 0.0, "+inf": math.inf, "half the beams": math.nan}
        if fault == "no scans":
            return None
        if fault == "frozen, new stamps":
            frozen = copy.copy(self._kept_scan)
            frozen.header = scan.header
            return frozen
        if fault == "frozen, old stamps":
            return self._kept_scan
        if fault == "half a second late":
            self._late_scans.append(scan)
            late = (scan.header.stamp - self._late_scans[0].header.stamp).to_sec() >= 0.499
            return self._late_scans.popleft() if late else None
        self._late_scans.clear()
        if fault in ranges:
            scan.ranges = np.array(scan.ranges)
            scan.ranges[: len(scan.ranges) // 2 if fault == "half the beams" else None] = ranges[
                fault
            ]
            return scan
        self._kept_scan = scan
        return scan
