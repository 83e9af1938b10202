"""The parameters of move_base, its planners and recoveries, as the original has them in force.

Defaults, ranges and the order are those of the original's dynamic_reconfigure
descriptions (MoveBase, BaseLocalPlanner): they win over the ones in the wiki.
Parameters in the second half of a table are read once, at start. Defaults of a
table and of the dataclass that it fills are the same; a test compares them.
"""

from __future__ import annotations

import math

from quad_nav.config.spec import Domain, Table, double, flag, integer, text
from quad_nav.config.texts import numbers_from_text

GLOBAL_PLANNER = "navfn/NavfnROS"
LOCAL_PLANNER = "base_local_planner/TrajectoryPlannerROS"
_ANY, _POSITIVE = Domain.ANY, Domain.POSITIVE

_RESTORE = flag("restore_defaults", False, "", "Restore to the original configuration.")

NAVIGATOR = Table(
    reconfigurable=(
        text(
            "base_global_planner",
            GLOBAL_PLANNER,
            "base_global_planner",
            "a plugin's name",
            "The name of the plugin for the global planner to use with move_base.",
        ),
        text(
            "base_local_planner",
            LOCAL_PLANNER,
            "base_local_planner",
            "a plugin's name",
            "The name of the plugin for the local planner to use with move_base.",
        ),
        double(
            "planner_frequency",
            0.0,
            "planner_frequency_hz",
            "Hz",
            "The rate in Hz at which to run the planning loop.",
            low=0,
            high=100,
        ),
        double(
            "controller_frequency",
            20.0,
            "controller_frequency_hz",
            "Hz",
            "The rate in Hz at which to run the control loop and send velocity commands to"
            " the base.",
            _POSITIVE,
            0,
            100,
        ),
        double(
            "planner_patience",
            5.0,
            "planner_patience_s",
            "seconds",
            "How long the planner will wait in seconds in an attempt to find a valid plan"
            " before space-clearing operations are performed.",
            low=0,
            high=100,
        ),
        double(
            "controller_patience",
            5.0,
            "controller_patience_s",
            "seconds",
            "How long the controller will wait in seconds without receiving a valid control"
            " before space-clearing operations are performed.",
            low=0,
            high=100,
            initial=15.0,
        ),
        integer(
            "max_planning_retries",
            -1,
            "max_planning_retries",
            "",
            "How many times we will recall the planner in an attempt to find a valid plan before"
            " space-clearing operations are performed",
            low=-1,
            high=1000,
        ),
        double(
            "conservative_reset_dist",
            3.0,
            "conservative_reset_dist_m",
            "metres",
            "The distance away from the robot in meters at which obstacles will be cleared"
            " from the costmap when attempting to clear space in the map.",
            low=0,
            high=50,
        ),
        flag(
            "recovery_behavior_enabled",
            True,
            "recovery_behavior_enabled",
            "Whether or not to enable the move_base recovery behaviors to attempt to clear out"
            " space.",
        ),
        flag(
            "clearing_rotation_allowed",
            True,
            "clearing_rotation_allowed",
            "Determines whether or not the robot will attempt an in-place rotation when"
            " attempting to clear out space.",
        ),
        flag(
            "shutdown_costmaps",
            False,
            "shutdown_costmaps",
            "Determines whether or not to shutdown the costmaps of the node when move_base is"
            " in an inactive state",
        ),
        double(
            "oscillation_timeout",
            0.0,
            "oscillation_timeout_s",
            "seconds",
            "How long in seconds to allow for oscillation before executing recovery behaviors.",
            low=0,
            high=60,
        ),
        double(
            "oscillation_distance",
            0.5,
            "oscillation_distance_m",
            "metres",
            "How far in meters the robot must move to be considered not to be oscillating.",
            low=0,
            high=10,
        ),
        flag(
            "make_plan_clear_costmap",
            True,
            "make_plan_clear_costmap",
            "Whether or not to clear the global costmap on make_plan service call.",
        ),
        flag(
            "make_plan_add_unreachable_goal",
            True,
            "make_plan_add_unreachable_goal",
            "Whether or not to add the original goal to the path if it is unreachable in the"
            " make_plan service call.",
        ),
        _RESTORE,
    ),
    fixed=(
        double(
            "clearing_radius",
            0.46,
            "",
            "metres",
            "Half the side of the square that make_plan clears around the robot; when unset,"
            " local_costmap/circumscribed_radius.",
        ),
        integer(
            "robot",
            0,
            "",
            "",
            "This robot's number among those that fly together. Not in the original; see peers.md.",
            low=0,
        ),
        integer(
            "robots",
            1,
            "",
            "",
            "How many fly together: the peers are the other numbers below"
            " this. Not in the original; see peers.md.",
            low=1,
        ),
    ),
)

