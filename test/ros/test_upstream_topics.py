#!/usr/bin/env python3
"""Compare names, types, latching, rates and contents of topics with those of C++ move_base.

One flight of robot 0 is recorded; robot 1 stands. Intended differences:

* each robot has the action's topics for itself (``upstream_case.OURS``);
* updates of the costmaps come exactly at ``publish_frequency``, not at the next turn after it.
"""

import numpy as np
import rosgraph
import roslib.message
import rospy
import rosservice
import rostest
from flight_case import Record, goal_pose, rate_hz, topics_sent_here
from nav_msgs.msg import Odometry
from sensor_msgs.msg import PointCloud2, PointField
from sensor_msgs.point_cloud2 import read_points
from upstream_case import ROBOTS, UpstreamCase, recorded_lines, recorded_yaml

GOAL = (9.0, 5.5)
FLIGHT_S = 22.0
CONTROLLER_HZ, STATUS_HZ, PUBLISH_HZ = 1.0, 5.0, 2.0
UPDATE_HZ = {"global_costmap": 3.0, "local_costmap": 4.0}
CELL_M, WINDOW_CELLS, REACH_M = 0.025, 120, 1.5  # of the local costmap
SILENT = {"recovery_status", "result", "global_costmap/costmap_updates"}  # nothing goes wrong


