"""ROS topics of stand-ins: scans from where the bodies are, `/lidar{k}`, and poses, `/truth{k}`.

Scans are published while the last message on `/lidars` is true.
"""

from __future__ import annotations

import rospy
from geometry_msgs.msg import PoseStamped
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Bool, Header
from vehicles.bodies import REST_M

from quad_nav.ros.common.conversions import pose_message, scan_message, time_message
from quad_nav.sim.casters import kernel_lidars
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import LidarParams

PERIOD_S = 0.1


class TruthTopics:
    def __init__(self, scene, bodies):
        rospy.init_node("stand_ins", disable_signals=True)
        self._bodies, self._robots, self._is_on = bodies, range(len(bodies)), False
        self._lidars = kernel_lidars(LidarParams(), scene, len(bodies), seed=0)
        self._scans = [rospy.Publisher(f"/lidar{k}", LaserScan, queue_size=2) for k in self._robots]
        self._poses = [
            rospy.Publisher(f"/truth{k}", PoseStamped, queue_size=2) for k in self._robots
        ]
        self._switch = rospy.Subscriber("/lidars", Bool, self._on_switch)
        self._next_s = 0.0

    def _on_switch(self, message):
        self._is_on = message.data

    def publish(self):
        """Publish what is due."""
        if self._bodies.now_s < self._next_s:
            return
        self._next_s = self._bodies.now_s + PERIOD_S
        now_s, rows = rospy.get_time(), self._bodies.state.rows.copy()
        rows[:, 2] -= REST_M
        for k, publisher in enumerate(self._poses):
            header = Header(0, time_message(now_s), "map")
            publisher.publish(PoseStamped(header, pose_message(self._bodies.pose(k))))
        if self._is_on:
            scans = self._lidars.scan(BodyState(rows), list(self._robots), now_s)
            for k, scan in enumerate(scans):
                self._scans[k].publish(scan_message(scan, f"laser{k}"))
