"""Compile the kernels of localization, which takes a while at their first call."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from quad_localization.localizer import Amcl, Observation, PoseEstimate
from quad_localization.occupancy_map import OccupancyMap
from quad_localization.parameters import LASER_MODELS, ODOM_MODELS, AmclParams
from quad_localization.slam import Slam
from quad_nav.geometry import Pose2D, Pose3D, Scan


def warm_up_amcl() -> None:
    """Localise a robot in a small room by each model."""
    room = np.zeros((20, 20), np.int8)
    room[0] = 100
    grid = OccupancyMap.from_occupancy(room, 0.1, 0.0, 0.0)
    scan = Scan(0.0, -math.pi, math.pi / 8, 0.02, 60.0, np.full(16, 1.0, np.float32))
    few = AmclParams(max_particles=100, resample_interval=1, update_min_d_m=0.0)
    for laser, odometry in zip(LASER_MODELS, ODOM_MODELS):
        amcl = Amcl(replace(few, laser_model_type=laser, odom_model_type=odometry), seed=0)
        amcl.set_map(grid, PoseEstimate(Pose2D(1.0, 1.0), 0.01 * np.eye(3)))
        for x_m in (0.0, 0.1):
            pose = Pose2D(x_m, 0.0).to_3d()
            amcl.update(Observation("lidar", scan, Pose3D(0.0, 0.0, 0.0), pose))
        amcl.set_uniform()


def warm_up_slam() -> None:
    """Let two robots take a scan in a round room."""
    ranges_m = np.full(64, 2.0, np.float32)
    scan = Scan(0.0, -math.pi, math.tau / len(ranges_m), 0.02, 60.0, ranges_m)
    slam = Slam({0: Pose2D(0.0, 0.0), 1: Pose2D(0.1, 0.0)})
    for robot in (0, 1):
        slam.add_scan(robot, scan, Pose2D(0.0, 0.0), Pose3D(0.0, 0.0, 1.0))


if __name__ == "__main__":
    warm_up_amcl()
    warm_up_slam()
