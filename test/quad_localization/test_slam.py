"""Slam: poses against the truth in simulated scans, and the map against the scene."""

from __future__ import annotations

import math

import numpy as np
import pytest

from quad_localization.growing_map import GrowingMap
from quad_localization.slam import Slam, SlamParams
from quad_nav.files.shipped import shipped
from quad_nav.geometry import Pose2D, Pose3D, Scan, quaternion_from_yaw
from quad_nav.scenario.scene_map import scene_occupancy
from quad_nav.sim.casters import kernel_lidars
from quad_nav.sim.flight import BodyState
from quad_nav.sim.lidar import LidarParams
from quad_nav.sim.odometry import Odometry, OdometryErrors
from quad_nav.sim.robot_state import RobotStates
from quad_nav.sim.scene_file import load_scene


class Ways:
    """Robots that are led along ways, with odometry and scans in their own frames."""

    def __init__(self, scene, starts, errors, noise_m=0.0, seed=2):
        self.scene = scene
        self.poses = np.array(starts, float)
        self.odometry = Odometry(errors, self.poses, 0.0, seed)
        self._lidars = kernel_lidars(
            LidarParams(noise_std_m=noise_m), scene, len(starts), seed, 0.3
        )
        self._now_s = 0.0

    def move(self, robot, x_m, y_m, yaw_rad):
        """Move a robot by so much in ``map``, in a tenth of a second."""
        self.poses = self.poses.copy()
        self.poses[robot] += (x_m, y_m, yaw_rad)
        self._now_s += 0.1
        self.odometry.update(self.poses, self._now_s)

    def odom(self, robot):
        """Return a robot's pose by its odometry."""
        return self.true(robot).relative_to(self.odometry.frames.map_from_odom(robot))

    def true(self, robot):
        """Return its true pose."""
        return Pose2D(*self.poses[robot].tolist())

    def scan(self, robot):
        """Return a scan of a robot's LIDAR."""
        return self._lidars.scan(self.states().bodies, [robot], self._now_s)[0]

    def states(self):
        """Return what the simulation knows."""
        rows = np.zeros((len(self.poses), 13))
        rows[:, :2], rows[:, 2] = self.poses[:, :2], self.scene.altitude_m
        rows[:, 3:7] = [quaternion_from_yaw(yaw) for yaw in self.poses[:, 2]]
        return RobotStates(BodyState(rows), self.odometry.frames)

    def add_scan(self, slam, robot):
        """Hand a scan of a robot's LIDAR to ``slam``."""
        here = self.odom(robot)
        return slam.add_scan(robot, self.scan(robot), here, lidar_at(here))


def lidar_at(pose):
    """Return the pose of a LIDAR above a pose of its robot."""
    return Pose3D(pose.x_m, pose.y_m, 1.0, quaternion_from_yaw(pose.yaw_rad))


def error(slam, ways, robot):
    """Return the errors of a robot's pose, in m and rad."""
    found = slam.poses[robot].map_from_odom.compose(ways.odom(robot))
    true = ways.true(robot)
    return found.distance_to(true), abs(math.remainder(found.yaw_rad - true.yaw_rad, math.tau))


def along(slam, ways, robot, way, steps=60):
    """Lead a robot along a way in the arena; return its largest errors."""
    worst = np.zeros(2)
    for _ in range(steps):
        ways.move(robot, *(part / steps for part in way))
        ways.add_scan(slam, robot)
        worst = np.maximum(worst, error(slam, ways, robot))
    return worst


@pytest.fixture
def arena():
    return load_scene(shipped("scenes", "arena.yaml"))


ERRORS = OdometryErrors(per_m=0.1, per_rad=0.1, turn=0.02)


def test_a_pose_is_kept_on_a_way_on_which_odometry_drifts(arena):
    ways = Ways(arena, [(1.0, 2.0, 0.0)], ERRORS, noise_m=0.02)
    slam = Slam({0: Pose2D(0.0, 0.0)})
    ways.add_scan(slam, 0)
    for way in ((0.0, 8.0, 1.0), (5.0, 0.5, -2.0), (-5.0, -0.5, 2.0), (0.0, -8.0, -1.0)):
        worst_m, worst_rad = along(slam, ways, 0, way)
        assert worst_m < 0.1 and worst_rad < 0.03
    drifted = ways.odometry.frames.map_from_odom(0)
    assert math.hypot(drifted.x_m, drifted.y_m) > 0.5


def test_the_map_is_that_of_the_scene(arena):
    """Every occupied cell is within a cell of a surface, apart from those of grazing beams."""
    ways = Ways(arena, [(1.0, 2.0, 0.0)], ERRORS)
    slam = Slam({0: Pose2D(0.0, 0.0)})
    ways.add_scan(slam, 0)
    along(slam, ways, 0, (0.0, 8.0, 1.0))
    grid = slam.map.grid()
    near = scene_occupancy(arena, grid.spec, 1.5 * grid.spec.resolution_m) == 100
    occupied = grid.occupancy == 100
    assert occupied.sum() > 500
    assert (occupied & near).sum() > 0.98 * occupied.sum()
    inside = scene_occupancy(arena, grid.spec) == 100
    assert not (inside & (grid.occupancy == 0)).sum() > 0.01 * occupied.sum()


