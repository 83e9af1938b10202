#!/usr/bin/env python3
"""`map_server` and `map_saver`: a scene's map is published, saved, and loaded cell for cell."""

import subprocess
import sys
import tempfile
import unittest
from pathlib import Path

import rospy
import rostest
from nav_msgs.msg import MapMetaData, OccupancyGrid
from nav_msgs.srv import GetMap, LoadMap, LoadMapResponse

WAIT_S = 60.0


class MapServer(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.stem = Path(folder.name) / "saved"

    def test_1_topics_and_service_have_the_scene_s_map(self):
        grid = rospy.wait_for_message("/map", OccupancyGrid, WAIT_S)
        info = rospy.wait_for_message("/map_metadata", MapMetaData, WAIT_S)
        rospy.wait_for_service("/static_map", WAIT_S)
        answer = rospy.ServiceProxy("/static_map", GetMap)().map
        self.assertEqual((grid.header.frame_id, info), ("map", grid.info))
        self.assertEqual(answer.data, grid.data)
        # The arena has 12 m by 12 m and walls of 0.1 m around it.
        self.assertEqual((info.width, info.height), (122, 122))
        self.assertAlmostEqual(info.resolution, 0.1, places=6)
        self.assertAlmostEqual(info.origin.position.x, -0.1)
        self.assertEqual(set(grid.data), {0, 100})

    def test_2_a_saved_map_is_loaded_again_cell_for_cell(self):
        before = rospy.wait_for_message("/map", OccupancyGrid, WAIT_S)
        subprocess.run(
            [sys.executable, "-m", "quad_localization.ros.map_saver", "-f", str(self.stem)],
            check=True,
            timeout=WAIT_S,
        )
        change = rospy.ServiceProxy("/change_map", LoadMap)
        answer = change(f"{self.stem}.yaml")
        self.assertEqual(answer.result, LoadMapResponse.RESULT_SUCCESS)
        after = rospy.wait_for_message("/map", OccupancyGrid, WAIT_S)
        self.assertEqual(after.data, before.data)
        self.assertEqual(after.info.resolution, before.info.resolution)
        self.assertEqual(after.info.origin, before.info.origin)

    def test_3_a_file_that_is_no_map_changes_nothing(self):
        change = rospy.ServiceProxy("/change_map", LoadMap)
        missing = change(f"{self.stem}.yaml")
        self.assertEqual(missing.result, LoadMapResponse.RESULT_MAP_DOES_NOT_EXIST)
        broken = self.stem.with_suffix(".yaml")
        broken.write_text("image: 5")
        answer = change(str(broken))
        self.assertEqual(answer.result, LoadMapResponse.RESULT_INVALID_MAP_DATA)
        self.assertTrue(rospy.wait_for_message("/map", OccupancyGrid, WAIT_S).data)


if __name__ == "__main__":
    rospy.init_node("map_files")
    rostest.rosrun("quad", "map_files", MapServer)
