"""The parameters of move_base's namespaces, with the values that the original has in force.

Defaults, ranges and the order are those of the original's dynamic_reconfigure
descriptions (MoveBase, BaseLocalPlanner, Costmap2D, ObstaclePlugin,
InflationPlugin, GenericPlugin); where the documentation of move_base states
other defaults, these win at start. Parameters in the second half of a table are
read once. A default of the dataclass and one of the table are the same number;
a test compares them.
"""
from __future__ import annotations

import math
from typing import Any

from quad_nav.config.spec import Choice, Domain, Parameter, Table
from quad_nav.config.texts import numbers_from_text, polygon_from_text

GLOBAL_PLANNER = "navfn/NavfnROS"
LOCAL_PLANNER = "base_local_planner/TrajectoryPlannerROS"
_ANY, _NOT_NEGATIVE, _POSITIVE = Domain.ANY, Domain.NOT_NEGATIVE, Domain.POSITIVE


def _double(name: str, default: float, field: str, unit: str, description: str,
            domain: Domain = _NOT_NEGATIVE, low: Any = None, high: Any = None,
            **more: Any) -> Parameter:
    return Parameter(name, "double", default, field, description, unit, domain, low, high, **more)


def _int(name: str, default: int, field: str, unit: str, description: str,
         domain: Domain = _ANY, low: Any = None, high: Any = None, **more: Any) -> Parameter:
    return Parameter(name, "int", default, field, description, unit, domain, low, high, **more)


def _bool(name: str, default: bool, field: str, description: str) -> Parameter:
    return Parameter(name, "bool", default, field, description)


def _str(name: str, default: str, field: str, expected: str, description: str,
         **more: Any) -> Parameter:
    return Parameter(name, "str", default, field, description, expected, **more)


_RESTORE = _bool("restore_defaults", False, "", "Restore to the original configuration.")

NAVIGATOR = Table(
    reconfigurable=(
        _str("base_global_planner", GLOBAL_PLANNER, "base_global_planner", "a plugin's name",
             "The name of the plugin for the global planner to use with move_base."),
        _str("base_local_planner", LOCAL_PLANNER, "base_local_planner", "a plugin's name",
             "The name of the plugin for the local planner to use with move_base."),
        _double("planner_frequency", 0.0, "planner_frequency_hz", "Hz",
                "The rate in Hz at which to run the planning loop.", low=0, high=100),
        _double("controller_frequency", 20.0, "controller_frequency_hz", "Hz",
                "The rate in Hz at which to run the control loop and send velocity commands to"
                " the base.", _POSITIVE, 0, 100),
        _double("planner_patience", 5.0, "planner_patience_s", "seconds",
                "How long the planner will wait in seconds in an attempt to find a valid plan"
                " before space-clearing operations are performed.", low=0, high=100),
        _double("controller_patience", 5.0, "controller_patience_s", "seconds",
                "How long the controller will wait in seconds without receiving a valid control"
                " before space-clearing operations are performed.", low=0, high=100,
                initial=15.0),
        _int("max_planning_retries", -1, "max_planning_retries", "",
             "How many times we will recall the planner in an attempt to find a valid plan before"
             " space-clearing operations are performed", low=-1, high=1000),
        _double("conservative_reset_dist", 3.0, "conservative_reset_dist_m", "metres",
                "The distance away from the robot in meters at which obstacles will be cleared"
                " from the costmap when attempting to clear space in the map.", low=0, high=50),
        _bool("recovery_behavior_enabled", True, "recovery_behavior_enabled",
              "Whether or not to enable the move_base recovery behaviors to attempt to clear out"
              " space."),
        _bool("clearing_rotation_allowed", True, "clearing_rotation_allowed",
              "Determines whether or not the robot will attempt an in-place rotation when"
              " attempting to clear out space."),
        _bool("shutdown_costmaps", False, "shutdown_costmaps",
              "Determines whether or not to shutdown the costmaps of the node when move_base is"
              " in an inactive state"),
        _double("oscillation_timeout", 0.0, "oscillation_timeout_s", "seconds",
                "How long in seconds to allow for oscillation before executing recovery"
                " behaviors.", low=0, high=60),
        _double("oscillation_distance", 0.5, "oscillation_distance_m", "metres",
                "How far in meters the robot must move to be considered not to be oscillating.",
                low=0, high=10),
        _bool("make_plan_clear_costmap", True, "make_plan_clear_costmap",
              "Whether or not to clear the global costmap on make_plan service call."),
        _bool("make_plan_add_unreachable_goal", True, "make_plan_add_unreachable_goal",
              "Whether or not to add the original goal to the path if it is unreachable in the"
              " make_plan service call."),
        _RESTORE),
    fixed=(
        _double("clearing_radius", 0.46, "clearing_radius_m", "metres",
                "Half the side of the square that make_plan clears around the robot; when unset,"
                " local_costmap/circumscribed_radius."),
        _double("progress_timeout", 10.0, "progress_timeout_s", "seconds",
                "Not in the original: without progress_distance of motion for so long, recover."
                " 0 never does."),
        _double("progress_distance", 0.1, "progress_distance_m", "metres",
                "Not in the original: what counts as progress."),
        _double("sensor_timeout", 1.0, "sensor_timeout_s", "seconds",
                "Not in the original: stop when a sensor has been silent for so long. 0 never"
                " does.")))