TRAJECTORY_PLANNER = Table(
    reconfigurable=(
        double(
            "acc_lim_x",
            2.5,
            "acc_lim_x_mps2",
            "m/s^2",
            "The acceleration limit of the robot in the x direction",
            low=0,
            high=20,
        ),
        double(
            "acc_lim_y",
            2.5,
            "acc_lim_y_mps2",
            "m/s^2",
            "The acceleration limit of the robot in the y direction",
            low=0,
            high=20,
        ),
        double(
            "acc_lim_theta",
            3.2,
            "acc_lim_theta_radps2",
            "rad/s^2",
            "The acceleration limit of the robot in the theta direction",
            low=0,
            high=20,
        ),
        double(
            "max_vel_x",
            0.55,
            "max_vel_x_mps",
            "m/s",
            "The maximum x velocity for the robot in m/s",
            low=0,
            high=20,
        ),
        double(
            "min_vel_x",
            0.0,
            "min_vel_x_mps",
            "m/s",
            "The minimum x velocity for the robot in m/s",
            _ANY,
            0,
            20,
        ),
        double(
            "max_vel_theta",
            1.0,
            "max_vel_theta_radps",
            "rad/s",
            "The absolute value of the maximum rotational velocity for the robot in rad/s",
            _ANY,
            0,
            20,
        ),
        double(
            "min_vel_theta",
            -1.0,
            "min_vel_theta_radps",
            "rad/s",
            "The absolute value of the minimum rotational velocity for the robot in rad/s",
            _ANY,
            -20,
            0,
        ),
        double(
            "min_in_place_vel_theta",
            0.4,
            "min_in_place_vel_theta_radps",
            "rad/s",
            "The absolute value of the minimum in-place rotational velocity the controller"
            " will explore",
            low=0,
            high=20,
        ),
        double(
            "sim_time",
            1.7,
            "sim_time_s",
            "seconds",
            "The amount of time to roll trajectories out for in seconds",
            _POSITIVE,
            0,
            10,
        ),
        double(
            "sim_granularity",
            0.025,
            "sim_granularity_m",
            "metres",
            "The granularity with which to check for collisions along each trajectory in meters",
            _POSITIVE,
            0,
            5,
        ),
        double(
            "angular_sim_granularity",
            0.025,
            "angular_sim_granularity_rad",
            "radians",
            "The distance between simulation points for angular velocity should be small"
            " enough that the robot doesn't hit things",
            _POSITIVE,
            0,
            math.pi / 2,
        ),
        double(
            "path_distance_bias",
            0.6,
            "path_distance_bias",
            "",
            "The weight for the path distance part of the cost function",
            low=0,
            high=5,
        ),
        double(
            "goal_distance_bias",
            0.8,
            "goal_distance_bias",
            "",
            "The weight for the goal distance part of the cost function",
            low=0,
            high=5,
        ),
        double(
            "occdist_scale",
            0.01,
            "occdist_scale",
            "",
            "The weight for the obstacle distance part of the cost function",
            low=0,
            high=5,
        ),
        double(
            "oscillation_reset_dist",
            0.05,
            "oscillation_reset_dist_m",
            "metres",
            "The distance the robot must travel before oscillation flags are reset, in meters",
            low=0,
            high=5,
        ),
        double(
            "escape_reset_dist",
            0.1,
            "escape_reset_dist_m",
            "metres",
            "The distance the robot must travel before escape mode is reset, in meters",
            low=0,
            high=5,
        ),
        double(
            "escape_reset_theta",
            math.pi / 2,
            "escape_reset_theta_rad",
            "radians",
            "The distance the robot must rotate before escape mode is reset, in radians",
            low=0,
            high=5,
        ),
        integer(
            "vx_samples",
            20,
            "vx_samples",
            "",
            "The number of samples to use when exploring the x velocity space",
            _ANY,
            1,
            300,
        ),
        integer(
            "vtheta_samples",
            20,
            "vtheta_samples",
            "",
            "The number of samples to use when exploring the theta velocity space",
            _ANY,
            1,
            300,
        ),
        double(
            "heading_lookahead",
            0.325,
            "heading_lookahead_m",
            "metres",
            "How far the robot should look ahead of itself when differentiating between"
            " different rotational velocities",
            low=0,
            high=5,
        ),
        flag(
            "holonomic_robot",
            True,
            "holonomic_robot",
            "Set this to true if the robot being controlled can take y velocities and false"
            " otherwise",
        ),
        double(
            "escape_vel",
            -0.1,
            "escape_vel_mps",
            "m/s",
            "The velocity to use while backing up",
            _ANY,
            -2,
            2,
        ),
        flag(
            "dwa",
            False,
            "dwa",
            "Set this to true to use the Dynamic Window Approach, false to use acceleration limits",
        ),
        flag(
            "heading_scoring",
            False,
            "heading_scoring",
            "Set this to true to score the heading towards the path instead of the distance"
            " from it",
        ),
        double(
            "heading_scoring_timestep",
            0.1,
            "heading_scoring_timestep_s",
            "seconds",
            "How far to look ahead in time when we score heading based trajectories",
            low=0,
            high=1,
        ),
        flag(
            "simple_attractor",
            False,
            "simple_attractor",
            "Set this to true to allow simple attraction to a goal point instead of intelligent"
            " cost propagation",
        ),
        text(
            "y_vels",
            "-0.3,-0.1,0.1,-0.3",
            "y_vels_mps",
            "numbers of m/s separated by commas",
            "A comma delimited list of the y velocities the controller will explore",
            convert=numbers_from_text,
        ),
        _RESTORE,
    ),
    fixed=(
        double(
            "max_rotational_vel",
            1.0,
            "max_rotational_vel_radps",
            "rad/s",
            "The fastest turn at the goal; max_vel_theta counts on the way.",
        ),
        double(
            "yaw_goal_tolerance",
            0.05,
            "yaw_goal_tolerance_rad",
            "radians",
            "How exact the heading at the goal has to be.",
        ),
        double(
            "xy_goal_tolerance",
            0.1,
            "xy_goal_tolerance_m",
            "metres",
            "How close to the goal the robot has to be.",
        ),
        flag(
            "latch_xy_goal_tolerance",
            False,
            "latch_xy_goal_tolerance",
            "Once at the goal, only turn, even if the turn takes the robot off it.",
        ),
        double(
            "rot_stopped_velocity",
            0.01,
            "rot_stopped_velocity_radps",
            "rad/s",
            "A slower turn counts as standing.",
        ),
        double(
            "trans_stopped_velocity",
            0.01,
            "trans_stopped_velocity_mps",
            "m/s",
            "A slower motion counts as standing.",
        ),
        flag("prune_plan", True, "prune_plan", "Forget the part of the plan behind the robot."),
        flag(
            "meter_scoring",
            True,
            "meter_scoring",
            "Distances are scored in metres; in cells if it is false and fixes/respect_meter_scoring"
            " is true. The original does not heed it.",
        ),
        flag(
            "publish_cost_grid_pc",
            False,
            "publish_cost_grid_pc",
            "Publish the scores of all cells as a point cloud.",
        ),
        text(
            "global_frame_id",
            "odom",
            "global_frame_id",
            "a frame's name",
            "The frame of that point cloud.",
        ),
        double(
            "controller_frequency",
            20.0,
            "",
            "Hz",
            "The rate that rollouts reckon with; when unset, move_base's own.",
            _ANY,
        ),
    ),
    unsupported=(
        ("world_model", "the costmap is the only world model"),
        ("point_grid", "the costmap is the only world model"),
    ),
    ignored=(
        ("stop_time_buffer", "the original reads it and never uses it"),
        ("backup_vel", "the value of escape_vel replaces it"),
        ("acc_limit_x", "the name is acc_lim_x"),
        ("acc_limit_y", "the name is acc_lim_y"),
        ("acc_limit_th", "the name is acc_lim_theta"),
        ("acc_lim_th", "the name is acc_lim_theta"),
    ),
)

