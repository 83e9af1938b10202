#!/usr/bin/env python3
"""A walker is tracked by running navigators: markers, numbers, and the switch in flight."""

import math

import numpy as np
import rostest
from flight_case import FlightCase
from quad.msg import MovingObstacles
from visualization_msgs.msg import Marker, MarkerArray

from quad_nav.scenario.rules import START_S

TOPIC = "/move_base0/moving_obstacle_tracks"
X_M, SPEED_MPS, RADIUS_M = 5.0, 1.0, 0.3


def y_at(time_s):
    """Return where the walker is; it starts when the clock does, at START_S."""
    return 3.0 + 6.0 - abs((time_s - START_S) % 12.0 - 6.0)


class Tracking(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.start()

    def test_1_the_walker_is_tracked_in_the_odometry_frame(self):
        tracks = self.record(TOPIC, MovingObstacles)
        self.wait(lambda: len(tracks.messages) >= 40, "40 messages")
        errors = []
        for message in tracks.messages:
            self.assertEqual(message.header.frame_id, "odom0")
            now_s = message.header.stamp.to_sec()
            for one in message.obstacles:
                errors.append(math.hypot(one.x - X_M, one.y - y_at(now_s)))
                self.assertAlmostEqual(one.radius, RADIUS_M, delta=0.1)
                self.assertAlmostEqual(math.hypot(one.vx, one.vy), SPEED_MPS, delta=1.2)
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