TRAJECTORY_PLANNER = Table(
    reconfigurable=(
        _double("acc_lim_x", 2.5, "acc_lim_x_mps2", "m/s^2",
                "The acceleration limit of the robot in the x direction", low=0, high=20),
        _double("acc_lim_y", 2.5, "acc_lim_y_mps2", "m/s^2",
                "The acceleration limit of the robot in the y direction", low=0, high=20),
        _double("acc_lim_theta", 3.2, "acc_lim_theta_radps2", "rad/s^2",
                "The acceleration limit of the robot in the theta direction", low=0, high=20),
        _double("max_vel_x", 0.55, "max_vel_x_mps", "m/s",
                "The maximum x velocity for the robot in m/s", low=0, high=20),
        _double("min_vel_x", 0.0, "min_vel_x_mps", "m/s",
                "The minimum x velocity for the robot in m/s", _ANY, 0, 20),
        _double("max_vel_theta", 1.0, "max_vel_theta_radps", "rad/s",
                "The absolute value of the maximum rotational velocity for the robot in rad/s",
                _ANY, 0, 20),
        _double("min_vel_theta", -1.0, "min_vel_theta_radps", "rad/s",
                "The absolute value of the minimum rotational velocity for the robot in rad/s",
                _ANY, -20, 0),
        _double("min_in_place_vel_theta", 0.4, "min_in_place_vel_theta_radps", "rad/s",
                "The absolute value of the minimum in-place rotational velocity the controller"
                " will explore", low=0, high=20),
        _double("sim_time", 1.7, "sim_time_s", "seconds",
                "The amount of time to roll trajectories out for in seconds", _POSITIVE, 0, 10),
        _double("sim_granularity", 0.025, "sim_granularity_m", "metres",
                "The granularity with which to check for collisions along each trajectory in"
                " meters", _POSITIVE, 0, 5),
        _double("angular_sim_granularity", 0.025, "angular_sim_granularity_rad", "radians",
                "The distance between simulation points for angular velocity should be small"
                " enough that the robot doesn't hit things", _POSITIVE, 0, math.pi / 2),
        _double("path_distance_bias", 0.6, "path_distance_bias", "",
                "The weight for the path distance part of the cost function", low=0, high=5),
        _double("goal_distance_bias", 0.8, "goal_distance_bias", "",
                "The weight for the goal distance part of the cost function", low=0, high=5),
        _double("occdist_scale", 0.01, "occdist_scale", "",
                "The weight for the obstacle distance part of the cost function", low=0, high=5),
        _double("oscillation_reset_dist", 0.05, "oscillation_reset_dist_m", "metres",
                "The distance the robot must travel before oscillation flags are reset, in"
                " meters", low=0, high=5),
        _double("escape_reset_dist", 0.1, "escape_reset_dist_m", "metres",
                "The distance the robot must travel before escape mode is reset, in meters",
                low=0, high=5),
        _double("escape_reset_theta", math.pi / 2, "escape_reset_theta_rad", "radians",
                "The distance the robot must rotate before escape mode is reset, in radians",
                low=0, high=5),
        _int("vx_samples", 20, "vx_samples", "",
             "The number of samples to use when exploring the x velocity space", _ANY, 1, 300),
        _int("vtheta_samples", 20, "vtheta_samples", "",
             "The number of samples to use when exploring the theta velocity space", _ANY, 1, 300),
        _double("heading_lookahead", 0.325, "heading_lookahead_m", "metres",
                "How far the robot should look ahead of itself when differentiating between"
                " different rotational velocities", low=0, high=5),
        _bool("holonomic_robot", True, "holonomic_robot",
              "Set this to true if the robot being controlled can take y velocities and false"
              " otherwise"),
        _double("escape_vel", -0.1, "escape_vel_mps", "m/s",
                "The velocity to use while backing up", _ANY, -2, 2),
        _bool("dwa", False, "dwa", "Set this to true to use the Dynamic Window Approach, false to"
              " use acceleration limits"),
        _bool("heading_scoring", False, "heading_scoring",
              "Set this to true to use the Dynamic Window Approach, false to use acceleration"
              " limits"),
        _double("heading_scoring_timestep", 0.1, "heading_scoring_timestep_s", "seconds",
                "How far to look ahead in time when we score heading based trajectories",
                low=0, high=1),
        _bool("simple_attractor", False, "simple_attractor",
              "Set this to true to allow simple attraction to a goal point instead of intelligent"
              " cost propagation"),
        _str("y_vels", "-0.3,-0.1,0.1,-0.3", "y_vels_mps", "numbers of m/s separated by commas",
             "A comma delimited list of the y velocities the controller will explore",
             convert=numbers_from_text),
        _RESTORE),
    fixed=(
        _double("max_rotational_vel", 1.0, "max_rotational_vel_radps", "rad/s",
                "The fastest turn at the goal; max_vel_theta counts on the way."),
        _double("yaw_goal_tolerance", 0.05, "yaw_goal_tolerance_rad", "radians",
                "How exact the heading at the goal has to be."),
        _double("xy_goal_tolerance", 0.1, "xy_goal_tolerance_m", "metres",
                "How close to the goal the robot has to be."),
        _bool("latch_xy_goal_tolerance", False, "latch_xy_goal_tolerance",
              "Once at the goal, only turn, even if the turn takes the robot off it."),
        _double("rot_stopped_velocity", 0.01, "rot_stopped_velocity_radps", "rad/s",
                "A slower turn counts as standing."),
        _double("trans_stopped_velocity", 0.01, "trans_stopped_velocity_mps", "m/s",
                "A slower motion counts as standing."),
        _bool("prune_plan", True, "prune_plan", "Forget the part of the plan behind the robot."),
        _bool("meter_scoring", True, "meter_scoring",
              "Distances are scored in metres. The original does so whatever is set here."),
        _bool("publish_cost_grid_pc", False, "publish_cost_grid_pc",
              "Publish the scores of all cells as a point cloud."),
        _str("global_frame_id", "odom", "global_frame_id", "a frame's name",
             "The frame of that point cloud."),
        _double("controller_frequency", 20.0, "", "Hz",
                "The rate that rollouts reckon with; when unset, move_base's own.", _ANY)),
    unsupported=(
        ("world_model", "the costmap is the only world model"),
        ("point_grid", "the costmap is the only world model")),
    ignored=(
        ("stop_time_buffer", "the original reads it and never uses it"),
        ("backup_vel", "the value of escape_vel replaces it"),
        ("acc_limit_x", "the name is acc_lim_x"),
        ("acc_limit_y", "the name is acc_lim_y"),
        ("acc_limit_th", "the name is acc_lim_theta"),
        ("acc_lim_th", "the name is acc_lim_theta")))

