#!/usr/bin/env python3
"""The tutorial's mission while each robot's odometry drifts and turns in the map.

The static map has two pillars that the simulation does not have, so that no LIDAR sees them: the
local costmaps know them from their static layers alone.
"""

import math
import shutil

import numpy as np
import rospy
import rostest
import tf2_ros
from flight_case import FlightCase, Record, goal_pose, trigger
from geometry_msgs.msg import Point, Pose, Quaternion
from nav_msgs.msg import MapMetaData, OccupancyGrid, Odometry, Path
from nav_msgs.srv import GetPlan
from rosgraph_msgs.msg import Log
from std_msgs.msg import Header

from quad_nav.files.shipped import shipped
from quad_nav.ros.common.conversions import pose_from_transform
from quad_nav.ros.common.nav_messages import path_message
from quad_nav.ros.common.transforms import Transforms
from quad_nav.ros.navigator.peer_topics import PeerTopics
from quad_nav.scenario.scene_map import scene_map
from quad_nav.sim.scene_file import load_scene
from quad_nav.topics.publishing import in_fleet

RESOLUTION_M = 0.05
PILLARS = ((2.25, 6.0), (9.0, 4.75))
PILLAR_RADIUS_M = 0.15
AROUND_M = 0.4  # nothing else of the map is so near a pillar
MEDIAN_M = 0.03  # a cell of the local costmap is 0.025 m
# A busy navigator draws with a transform that is up to transform_tolerance, 0.5 s, old; at a pillar
# a frame moves at 0.04 m/s + 0.02 rad/s * 10.2 m.
LARGEST_M = 0.5 * (0.04 + 0.02 * 10.2) + MEDIAN_M
LETHAL = 100
TF_WAIT = rospy.Duration(10.0)  # the transform may come after the grid


def map_with_pillars(frame="map"):
    """Return the arena's map with the pillars, which the simulation does not have."""
    static_map = scene_map(load_scene(shipped("scenes", "arena.yaml")), RESOLUTION_M)
    spec, occupancy = static_map.spec, static_map.occupancy.copy()
    rows, columns = np.indices(occupancy.shape)
    for x_m, y_m in PILLARS:
        dx_m = spec.origin_x_m + (columns + 0.5) * RESOLUTION_M - x_m
        dy_m = spec.origin_y_m + (rows + 0.5) * RESOLUTION_M - y_m
        occupancy[np.hypot(dx_m, dy_m) <= PILLAR_RADIUS_M] = 100
    info = MapMetaData(resolution=RESOLUTION_M, width=spec.size_x, height=spec.size_y)
    message = OccupancyGrid(info=info)
    message.header.frame_id = frame
    message.info.origin.position.x, message.info.origin.position.y = (
        spec.origin_x_m,
        spec.origin_y_m,
    )
    message.info.origin.orientation.w = 1.0
    message.data = occupancy.ravel().tolist()
    return message


def lethal_points(grid):
    """Return the centres of a grid's lethal cells, float64[n, 2] in the grid's frame."""
    costs = np.array(grid.data, dtype=np.int8).reshape(grid.info.height, grid.info.width)
    rows, columns = np.nonzero(costs == LETHAL)
    origin, resolution_m = grid.info.origin.position, grid.info.resolution
    return np.column_stack(
        (origin.x + (columns + 0.5) * resolution_m, origin.y + (rows + 0.5) * resolution_m)
    )


def is_inside(grid, point, margin_m):
    """Tell whether a grid covers everything within a margin of a point in its frame."""
    origin, info = grid.info.origin.position, grid.info
    return (
        margin_m <= point[0] - origin.x <= info.width * info.resolution - margin_m
        and margin_m <= point[1] - origin.y <= info.height * info.resolution - margin_m
    )


