#!/usr/bin/env python3
"""The tutorial's mission without a perfect pose: `localization:=amcl`, and `slam` without a map."""

import math

import numpy as np
import rospy
import rostest
import tf2_ros
from flight_case import FlightCase, Record
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid

from quad_localization.ros.map_saver import map_from_message
from quad_nav.files.shipped import shipped
from quad_nav.scenario.scene_map import scene_occupancy
from quad_nav.sim.scene_file import load_scene


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
            frame = buffer.lookup_transform("map", f"odom{i}", rospy.Time(0)).transform
            drift_m = math.hypot(frame.translation.x, frame.translation.y)
            self.assertGreater(drift_m, 0.1, "odometry has drifted, and somebody corrects it")
            self.assertAlmostEqual(frame.translation.z, 0.0)
            self.assertGreater(len(poses[i].messages), 50)
        self.check_map(map_from_message(maps.messages[-1]))

    def check_map(self, grid):
        """The occupied cells are on the scene's surfaces, to within two cells."""
        scene = load_scene(shipped("scenes", "arena.yaml"))
        near = scene_occupancy(scene, grid.spec, 2.0 * grid.spec.resolution_m) == 100
        occupied = grid.occupancy == 100
        share = np.count_nonzero(occupied & near) / np.count_nonzero(occupied)
        print(f"occupied cells: {np.count_nonzero(occupied)}, on the scene: {share:.3f}")
        self.assertGreater(share, 0.95)


if __name__ == "__main__":
    rostest.rosrun("quad", "localized_flight", LocalizedFlight)
