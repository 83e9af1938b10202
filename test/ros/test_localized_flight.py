#!/usr/bin/env python3
"""The tutorial's mission without a perfect pose: `localization:=amcl`, and `slam` without a map."""

import math

import numpy as np
import rospy
import rostest
import tf2_ros
from flight_case import FlightCase, Record, trigger
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid

from quad_localization.ros.map_messages import grid_from_message
from quad_nav.files.shipped import shipped
from quad_nav.grid import GridSpec
from quad_nav.scenario.scene_map import scene_occupancy
from quad_nav.sim.scene_file import load_scene


def drift_of(buffer, robot):
    """Return how far a robot's odometry frame is from `map`."""
    place = buffer.lookup_transform("map", f"odom{robot}", rospy.Time(0)).transform.translation
    return math.hypot(place.x, place.y) + abs(place.z)


class LocalizedFlight(FlightCase):
    def test_mission(self):
        buffer = tf2_ros.Buffer()
        self.listener = tf2_ros.TransformListener(buffer)
        name = rospy.get_param("~localization")
        poses = [Record(f"/{name}_pose{i}", PoseWithCovarianceStamped) for i in (0, 1)]
        maps = Record("/map", OccupancyGrid)
        result = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        goals = [goal for robot in result["robots"] for goal in robot["goals"]]
        self.assertEqual([goal["reached"] for goal in goals], 6 * [True], goals)
        self.assertEqual(result["contacts"], [])
        for i in (0, 1):
            drift_m = drift_of(buffer, i)
            self.assertGreater(drift_m, 0.1, "odometry has drifted, and somebody corrects it")
            self.assertGreater(len(poses[i].messages), 50)
        self.check_map(grid_from_message(maps.messages[-1]))
        trigger("/simulation/reset")
        for i in (0, 1):
            self.wait(lambda i=i: drift_of(buffer, i) < 0.06, "odometry begins anew, without drift")

    def check_map(self, grid):
        """The occupied cells are on the scene's surfaces, to within two cells."""
        height, width = grid.occupancy.shape
        spec = GridSpec(width, height, grid.resolution_m, grid.origin.x_m, grid.origin.y_m)
        scene = load_scene(shipped("scenes", "arena.yaml"))
        near = scene_occupancy(scene, spec, 2.0 * grid.resolution_m) == 100
        occupied = grid.occupancy == 100
        share = np.count_nonzero(occupied & near) / np.count_nonzero(occupied)
        print(f"occupied cells: {np.count_nonzero(occupied)}, on the scene: {share:.3f}")
        self.assertGreater(share, 0.95)


if __name__ == "__main__":
    rostest.rosrun("quad", "localized_flight", LocalizedFlight)