class DriftingOdometry(FlightCase):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.buffer = tf2_ros.Buffer(cache_time=rospy.Duration(1000.0))
        cls.listener = tf2_ros.TransformListener(cls.buffer)
        cls.map_topic = rospy.Publisher("/map", OccupancyGrid, queue_size=1, latch=True)
        cls.addClassCleanup(shutil.rmtree, rospy.get_param("~config"))

    def test_1_mission_and_walls(self):
        self.map_topic.publish(map_with_pillars())
        # Not `self.record`: the navigators may not have started yet.
        grids = [Record(f"/move_base{i}/local_costmap/costmap", OccupancyGrid) for i in (0, 1)]
        known_since = [self.first_transform(f"odom{i}") for i in (0, 1)]
        result = self.read_result(rospy.get_param("~result"), patience_s=380.0)
        self.assertEqual(result["contacts"], [])
        goals = [goal for robot in result["robots"] for goal in robot["goals"]]
        self.assertEqual([goal["reached"] for goal in goals], 6 * [True], goals)
        self.check_drift()
        for i, record in enumerate(grids):
            known = [g for g in record.messages if g.header.stamp >= known_since[i]]
            self.check_walls(f"odom{i}", known)

    def first_transform(self, frame):
        """Return the stamp of a transform of the frame, once one has come.

        Costmaps may come before it. They cannot be placed.
        """
        self.wait(lambda: self.buffer.can_transform("map", frame, rospy.Time(0)), frame)
        return self.buffer.lookup_transform("map", frame, rospy.Time(0)).header.stamp

    def check_drift(self):
        """At the end both frames are far from the map's, and they are different."""
        poses = [self.located("map", f"odom{i}") for i in (0, 1)]
        for pose in poses:
            self.assertGreater(math.hypot(pose.x_m, pose.y_m), 1.0)
            self.assertGreater(abs(pose.yaw_rad), 0.5)
        self.assertLess(poses[0].yaw_rad * poses[1].yaw_rad, 0.0)

    def check_walls(self, frame, grids):
        """The pillars are in the local costmap where they are in the map."""
        offsets_m = []
        for grid in grids:
            self.assertEqual(grid.header.frame_id, frame)
            transform = self.buffer.lookup_transform("map", frame, grid.header.stamp, TF_WAIT)
            map_from_odom = pose_from_transform(transform).to_2d()
            in_map = map_from_odom.transform_points(lethal_points(grid))
            for pillar in PILLARS:
                if not is_inside(grid, map_from_odom.inverse_transform(*pillar), AROUND_M):
                    continue
                near = in_map[np.hypot(*(in_map - pillar).T) < AROUND_M]
                self.assertGreater(len(near), 0, f"no pillar at {pillar} in {frame}")
                offsets_m.append(float(np.hypot(*(near.mean(axis=0) - pillar))))
        print(
            f"{frame}: {len(offsets_m)} costmaps with a pillar, offset from the map: median"
            f" {np.median(offsets_m):.3f} m, largest {max(offsets_m):.3f} m"
        )
        self.assertGreater(len(offsets_m), 10)
        self.assertLess(np.median(offsets_m), MEDIAN_M)
        self.assertLess(max(offsets_m), LARGEST_M)

    def test_2_a_map_that_cannot_be_placed_is_left_out_with_a_warning(self):
        log = self.record("/rosout", Log)
        self.map_topic.publish(map_with_pillars("nowhere"))

        def warnings():
            start = "quad0: static map in frame 'nowhere' left out of the costmap in 'odom0' until"
            return [m.msg for m in log.messages if m.msg.startswith(start)]

        self.wait(warnings, "a warning")
        self.simulated_seconds(1.0)
        self.assertEqual(len(warnings()), 1, "throttled to one in 5 s")

    def test_3_a_peer_and_its_intention_are_transformed_to_the_global_frame(self):
        """A robot with its global costmap in `odom0` hears of one with `odom1` and `map`."""
        trigger("/simulation/pause")  # or on a busy machine the intention would be too old
        self.addCleanup(trigger, "/simulation/start")
        odom0_from_map = self.located("odom0", "map")
        odom0_from_odom1 = odom0_from_map.compose(self.located("map", "odom1"))
        self.listener.unregister()  # rospy has one type for all subscribers of a topic
        peers = PeerTopics({0: in_fleet(0)}, 6, Transforms(), "odom0")
        odometry = rospy.Publisher("/odom5", Odometry, queue_size=1, latch=True)
        intention = rospy.Publisher("/move_base5/intention", Path, queue_size=1, latch=True)
        message = Odometry(header=Header(0, rospy.Time.now(), "odom1"))
        message.pose.pose = Pose(Point(1.0, 2.0, 1.0), Quaternion(0.0, 0.0, 0.0, 1.0))
        odometry.publish(message)
        path = np.array([[3.0, 4.0, 0.0], [5.0, 4.0, 0.0]])
        intention.publish(path_message(path, "map", rospy.Time.now()))

        def found():
            peers.refresh(rospy.get_time())
            return next((p for p in peers.near(0, None, 1.0) if p.name == "quad5"), None)

        self.wait(lambda: found() and len(found().intention.path) == 2, "the peer's intention")
        peer = found()
        here = odom0_from_odom1.transform(1.0, 2.0)
        # The frames are metres apart.
        self.assertLess(math.dist(here, (peer.x_m, peer.y_m)), 0.5)
        self.assertLess(math.dist(odom0_from_map.transform(3.0, 4.0), peer.intention.path[0]), 0.5)
        self.assertGreater(math.dist((1.0, 2.0), (peer.x_m, peer.y_m)), 1.0)
        self.assertGreater(math.dist((3.0, 4.0), peer.intention.path[0]), 1.0)

    def test_4_there_is_no_plan_from_a_start_in_another_frame(self):
        # The planner's own service plans in flight, too: the last goal may not have ended.
        make_plan = rospy.ServiceProxy("/move_base0/NavfnROS/make_plan", GetPlan)
        answer = make_plan(goal_pose(2.0, 2.0, frame="odom0"), goal_pose(3.0, 2.0), 0.5)
        self.assertEqual(answer.plan.poses, [])

    def located(self, to_frame, from_frame):
        transform = self.buffer.lookup_transform(to_frame, from_frame, rospy.Time(0))
        return pose_from_transform(transform).to_2d()


if __name__ == "__main__":
    rostest.rosrun("quad", "drifting_odometry", DriftingOdometry)
