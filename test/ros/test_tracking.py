#!/usr/bin/env python3
"""A walker is tracked by running navigators: markers, the point cloud, and the switch in flight."""

import math

import numpy as np
import rostest
from flight_case import FlightCase
from sensor_msgs.msg import PointCloud2
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.scenario.rules import START_S
from quad_nav.topics.tracked_obstacles import CLOUD_FIELDS

X_M, SPEED_MPS, RADIUS_M = 5.0, 1.0, 0.3


def y_at(time_s):
    """Return where the walker is; it starts when the clock does, at START_S."""
    return 3.0 + 6.0 - abs((time_s - START_S) % 12.0 - 6.0)


def rows(cloud):
    """Return the points of a cloud, by the names of its fields."""
    names = [field.name for field in cloud.fields]
    values = np.frombuffer(cloud.data, np.float32).reshape(cloud.width, len(names))
    return [dict(zip(names, row)) for row in values.tolist()]


class Tracking(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start()

    def test_1_the_cloud_has_the_walker_in_the_odometry_frame(self):
        clouds = self.record("/move_base0/moving_obstacles_cloud", PointCloud2)
        self.wait(lambda: len(clouds.messages) >= 40, "40 clouds")
        errors = []
        for cloud in clouds.messages:
            self.assertEqual(cloud.header.frame_id, "odom0")
            self.assertEqual([field.name for field in cloud.fields], list(CLOUD_FIELDS))
            for row in rows(cloud):
                now_s = cloud.header.stamp.to_sec()
                errors.append(math.hypot(row["x"] - X_M, row["y"] - y_at(now_s)))
                self.assertAlmostEqual(row["radius"], RADIUS_M, delta=0.1)
                self.assertAlmostEqual(math.hypot(row["vx"], row["vy"]), SPEED_MPS, delta=1.2)
        self.assertGreater(len(errors), 30)
        self.assertLess(np.median(errors), 0.1, errors)

    def test_2_markers_show_disc_ellipse_number_and_velocity(self):
        shown = self.record("/move_base1/moving_obstacles", MarkerArray)
        self.wait(lambda: any(len(one.markers) == 5 for one in shown.messages), "markers")
        markers = next(one.markers for one in shown.messages if len(one.markers) == 5)
        self.assertEqual(markers[0].action, Marker.DELETEALL)
        self.assertEqual([m.ns for m in markers[1:]], ["disc", "ellipse", "number", "velocity"])
        self.assertEqual({m.header.frame_id for m in markers[1:]}, {"odom1"})


if __name__ == "__main__":
    rostest.rosrun("quad", "tracking", Tracking)