class UpstreamTopics(UpstreamCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.records = {}
        for i in ROBOTS:
            for name, kind, *_ in recorded_lines("publications.txt", i):
                cls.records[name] = Record(name, roslib.message.get_message_class(kind))
        cls.records["/odom0"] = Record("/odom0", Odometry)
        flight = cls("fly")
        flight.fly()
        flight.doCleanups()

    def fly(self):
        self.wait(
            lambda: self.records.keys() <= topics_sent_here(),
            lambda: f"sent here: {sorted(self.records.keys() - topics_sent_here())}",
        )
        self.wait(lambda: all(self.of(0, f"{name}/footprint") for name in UPDATE_HZ), "footprints")
        self.wait(
            lambda: self.of(0, "local_costmap/costmap_updates"),
            "an update while the robot stands still",
        )
        cls = type(self)
        cls.footprints_at_start = [self.of(0, f"{name}/footprint")[-1] for name in UPDATE_HZ]
        cls.goal = goal_pose(*GOAL)
        self.send(0, self.goal)
        self.wait(lambda: self.speed(0) > 0.05, "robot 0 under way")
        self.simulated_seconds(FLIGHT_S)
        self.assertEqual(self.results[0].count, 0, "the goal is too near")
        for record in self.records.values():
            record.close()

    def runTest(self):
        """Never run: for the instance that flies."""

    def of(self, i, name):
        """The recorded messages of robot i's topic."""
        return self.records[f"/move_base{i}/{name}"].messages

    def rate(self, name):
        return self.records[name].rate_hz()

    # -- names and types -----------------------------------------------------------

    def test_every_topic_is_published_with_its_type(self):
        published = dict(rospy.get_published_topics())
        publishers = dict(rosgraph.Master("/test").getSystemState()[0])
        for i in ROBOTS:
            for name, kind, *_ in recorded_lines("publications.txt", i):
                self.assertEqual(published.get(name), kind, name)
                self.assertIn(f"/move_base{i}", publishers[name], name)

    def test_every_topic_is_subscribed_to(self):
        master = rosgraph.Master("/test")
        subscribers = dict(master.getSystemState()[1])
        types = dict(master.getTopicTypes())
        for i in ROBOTS:
            for name, kind in recorded_lines("subscriptions.txt", i):
                self.assertIn(f"/move_base{i}", subscribers.get(name, ()), name)
                self.assertEqual(types.get(name), kind, name)

    def test_every_service_has_its_type(self):
        for i in ROBOTS:
            for name, kind in recorded_lines("services.txt", i):
                self.assertEqual(rosservice.get_service_type(name), kind, name)
                self.assertEqual(rosservice.get_service_node(name), f"/move_base{i}", name)

    def test_parameters_on_the_server(self):
        """All parameters of C++ move_base are there; ours has more."""
        for i in ROBOTS:
            self.assert_holds(
                rospy.get_param(f"/move_base{i}"),
                recorded_yaml("parameters.yaml", i),
                f"/move_base{i}",
            )

    def assert_holds(self, ours, recorded, place):
        for key, value in recorded.items():
            self.assertIn(key, ours, place)
            if isinstance(value, dict):
                self.assert_holds(ours[key], value, f"{place}/{key}")
            else:
                self.assertEqual(ours[key], value, f"{place}/{key}")

    def test_what_is_sent_and_what_is_latched(self):
        for name, _, *latched in recorded_lines("publications.txt", 0):
            messages = self.records[name].messages
            if name.split("/", 2)[-1] in SILENT:
                self.assertEqual(messages, [], name)
                continue
            self.assertTrue(messages, f"nothing on {name}")
            header = messages[0]._connection_header
            self.assertEqual(header["latching"], "1" if latched else "0", name)
            self.assertEqual(header["callerid"], "/move_base0")

    # -- rates ---------------------------------------------------------------------

    def test_rates(self):
        expected = {f"/move_base{i}/status": STATUS_HZ for i in ROBOTS}
        for costmap, hz in UPDATE_HZ.items():
            expected.update({f"/move_base{i}/{costmap}/footprint": hz for i in ROBOTS})
        for name in (
            "feedback",
            "TrajectoryPlannerROS/global_plan",
            "TrajectoryPlannerROS/cost_cloud",
        ):
            expected[f"/move_base0/{name}"] = CONTROLLER_HZ
        expected["/cmd_vel0"] = CONTROLLER_HZ
        for name, hz in expected.items():
            self.assertAlmostEqual(self.rate(name), hz, delta=0.1 * hz, msg=name)

    def test_local_costmap_comes_at_its_publish_frequency(self):
        """Both topics together, without the grid that a new listener gets."""
        for i in ROBOTS:
            grid, updates = (
                self.records[f"/move_base{i}/local_costmap/{name}"]
                for name in ("costmap", "costmap_updates")
            )
            hz = rate_hz(sorted(grid.stamps_s()[1:] + updates.stamps_s()))
            self.assertAlmostEqual(hz, PUBLISH_HZ, delta=0.1 * PUBLISH_HZ)

    def test_global_costmap_comes_once_for_each_new_listener(self):
        """``publish_frequency`` is 0."""
        self.assertEqual(len(self.of(0, "global_costmap/costmap")), 1)
        again = self.global_costmap(0)
        self.assertGreater(again.header.stamp, self.of(0, "global_costmap/costmap")[0].header.stamp)
        self.assertIn(100, again.data)

    # -- costmaps ------------------------------------------------------------------

    def test_grids(self):
        for name, cells, resolution_m in (
            ("global_costmap", 240, 0.05),
            ("local_costmap", WINDOW_CELLS, CELL_M),
        ):
            for grid in self.of(0, f"{name}/costmap"):
                self.assertEqual(grid.header.frame_id, "map")
                self.assertEqual((grid.info.width, grid.info.height), (cells, cells))
                self.assertAlmostEqual(grid.info.resolution, resolution_m, places=6)
                self.assertEqual(grid.info.map_load_time, rospy.Time(0))
                self.assertEqual(grid.info.origin.orientation.w, 1.0)
                self.assertTrue(set(grid.data) <= set(range(-1, 101)))
        origin = self.of(0, "global_costmap/costmap")[0].info.origin.position
        self.assertEqual((origin.x, origin.y), (0.0, 0.0))

    def test_whole_local_grid_only_when_its_origin_has_moved(self):
        grids = self.of(0, "local_costmap/costmap")[1:]  # the first was for the new listener
        self.assertGreater(len(grids), 10)
        origins = [(grid.info.origin.position.x, grid.info.origin.position.y) for grid in grids]
        for before, after in zip(origins, origins[1:]):
            self.assertNotEqual(before, after)

    def test_updates_while_it_stands(self):
        """Scans reach to all edges of the window.

        On a loaded machine scans may be missing for longer than they persist. Then the footprint is
        cleared and its surroundings inflated: 0.75 m around the robot, in the middle of the window.
        """
        updates = self.of(1, "local_costmap/costmap_updates")
        grids = self.of(1, "local_costmap/costmap")[1:]  # the first was for the new listener
        origins = [(grid.info.origin.position.x, grid.info.origin.position.y) for grid in grids]
        self.assertLessEqual(len(origins), 2)  # on a cell's border, rounding may move it by a cell
        self.assertEqual(len(set(origins)), len(origins))
        self.assertEqual({update.header.frame_id for update in updates}, {"map"})
        areas = [(update.x, update.y, update.width, update.height) for update in updates]
        whole = (0, 0, WINDOW_CELLS, WINDOW_CELLS)
        self.assertGreater(areas.count(whole), 10)
        self.assertLessEqual(set(areas), {whole, (29, 29, 62, 62)})

    def test_footprints(self):
        with_recorded = [(float(x), float(y)) for x, y in recorded_lines("footprint.txt", 0)]
        for polygon in self.footprints_at_start:
            self.assertEqual(polygon.header.frame_id, "map")
            points = [(point.x, point.y) for point in polygon.polygon.points]
            self.assertEqual(len(points), 16)
            np.testing.assert_allclose(points[:15], with_recorded, atol=0.01)

    # -- goal and feedback ---------------------------------------------------------

    def test_goal_goes_on_as_an_action_goal(self):
        (goal,) = self.of(0, "goal")
        self.assertEqual((goal.goal_id.id, goal.goal_id.stamp), ("", rospy.Time(0)))
        self.assertEqual(goal.goal.target_pose.pose, self.goal.pose)
        (current,) = self.of(0, "current_goal")
        self.assertEqual(current.header.frame_id, "map")
        self.assertEqual(current.header.stamp, self.goal.header.stamp)
        self.assertEqual(current.pose.position, self.goal.pose.position)

    def test_feedback_is_the_pose_in_the_global_frame(self):
        odometry = self.records["/odom0"].messages
        stamps_s = np.array([message.header.stamp.to_sec() for message in odometry])
        for message in self.of(0, "feedback"):
            self.assertEqual(
                message.status.text, "This goal has been accepted by the simple action server"
            )
            base = message.feedback.base_position
            self.assertEqual(base.header.frame_id, "map")
            nearest = int(np.argmin(np.abs(stamps_s - base.header.stamp.to_sec())))
            at, there = base.pose.position, odometry[nearest].pose.pose.position
            np.testing.assert_allclose((at.x, at.y, at.z), (there.x, there.y, there.z), atol=0.1)
        self.assertGreater(np.hypot(at.x - 1.5, at.y - 1.5), 3.0)

    # -- plans ---------------------------------------------------------------------

    def test_plan_comes_twice_the_second_time_with_the_goal(self):
        first, second = self.of(0, "NavfnROS/plan")
        self.assertEqual(len(first.poses) + 1, len(second.poses))
        for path in (first, second):
            self.assertEqual(path.header.frame_id, "map")
            self.assertEqual({pose.header.stamp for pose in path.poses}, {path.header.stamp})
        points = np.array([(p.pose.position.x, p.pose.position.y) for p in second.poses])
        np.testing.assert_allclose(points[-1], GOAL)
        steps_m = np.hypot(*np.diff(points[:-1], axis=0).T)
        self.assertGreaterEqual(steps_m.min(), 0.025 - 1e-6)
        self.assertLessEqual(steps_m.max(), 0.05 * 2**0.5 + 1e-6)

    def test_global_plan_has_no_time_and_stays_near(self):
        record = self.records["/move_base0/TrajectoryPlannerROS/global_plan"]
        feedback = self.records["/move_base0/feedback"]
        places = [one.feedback.base_position.pose.position for one in feedback.messages]
        for path in record.messages:
            self.assertEqual(path.header.frame_id, "map")
            self.assertEqual(
                {path.header.stamp, *(pose.header.stamp for pose in path.poses)}, {rospy.Time(0)}
            )
            points = [pose.pose.position for pose in path.poses]
            reaches_m = [max(np.hypot(p.x - at.x, p.y - at.y) for p in points) for at in places]
            self.assertLess(min(reaches_m), REACH_M + 0.1)

    def test_local_plan_is_never_empty(self):
        for path in self.of(0, "TrajectoryPlannerROS/local_plan"):
            self.assertEqual(path.header.frame_id, "map")
            self.assertTrue(path.poses)
            self.assertNotEqual(path.header.stamp, rospy.Time(0))

    # -- cost cloud ----------------------------------------------------------------

    def test_cost_cloud_has_the_form_of_upstream(self):
        """Seven floats for each cell of the window; those without a score are nan at the end."""
        names = ("x", "y", "z", "path_cost", "goal_cost", "occ_cost", "total_cost")
        fields = [PointField(name, 4 * k, PointField.FLOAT32, 1) for k, name in enumerate(names)]
        for cloud in self.of(0, "TrajectoryPlannerROS/cost_cloud"):
            self.assertEqual(cloud.header.frame_id, "map")
            self.assertEqual(cloud.fields, fields)
            self.assertEqual((cloud.height, cloud.width), (1, WINDOW_CELLS**2))
            self.assertEqual((cloud.point_step, cloud.row_step), (28, 28 * WINDOW_CELLS**2))
            self.assertFalse(cloud.is_bigendian or cloud.is_dense)
            scored = ~np.isnan(cloud_points(cloud)).any(axis=1)
            count = int(scored.sum())
            self.assertTrue(scored[:count].all())
            self.assertGreater(count, WINDOW_CELLS**2 / 4)

    def test_cost_cloud_adds_up(self):
        """Distances in cells are scored in metres: 0.6 path + 0.8 goal + 0.01 obstacles."""
        for cloud in self.of(0, "TrajectoryPlannerROS/cost_cloud"):
            points = cloud_points(cloud)
            x, y, z, path, goal, obstacles, total = points[~np.isnan(points).any(axis=1)].T
            np.testing.assert_allclose(
                total, 0.6 * CELL_M * path + 0.8 * CELL_M * goal + 0.01 * obstacles, rtol=1e-4
            )
            self.assertFalse(z.any())
            column, row = np.rint(x / CELL_M - 0.5), np.rint(y / CELL_M - 0.5)
            np.testing.assert_allclose(x, (column + 0.5) * CELL_M, atol=1e-4)
            np.testing.assert_allclose(y, (row + 0.5) * CELL_M, atol=1e-4)
            order = column * 10000 + row  # column by column
            self.assertTrue((np.diff(order) > 0).all())


def cloud_points(cloud: PointCloud2):
    return np.array(list(read_points(cloud)), dtype=np.float64)


if __name__ == "__main__":
    rostest.rosrun("quad", "upstream_topics", UpstreamTopics)