NAVFN = Table(
    fixed=(
        flag("allow_unknown", True, "allow_unknown", "Plans may cross unknown space."),
        double(
            "default_tolerance",
            0.0,
            "default_tolerance_m",
            "metres",
            "How far from the goal a plan may end.",
        ),
        flag("visualize_potential", False, "visualize_potential", "Publish the potential."),
        double("planner_window_x", 0.0, "planner_window_x_m", "metres", "Read and never used."),
        double("planner_window_y", 0.0, "planner_window_y_m", "metres", "Read and never used."),
    )
)

CLEAR_COSTMAP = Table(
    fixed=(
        double(
            "reset_distance",
            3.0,
            "reset_distance_m",
            "metres",
            "Side of the square around the robot whose outside is cleared.",
        ),
        flag("invert_area_to_clear", False, "invert_area_to_clear", "Clear the inside instead."),
        flag("force_updating", False, "force_updating", "Update the costmaps after clearing."),
        text(
            "affected_maps",
            "both",
            "affected_maps",
            "local, global or both",
            "Which costmaps are cleared.",
        ),
    )
)

ROTATE = Table(
    fixed=(
        double("frequency", 20.0, "frequency_hz", "Hz", "Rate of commands.", _POSITIVE),
        double(
            "sim_granularity",
            0.017,
            "sim_granularity_rad",
            "radians",
            "Step of the collision check along the turn.",
            _POSITIVE,
        ),
    )
)

