"""A recording of two robots that is written by hand, for several tests."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Optional

import numpy as np

from quad_nav.geometry import Pose2D, Pose3D, Scan, quaternion_from_yaw
from quad_nav.grid import GridSpec
from quad_nav.mission.actions import GoalEnded, SendGoal
from quad_nav.mission.goal import Goal
from quad_nav.recording import messages
from quad_nav.recording.record_file import TopicWriter, create, stamp_at
from quad_nav.sim.obstacles import Box
from quad_nav.sim.scene import BODY_RADIUS_M, Scene, Walls
from quad_nav.topics.flight_info import FLIGHT_TOPIC, RobotInfo, simulation_info
from quad_nav.topics.markers import CUBE, OBSTACLES_TOPIC, Marker
from quad_nav.topics.mission_events import EVENTS_TOPIC, mission_event

SCENE = Scene(
    "room",
    10.0,
    8.0,
    1.0,
    Walls(),
    starts=(Pose2D(1.0, 2.0),),
    obstacles=(Box("b", 5.0, 7.0, 1.0, 1.0, 2.0),),
)
LAST_S = 20.0


def x_at(time_s: float) -> float:
    """x of robot 0, which flies at 0.3 m/s; robot 1 stands at (8, 2)."""
    return 1.0 + 0.3 * time_s


def write_flight(path: Path, scene: Scene = SCENE, cart_y_m: Optional[float] = None) -> Path:
    """Write 20 s of two robots: a goal of 10 s, two scans per second, a costmap and updates.

    With ``cart_y_m`` there is the topic of moving obstacles, with one at (its time in s, this).
    """
    topics = TopicWriter(create(path))

    def write(topic, time_s, content, latched=False):
        topics.write(topic, stamp_at(time_s), content, "/node", latched)

    robots = (
        RobotInfo("quad0", (Goal(4.0, 2.0), Goal(7.0, 2.0, 0.0))),
        RobotInfo("quad1", (Goal(8.0, 2.0),)),
    )
    info = replace(simulation_info(scene, 3), robot_radius_m=BODY_RADIUS_M, robots=robots)
    write(FLIGHT_TOPIC, 0.0, messages.flight_info(info), True)
    spec = GridSpec(4, 3, 0.5, -1.0, -2.0)
    for step in range(int(LAST_S * 10) + 1):
        time_s = step / 10.0
        stamp = stamp_at(time_s)
        write("/clock", time_s, messages.clock(stamp))
        for robot, x_m in ((0, x_at(time_s)), (1, 8.0)):
            if robot == 1 and time_s > 15.0:
                continue  # lost
            frame = Pose3D(0.0, 1.0, 0.0)
            transform = messages.transform(frame, "map", f"odom{robot}", stamp)
            write("/tf", time_s, messages.message("tf2_msgs/TFMessage", [transform]))
            pose = Pose3D(x_m, 1.0, 1.0, quaternion_from_yaw(0.0))
            frames = (f"odom{robot}", f"base_link{robot}")
            speed = (0.3 if robot == 0 else 0.0, 0.0, 0.0)
            odometry = messages.odometry(pose, speed, (0.0, 0.0, 0.0), frames, stamp)
            write(f"/odom{robot}", time_s, odometry)
        if cart_y_m is not None and step % 10 == 0:
            cart = Marker("map", "moving", 0, CUBE, (time_s, cart_y_m, 1.0), (1, 1, 1), (1,) * 4)
            write(OBSTACLES_TOPIC, time_s, messages.marker_array([cart]))
        if step % 5 == 0:
            ranges = np.array([1.0, np.inf, 2.0 + time_s], np.float32)
            scan = Scan(time_s, 0.0, math.pi / 2, 0.02, 60.0, ranges)
            write("/scan0", time_s, messages.laser_scan(scan, "Lidar0", stamp))
        if step % 100 == 0:  # full grids at 0, 10 and 20 s, of free cells
            costs = np.zeros(spec.shape, np.uint8)
            grid = messages.occupancy_grid(spec, costs, "odom0", stamp)
            write("/move_base0/local_costmap/costmap", time_s, grid, True)
        elif step % 10 == 0:  # at second k, cell k % 4 of row k // 4 % 3 becomes lethal
            x0, y0 = (step // 10) % 4, (step // 40) % 3
            update = messages.grid_update(np.full((1, 1), 254, np.uint8), x0, y0, "odom0", stamp)
            write("/move_base0/local_costmap/costmap_updates", time_s, update)
    for time_s, action in (
        (1.0, SendGoal(0, 1, Pose2D(4.0, 2.0, 0.0), 1)),
        (10.0, GoalEnded(0, 1, Goal(4.0, 2.0), True, 9.0, 1)),
        (10.0, SendGoal(1, 1, Pose2D(7.0, 2.0, 0.0), 1)),
    ):
        fields = mission_event(0, time_s, action).fields
        event = messages.stamped("quad/MissionEvent", fields, stamp_at(time_s))
        write(EVENTS_TOPIC, LAST_S, event)
    topics.close()
    assert topics.problem == ""
    return path