def test_a_second_robot_finds_its_place_in_the_map_of_the_first(arena):
    """Its start pose is known to 0.14 m and 0.04 rad."""
    off = Pose2D(10.1, 1.9, math.pi + 0.04).compose(Pose2D(10.0, 2.0, math.pi).inverse())
    ways = Ways(arena, [(1.0, 2.0, 0.0), (10.0, 2.0, math.pi)], ERRORS)
    slam = Slam({0: Pose2D(0.0, 0.0), 1: off})
    ways.add_scan(slam, 0)
    ways.add_scan(slam, 1)
    assert along(slam, ways, 0, (0.0, 6.0, 1.0))[0] < 0.1
    along(slam, ways, 1, (0.0, 3.0, 1.0), 30)
    assert max(error(slam, ways, 1)) < 0.06


def test_along_a_corridor_the_way_is_that_of_odometry(tmp_path):
    """Scans between two parallel walls fit everywhere along them."""
    scene = tmp_path / "corridor.yaml"
    scene.write_text("size: [200.0, 3.0]\naltitude: 1.0\nstarts: [[100.0, 1.5, 0.0]]\n")
    ways = Ways(load_scene(scene), [(100.0, 1.5, 0.0)], OdometryErrors(turn=0.02))
    slam = Slam({0: Pose2D(0.0, 0.0)})
    ways.add_scan(slam, 0)
    along(slam, ways, 0, (5.0, 0.0, 0.0))
    found = slam.poses[0].map_from_odom.compose(ways.odom(0))
    assert found.x_m == pytest.approx(105.0, abs=0.15)
    assert (found.y_m, found.yaw_rad) == pytest.approx((1.5, 0.0), abs=0.05)
    along_m, across_m = np.sqrt(np.diag(slam.poses[0].covariance))[:2]
    assert along_m > 5.0 * across_m


def test_a_robot_that_was_carried_away_is_lost_and_does_not_spoil_the_map(arena):
    ways = Ways(arena, [(1.0, 2.0, 0.0)], OdometryErrors())
    slam = Slam({0: Pose2D(0.0, 0.0)})
    along(slam, ways, 0, (0.0, 6.0, 0.0))
    before = slam.map.grid().occupancy
    carried = Ways(arena, [(8.0, 9.0, 2.0)], OdometryErrors())
    carried.odom = lambda robot: Pose2D(1.0, 8.0)
    lost = carried.add_scan(slam, 0)
    assert lost.is_lost and lost.fit < SlamParams().lost_below
    assert np.array_equal(slam.map.grid().occupancy, before)
    slam.set_pose(0, Pose2D(8.1, 8.9, 2.05))
    found = carried.add_scan(slam, 0)
    assert not found.is_lost
    assert found.map_from_odom.compose(Pose2D(1.0, 8.0)).distance_to(carried.true(0)) < 0.1


def test_beams_that_end_on_a_peer_leave_no_trace(tmp_path):
    """Two robots face each other for a while, and one of them leaves."""
    scene = tmp_path / "room.yaml"
    scene.write_text(
        "size: [8.0, 8.0]\naltitude: 1.0\nstarts: [[3.0, 4.0, 0.0], [5.0, 4.0, 0.0]]\n"
    )
    ways = Ways(load_scene(scene), [(3.0, 4.0, 0.0), (5.0, 4.0, 0.0)], OdometryErrors())
    slam = Slam({0: Pose2D(0.0, 0.0), 1: Pose2D(0.0, 0.0)})
    ways.add_scan(slam, 1)
    for _ in range(5):
        ways.move(0, 0.0, 0.3, 0.0)
        ways.add_scan(slam, 0)
    grid = slam.map.grid()
    columns, rows = (
        [round((c + d - o) / 0.05) for d in (-0.5, 0.5)]
        for c, o in ((5.0, grid.spec.origin_x_m), (4.0, grid.spec.origin_y_m))
    )
    assert grid.occupancy[slice(*rows), slice(*columns)].max() < 100


def test_a_scan_without_points_loses_the_robot(arena):
    slam = Slam({0: Pose2D(1.0, 2.0, 0.5)})
    empty = Scan(0.0, 0.0, 0.1, 0.02, 60.0, np.full(3, np.inf, np.float32))
    place = slam.add_scan(0, empty, Pose2D(0.0, 0.0), lidar_at(Pose2D(0.0, 0.0)))
    assert (place.is_lost, place.map_from_odom) == (True, Pose2D(1.0, 2.0, 0.5))


def test_a_map_grows_to_hold_what_is_seen():
    """One beam along x: its end is occupied, the cells before it are free, the others unknown."""
    grown = GrowingMap(0.1)
    grown.insert(np.array([0.05, 0.05]), np.array([[0.55, 0.05]]))
    grown.insert(np.array([0.05, 0.05]), np.array([[30.05, 0.05]]))
    grid = grown.grid()
    row = round((0.0 - grid.spec.origin_y_m) / 0.1)
    first = round((0.0 - grid.spec.origin_x_m) / 0.1)
    assert grid.occupancy[row, first : first + 5].tolist() == [-1] * 5  # free once is not sure
    assert grid.occupancy[row, first + 300] == 100
    assert (grid.occupancy[row + 1] == -1).all()
    for _ in range(3):
        grown.insert(np.array([0.05, 0.05]), np.array([[30.05, 0.05]]))
    assert grown.grid().occupancy[row, first : first + 5].tolist() == [0] * 5
