"""The switches of the parameter group ``fixes`` for moving obstacles: tracking and evasion."""

from __future__ import annotations

from typing import Tuple

from quad_nav.config.spec import Parameter, double, flag
from quad_nav.control.surroundings import EvasionParams
from quad_nav.tracking.tracks import TrackerParams

Switch = Tuple[Parameter, Tuple[type, ...]]
"""A parameter of the group and the dataclasses that own it."""

MOVING_OBSTACLES: Tuple[Switch, ...] = (
    (
        flag(
            "track_moving_obstacles",
            False,
            "track_moving_obstacles",
            "Track what moves and says nothing, such as people, in the scans of LIDARs, and leave"
            " no trace of it in the costmaps.",
        ),
        (TrackerParams,),
    ),
    (
        double(
            "moving_obstacle_range",
            10.0,
            "range_m",
            "metres",
            "Obstacles are tracked up to this range.",
            low=0,
            high=100,
        ),
        (TrackerParams,),
    ),
    (
        double(
            "moving_obstacle_min_speed",
            0.2,
            "min_speed_mps",
            "metres/s",
            "Slower obstacles count as standing.",
            low=0,
            high=5,
        ),
        (TrackerParams,),
    ),
    (
        double(
            "moving_obstacle_max_radius",
            1.0,
            "max_radius_m",
            "metres",
            "Larger obstacles count as standing.",
            low=0,
            high=10,
        ),
        (TrackerParams,),
    ),
    (
        double(
            "moving_obstacle_acceleration",
            1.5,
            "acceleration_mps2",
            "metres/s^2",
            "Standard deviation of the accelerations of tracked obstacles.",
            low=0,
            high=20,
        ),
        (TrackerParams,),
    ),
    (
        double(
            "moving_obstacle_timeout",
            1.5,
            "lost_after_s",
            "seconds",
            "A tracked obstacle that is hidden is predicted for so long.",
            low=0,
            high=60,
        ),
        (TrackerParams,),
    ),
    (
        double(
            "moving_obstacle_margin",
            0.12,
            "margin_m",
            "metres",
            "Points that are inside free space seen earlier by so much have moved.",
            low=0,
            high=1,
        ),
        (TrackerParams,),
    ),
    (
        flag(
            "avoid_moving_obstacles",
            False,
            "avoid_moving_obstacles",
            "Judge rollouts against tracked obstacles; a robot that flies sideways evades them,"
            " also while it hovers.",
        ),
        (EvasionParams,),
    ),
    (
        double(
            "moving_obstacle_clearance",
            0.1,
            "clearance_m",
            "metres",
            "Distance that the robot keeps from where tracked obstacles are predicted.",
            low=0,
            high=2,
        ),
        (EvasionParams,),
    ),
    (
        double(
            "moving_obstacle_glance",
            0.0,
            "glance_rad",
            "radians",
            "A robot that evades looks to both sides of its way by this, for what is hidden from a"
            " LIDAR that does not see all around; at 3.1416 it turns steadily.",
            low=0,
            high=3.1416,
        ),
        (EvasionParams,),
    ),
    (
        double(
            "moving_obstacle_evasion_speed",
            0.0,
            "speed_mps",
            "metres/s",
            "Greatest speed of a robot that evades; 0 for that of its local planner.",
            low=0,
            high=10,
        ),
        (EvasionParams,),
    ),
    (
        double(
            "moving_obstacle_max_acceleration",
            0.0,
            "max_acceleration_mps2",
            "metres/s^2",
            "Greatest acceleration of obstacles: a robot that flies sideways is at rest before an"
            " obstacle can reach it; 0: it need not be.",
            low=0,
            high=100,
        ),
        (EvasionParams, TrackerParams),
    ),
    (
        double(
            "moving_obstacle_max_speed",
            1.6,
            "walking_mps",
            "metres/s",
            "Greatest speed of obstacles with moving_obstacle_max_acceleration, unless they are"
            " faster already.",
            low=0.1,
            high=10,
        ),
        (EvasionParams,),
    ),
)
