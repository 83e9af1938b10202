#!/usr/bin/env python3
"""Vehicles with amcl: they wait for it, fly right although odometry drifts, land without it."""

from pathlib import Path

import rospy
import rostest
import tf2_ros
from flight_case import Latest
from geometry_msgs.msg import PoseStamped
from std_msgs.msg import Bool
from vehicle_case import VehicleCase

from quad_nav.ros.common.conversions import pose_from_message, pose_from_transform

SCENE = Path(__file__).resolve().parents[2] / "scenes" / "arena.yaml"


class LocalizedVehicles(VehicleCase):
    COMMAND = (
        "udp_vehicles.py",
        "--drift",
        f"--scene={SCENE}",
        "ardupilot:14671:3:-2:30",
        "px4:14672:0:0:200",
    )

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.buffer = tf2_ros.Buffer()
        cls.listener = tf2_ros.TransformListener(cls.buffer)
        cls.truth = [Latest(f"/truth{k}", PoseStamped) for k in range(2)]
        cls.lidars = rospy.Publisher("/lidars", Bool, queue_size=1, latch=True)

    def test_a_flight(self):
        self.they_wait_until_they_are_localized()
        self.they_fly_by_amcl()
        self.they_land_when_their_lidars_fail()

    def they_wait_until_they_are_localized(self):
        self.wait_for_reason("not localized: no transform map -> odom from amcl")
        self.lidars.publish(Bool(True))
        self.wait(lambda: self.states == {0: "flying", 1: "flying"}, "flight of both")

    def wait_for_reason(self, reason):
        def holds():
            return [one.reason for one in self.values.values()] == 2 * [reason]

        self.wait(holds, f"both {reason}")

    def they_fly_by_amcl(self):
        """Each believes itself where it is, also when its odometry is 0.3 m off."""
        frames = [self.pose("map", f"odom{k}") for k in range(2)]
        self.wait(lambda: all(map(self.has_drifted, range(2), frames)), "drift of both")
        errors_m = [self.distance_m(k, self.pose("map", f"base_link{k}")) for k in range(2)]
        print(f"distances from the truth: {errors_m} m")
        self.assertLess(max(errors_m), 0.25)

    def pose(self, frame, child):
        return pose_from_transform(self.buffer.lookup_transform(frame, child, rospy.Time())).to_2d()

    def distance_m(self, robot, believed):
        truth = pose_from_message(self.truth[robot].message.pose).to_2d()
        return believed.distance_to(truth)

    def has_drifted(self, robot, frame):
        """Whether odometry would be wrong with the frame of an earlier time."""
        odom_from_base = self.pose(f"odom{robot}", f"base_link{robot}")
        return self.distance_m(robot, frame.compose(odom_from_base)) > 0.3

    def they_land_when_their_lidars_fail(self):
        self.lidars.publish(Bool(False))
        self.wait_for_reason("not localized for 1 s")
        self.assertEqual(self.states, {0: "holding", 1: "holding"})
        self.wait_for_reason("not localized for 10 s")
        self.wait(lambda: not any(one.armed for one in self.values.values()), "both on ground")


if __name__ == "__main__":
    rostest.rosrun("quad", "localized_vehicles", LocalizedVehicles)