NAVFN = Table(fixed=(
    _bool("allow_unknown", True, "allow_unknown", "Plans may cross unknown space."),
    _double("default_tolerance", 0.0, "default_tolerance_m", "metres",
            "How far from the goal a plan may end."),
    _bool("visualize_potential", False, "visualize_potential", "Publish the potential."),
    _double("planner_window_x", 0.0, "planner_window_x_m", "metres", "Read and never used."),
    _double("planner_window_y", 0.0, "planner_window_y_m", "metres", "Read and never used.")))

CLEAR_COSTMAP = Table(fixed=(
    _double("reset_distance", 3.0, "reset_distance_m", "metres",
            "Side of the square around the robot whose outside is cleared."),
    _bool("invert_area_to_clear", False, "invert_area_to_clear", "Clear the inside instead."),
    _bool("force_updating", False, "force_updating", "Update the costmaps after clearing."),
    _str("affected_maps", "both", "affected_maps", "local, global or both",
         "Which costmaps are cleared.")))

ROTATE = Table(fixed=(
    _double("frequency", 20.0, "frequency_hz", "Hz", "Rate of commands.", _POSITIVE),
    _double("sim_granularity", 0.017, "sim_granularity_rad", "radians",
            "Step of the collision check along the turn.", _POSITIVE),
    _bool("stop_afterwards", True, "stop_afterwards",
          "Not in the original: send a stop after the turn.")))

