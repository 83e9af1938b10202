#!/usr/bin/env python3
"""The tutorial's mission without a perfect pose: `localization:=amcl`, and `slam` without a map."""

import json
import math
from pathlib import Path

import numpy as np
import rospy
import rostest
import tf2_ros
from flight_case import FlightCase, Record, trigger
from geometry_msgs.msg import PoseWithCovarianceStamped
from nav_msgs.msg import OccupancyGrid
from std_msgs.msg import String

from quad_localization.ros.map_saver import map_from_message
from quad_nav.files.shipped import shipped
from quad_nav.ros.common.conversions import pose_from_message
from quad_nav.scenario.scene_map import scene_occupancy
from quad_nav.sim.scene_file import load_scene
from quad_web.ros.actions import FlightActions
from quad_web.ros.source import FlightSource
from quad_web.view.state import LAYERS, FleetState, Wanted


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
        summaries = Record("/quad/summary", String)
        maps = Record("/map", OccupancyGrid)
        result = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        goals = [goal for robot in result["robots"] for goal in robot["goals"]]
        self.assertEqual([goal["reached"] for goal in goals], 6 * [True], goals)
        self.assertEqual(result["contacts"], [])
        error_m = result["localization"]["position_error_m"]
        self.assertTrue(0.0 < error_m["median"] < error_m["p95"] < 0.1, error_m)
        for i in (0, 1):
            drift_m = drift_of(buffer, i)
            self.assertGreater(drift_m, 0.1, "odometry has drifted, and somebody corrects it")
            self.assertGreater(len(poses[i].messages), 50)
        self.wait(lambda: summaries.messages[-1].data, "the summary")
        self.assertEqual(json.loads(summaries.messages[-1].data), result)
        self.listener.unregister()  # the page reads /tf in a form of its own
        self.check_page(name, poses[0])
        self.check_map(map_from_message(maps.messages[-1]))
        self.check_reset(poses)

    def check_page(self, name, poses):
        """The page shows the result and who is where, and takes a pose for a robot that hovers."""
        state = FleetState()
        state.add_client(Wanted(frozenset(LAYERS), 0))
        source = FlightSource(state, 2, "test")
        actions = FlightActions(source, 2, Path("/nonexistent"))
        source.start()

        def flight(key):
            item = state.item("flight")
            return item and item.data[key]

        self.wait(lambda: flight("state") == "ended", lambda: flight("state"))
        self.wait(lambda: state.item("result"), "the result")
        self.assertEqual(state.item("result").data["reached"], 6)
        self.wait(lambda: state.item("localization/0"), "where robot 0 believes itself")
        self.wait(lambda: state.item("status").data["rows"][0]["localization"], "its figures")
        last = pose_from_message(poses.messages[-1].pose.pose).to_2d()  # of the robot at rest

        def error_m():
            return state.item("status").data["rows"][0]["localization"].get("error_m")

        def has_error_after_a_pose():
            """A busy machine may lose the one true pose that belongs to it: then another one."""
            count = len(poses.messages)
            if not actions.call("set_pose", 0, last).ok:
                return False  # no subscriber yet
            self.wait(lambda: len(poses.messages) > count, "a pose after that of a person")
            end_s = rospy.get_time() + 5.0
            self.wait(lambda: error_m() is not None or rospy.get_time() > end_s, "time")
            return (error_m() or 1.0) < 0.2

        self.wait(has_error_after_a_pose, lambda: f"an error of {error_m()} m below 0.2")
        if name != "amcl":
            return
        self.wait(lambda: len(state.item("localization/0").arrays["points"]) > 100, "particles")
        count = len(poses.messages)
        answer = actions.call("set_uniform", 0)
        self.assertTrue(answer.ok, answer.text)
        self.wait(lambda: len(poses.messages) > count, "a pose of particles all over the map")

    def check_reset(self, poses):
        """After a reset robots are where they started, by odometry that begins anew."""
        counts = [len(record.messages) for record in poses]
        trigger("/simulation/reset")
        starts = load_scene(shipped("scenes", "arena.yaml")).starts
        for record, count, start in zip(poses, counts, starts):

            def has_begun_anew(record=record, count=count, start=start):
                found = (pose_from_message(one.pose.pose) for one in record.messages[count:])
                return any(pose.to_2d().distance_to(start) < 0.3 for pose in found)

            self.wait(has_begun_anew, f"a robot at its start {start}")

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