MOVE_SLOW = Table(
    fixed=(
        double(
            "clearing_distance",
            0.5,
            "clearing_distance_m",
            "metres",
            "Obstacles are cleared so far to each side of the robot.",
        ),
        double(
            "limited_trans_speed",
            0.25,
            "limited_trans_speed_mps",
            "m/s",
            "Greatest speed afterwards.",
            _POSITIVE,
        ),
        double(
            "limited_rot_speed",
            0.45,
            "limited_rot_speed_radps",
            "rad/s",
            "Fastest turn afterwards.",
            _POSITIVE,
        ),
        double(
            "limited_distance",
            0.3,
            "limited_distance_m",
            "metres",
            "The limits are lifted when the robot has moved so far.",
        ),
        text(
            "planner_namespace",
            "",
            "",
            "a planner's namespace",
            "The planner that is limited: it is the local planner that flies, whatever is set.",
        ),
        text(
            "max_trans_param_name",
            "",
            "",
            "a parameter's name",
            "One more parameter of the planner that limited_trans_speed limits.",
        ),
        text(
            "max_rot_param_name",
            "",
            "",
            "a parameter's name",
            "One more parameter of the planner that limited_rot_speed limits.",
        ),
    )
)

# The turn also takes these from TrajectoryPlannerROS, with defaults of its own.
ROTATE_FROM_PLANNER = (
    double("yaw_goal_tolerance", 0.10, "yaw_goal_tolerance_rad", "radians", ""),
    double("acc_lim_theta", 3.2, "acc_lim_theta_radps2", "rad/s^2", ""),
    double("max_vel_theta", 1.0, "max_vel_theta_radps", "rad/s", ""),
    double("min_in_place_vel_theta", 0.4, "min_in_place_vel_theta_radps", "rad/s", ""),
)