# The turn also takes these from TrajectoryPlannerROS, with defaults of its own.
ROTATE_FROM_PLANNER = (
    _double("yaw_goal_tolerance", 0.10, "yaw_goal_tolerance_rad", "radians", ""),
    _double("acc_lim_theta", 3.2, "acc_lim_theta_radps2", "rad/s^2", ""),
    _double("max_vel_theta", 1.0, "max_vel_theta_radps", "rad/s", ""),
    _double("min_in_place_vel_theta", 0.4, "min_in_place_vel_theta_radps", "rad/s", ""))

_ENABLED = _bool("enabled", True, "enabled", "Whether to apply this plugin or not")

_VOXELS = tuple((name, "voxels are not supported here") for name in (
    "origin_z", "z_resolution", "z_voxels", "unknown_threshold", "mark_threshold",
    "publish_voxel_map"))

COSTMAP = Table(
    reconfigurable=(
        _double("transform_tolerance", 0.3, "transform_tolerance_s", "seconds",
                "Specifies the delay in transform (tf) data that is tolerable in seconds.",
                low=0, high=10),
        _double("update_frequency", 5.0, "update_frequency_hz", "Hz",
                "The frequency in Hz for the map to be updated.", low=0, high=100),
        _double("publish_frequency", 0.0, "publish_frequency_hz", "Hz",
                "The frequency in Hz for the map to publish display information.",
                low=0, high=100),
        _int("width", 10, "width_m", "metres", "The width of the map in meters.", _POSITIVE, 0,
             convert=float),
        _int("height", 10, "height_m", "metres", "The height of the map in meters.", _POSITIVE, 0,
             convert=float),
        _double("resolution", 0.05, "resolution_m", "metres",
                "The resolution of the map in meters/cell.", _POSITIVE, 0, 50),
        _double("origin_x", 0.0, "origin_x_m", "metres",
                "The x origin of the map in the global frame in meters.", _ANY),
        _double("origin_y", 0.0, "origin_y_m", "metres",
                "The y origin of the map in the global frame in meters.", _ANY),
        _str("footprint", "[]", "footprint", "a list [[x1, y1], [x2, y2], [x3, y3], ...] of metres",
             "The footprint of the robot specified in the robot_base_frame coordinate frame as a"
             " list in the format: [ [x1, y1], [x2, y2], ...., [xn, yn] ].",
             convert=polygon_from_text),
        _double("robot_radius", 0.46, "robot_radius_m", "metres",
                "The radius of the robot in meters, this parameter should only be set for"
                " circular robots, all others should use the footprint parameter described"
                " above.", low=0, high=10),
        _double("footprint_padding", 0.01, "footprint_padding_m", "metres",
                "How much to pad (increase the size of) the footprint, in meters.", _ANY)),
    fixed=(
        _str("global_frame", "map", "global_frame", "a frame's name", "The costmap's frame."),
        _str("robot_base_frame", "base_link", "robot_base_frame", "a frame's name",
             "The robot's frame."),
        _bool("rolling_window", False, "rolling_window", "The map moves with the robot."),
        _bool("track_unknown_space", False, "track_unknown_space",
              "Cells are unknown, not free, until they are seen."),
        _bool("always_send_full_costmap", False, "always_send_full_costmap",
              "Publish the whole grid, never an update."),
        _double("inscribed_radius", 0.325, "", "metres", "Of local_costmap: read and never used."),
        _double("circumscribed_radius", 0.46, "", "metres",
                "Of local_costmap: a quarter of aggressive_reset/reset_distance.")))

OBSTACLE_LAYER = Table(
    reconfigurable=(
        _ENABLED,
        _bool("footprint_clearing_enabled", True, "footprint_clearing_enabled",
              "Whether to clear the robot's footprint of lethal obstacles"),
        _double("max_obstacle_height", 2.0, "max_obstacle_height_m", "metres",
                "The maximum height of any obstacle to be inserted into the costmap in meters.",
                _ANY, 0, 50),
        _int("combination_method", 1, "combination_method", "",
             "Method for combining two layers",
             choices=(Choice("Overwrite", 0, "Overwrite values"),
                      Choice("Maximum", 1, "Take the maximum of the values"),
                      Choice("Nothing", 99, "Do nothing")),
             choices_description="Method for combining layers enum")),
    fixed=(
        _double("obstacle_range", 2.5, "obstacle_range_m", "metres",
                "Obstacles further off are not marked, for sources that set none."),
        _double("raytrace_range", 3.0, "raytrace_range_m", "metres",
                "Space further off is not cleared, for sources that set none."),
        _bool("track_unknown_space", False, "track_unknown_space",
              "When unset, as the costmap."),
        _str("observation_sources", "", "", "names separated by blanks",
             "The sensors; each has a namespace of its name.")),
    unsupported=_VOXELS)

SOURCE = Table(fixed=(
    _str("topic", "", "topic", "a topic's name", "When unset, the source's name."),
    _str("sensor_frame", "", "sensor_frame", "a frame's name",
         "Where the sensor is; when unset, the frame of its messages."),
    _str("data_type", "PointCloud", "data_type", "LaserScan, PointCloud or PointCloud2",
         "The type of the topic."),
    _double("observation_persistence", 0.0, "observation_persistence_s", "seconds",
            "How long an observation counts; 0 keeps only the newest."),
    _double("expected_update_rate", 0.0, "expected_update_period_s", "seconds",
            "Not a rate but a period: a sensor that is silent for longer makes the costmap"
            " not current. 0 never does."),
    _double("min_obstacle_height", 0.0, "min_obstacle_height_m", "metres",
            "Lower points are dropped.", _ANY),
    _double("max_obstacle_height", 2.0, "max_obstacle_height_m", "metres",
            "Higher points are dropped.", _ANY),
    _double("obstacle_range", 2.5, "obstacle_range_m", "metres",
            "Obstacles further off are not marked; when unset, the layer's."),
    _double("raytrace_range", 3.0, "raytrace_range_m", "metres",
            "Space further off is not cleared; when unset, the layer's."),
    _bool("marking", True, "marking", "The sensor marks obstacles."),
    _bool("clearing", False, "clearing", "The sensor clears the space in front of them."),
    _bool("inf_is_valid", False, "inf_is_valid",
          "Beams of a LaserScan that return inf clear up to range_max.")))

INFLATION_LAYER = Table(reconfigurable=(
    _ENABLED,
    _double("cost_scaling_factor", 10.0, "cost_scaling_factor", "1/m",
            "A scaling factor to apply to cost values during inflation.", low=0, high=100),
    _double("inflation_radius", 0.55, "inflation_radius_m", "metres",
            "The radius in meters to which the map inflates obstacle cost values.",
            low=0, high=50),
    _bool("inflate_unknown", False, "inflate_unknown", "Whether to inflate unknown cells.")))

STATIC_LAYER = Table(
    reconfigurable=(_ENABLED,),
    fixed=(
        _str("map_topic", "map", "map_topic", "a topic's name", "Where the map comes from."),
        _bool("first_map_only", False, "first_map_only", "Later maps are ignored."),
        _bool("subscribe_to_updates", False, "subscribe_to_updates",
              "Listen to map_topic_updates as well."),
        _bool("track_unknown_space", True, "track_unknown_space",
              "Unknown cells of the map stay unknown."),
        _bool("use_maximum", False, "use_maximum", "Take the higher of map and master cost."),
        _int("lethal_cost_threshold", 100, "lethal_cost_threshold", "",
             "Occupancies from here on are obstacles.", low=0, high=100),
        _int("unknown_cost_value", -1, "unknown_cost_value", "",
             "The occupancy that means unknown.", low=-1, high=255),
        _bool("trinary_costmap", True, "trinary_costmap",
              "Cells are free, unknown or obstacles, nothing between.")))
