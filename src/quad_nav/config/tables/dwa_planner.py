"""Parameters of ``DWAPlannerROS``.

The planner warns about the names that it had before ROS Melodic and does not read them, upstream as
here.
"""

from __future__ import annotations

from quad_nav.config.spec import RESTORE_DEFAULTS, Domain, Table, double, flag, integer, text

_ANY, _POSITIVE = Domain.ANY, Domain.POSITIVE


# Read from the planner's namespace or from the node's level, as upstream does.
LATCH = flag(
    "latch_xy_goal_tolerance",
    False,
    "latch_xy_goal_tolerance",
    "Once at the goal, only turn, even if the robot drifts off it.",
)


_LIMITS = (
    double(
        "max_vel_trans",
        0.55,
        "max_vel_trans_mps",
        "m/s",
        "The absolute value of the maximum translational velocity for the robot in m/s",
        low=0,
    ),
    double(
        "min_vel_trans",
        0.1,
        "min_vel_trans_mps",
        "m/s",
        "The absolute value of the minimum translational velocity for the robot in m/s",
        low=0,
    ),
    double(
        "max_vel_x",
        0.55,
        "max_vel_x_mps",
        "m/s",
        "The maximum x velocity for the robot in m/s",
        _ANY,
    ),
    double(
        "min_vel_x",
        0.0,
        "min_vel_x_mps",
        "m/s",
        "The minimum x velocity for the robot in m/s",
        _ANY,
    ),
    double(
        "max_vel_y",
        0.1,
        "max_vel_y_mps",
        "m/s",
        "The maximum y velocity for the robot in m/s",
        _ANY,
    ),
    double(
        "min_vel_y",
        -0.1,
        "min_vel_y_mps",
        "m/s",
        "The minimum y velocity for the robot in m/s",
        _ANY,
    ),
    double(
        "max_vel_theta",
        1.0,
        "max_vel_theta_radps",
        "rad/s",
        "The absolute value of the maximum rotational velocity for the robot in rad/s",
        low=0,
    ),
    double(
        "min_vel_theta",
        0.4,
        "min_vel_theta_radps",
        "rad/s",
        "The absolute value of the minimum rotational velocity for the robot in rad/s",
        low=0,
    ),
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
        "acc_lim_trans",
        0.1,
        "",
        "m/s^2",
        "The absolute value of the maximum translational acceleration for the robot in m/s^2"
        " (read and never used)",
        low=0,
    ),
)


_GOAL = (
    flag(
        "prune_plan",
        False,
        "prune_plan",
        "Start following closest point of global plan, not first point (if different).",
    ),
    double(
        "xy_goal_tolerance",
        0.1,
        "xy_goal_tolerance_m",
        "metres",
        "Within what maximum distance we consider the robot to be in goal",
    ),
    double(
        "yaw_goal_tolerance",
        0.1,
        "yaw_goal_tolerance_rad",
        "radians",
        "Within what maximum angle difference we consider the robot to face goal direction",
    ),
    double(
        "trans_stopped_vel",
        0.1,
        "trans_stopped_velocity_mps",
        "m/s",
        "Below what maximum velocity we consider the robot to be stopped in translation",
    ),
    double(
        "theta_stopped_vel",
        0.1,
        "rot_stopped_velocity_radps",
        "rad/s",
        "Below what maximum rotation velocity we consider the robot to be stopped in rotation",
    ),
)


_SIMULATION = (
    double(
        "sim_time",
        1.7,
        "sim_time_s",
        "seconds",
        "The amount of time to roll trajectories out for in seconds",
        _POSITIVE,
        0,
    ),
    double(
        "sim_granularity",
        0.025,
        "sim_granularity_m",
        "metres",
        "The granularity with which to check for collisions along each trajectory in meters",
        _POSITIVE,
        0,
    ),
    double(
        "angular_sim_granularity",
        0.1,
        "angular_sim_granularity_rad",
        "radians",
        "The granularity with which to check for collisions for rotations in radians",
        _POSITIVE,
        0,
    ),
)


_SCORING = (
    double(
        "path_distance_bias",
        0.6,
        "path_distance_bias",
        "",
        "The weight for the path distance part of the cost function",
        low=0,
    ),
    double(
        "goal_distance_bias",
        0.8,
        "goal_distance_bias",
        "",
        "The weight for the goal distance part of the cost function",
        low=0,
    ),
    double(
        "occdist_scale",
        0.01,
        "occdist_scale",
        "",
        "The weight for the obstacle distance part of the cost function",
        low=0,
    ),
    double(
        "twirling_scale",
        0.0,
        "twirling_scale",
        "",
        "The weight for penalizing any changes in robot's heading",
        low=0,
    ),
    double(
        "stop_time_buffer",
        0.2,
        "",
        "seconds",
        "The amount of time that the robot must stop before a collision in order for a"
        " trajectory to be considered valid in seconds (read and never used)",
        low=0,
    ),
    double(
        "oscillation_reset_dist",
        0.05,
        "oscillation_reset_dist_m",
        "metres",
        "The distance the robot must travel before oscillation flags are reset, in meters",
        low=0,
    ),
    double(
        "oscillation_reset_angle",
        0.2,
        "oscillation_reset_angle_rad",
        "radians",
        "The angle the robot must turn before oscillation flags are reset, in radians",
        low=0,
    ),
    double(
        "forward_point_distance",
        0.325,
        "forward_point_distance_m",
        "metres",
        "The distance from the center point of the robot to place an additional scoring point,"
        " in meters",
        _ANY,
    ),
    double(
        "scaling_speed",
        0.25,
        "scaling_speed_mps",
        "m/s",
        "The absolute value of the velocity at which to start scaling the robot's footprint,"
        " in m/s",
        low=0,
    ),
    double(
        "max_scaling_factor",
        0.2,
        "max_scaling_factor",
        "",
        "The maximum factor to scale the robot's footprint by",
        low=0,
    ),
)


_SAMPLES = (
    integer(
        "vx_samples",
        3,
        "vx_samples",
        "",
        "The number of samples to use when exploring the x velocity space",
        _ANY,
        1,
    ),
    integer(
        "vy_samples",
        10,
        "vy_samples",
        "",
        "The number of samples to use when exploring the y velocity space",
        _ANY,
        1,
    ),
    integer(
        "vth_samples",
        20,
        "vth_samples",
        "",
        "The number of samples to use when exploring the theta velocity space",
        _ANY,
        1,
    ),
    flag(
        "use_dwa",
        True,
        "use_dwa",
        "Use dynamic window approach to constrain sampling velocities to small window.",
    ),
    RESTORE_DEFAULTS,
)


DWA_TABLE = Table(
    reconfigurable=_LIMITS + _GOAL + _SIMULATION + _SCORING + _SAMPLES,
    fixed=(
        LATCH,
        flag(
            "sum_scores",
            False,
            "sum_scores",
            "Sum the costs of cells along a trajectory; otherwise use the highest.",
        ),
        double(
            "cheat_factor",
            1.0,
            "cheat_factor",
            "",
            "Nearer to the local goal than forward_point_distance times the square root of this,"
            " the robot need not point along the path.",
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
            "The rate that sampling assumes; move_base's own if unset.",
            _ANY,
        ),
    ),
    unsupported=(
        ("publish_traj_pc", "the sampled trajectories are not published"),
        ("odom_topic", "the topic of the odometry is odom; remap it"),
    ),
    ignored=(
        ("max_trans_vel", "renamed to max_vel_trans"),
        ("min_trans_vel", "renamed to min_vel_trans"),
        ("max_rot_vel", "renamed to max_vel_theta"),
        ("min_rot_vel", "renamed to min_vel_theta"),
        ("rot_stopped_vel", "renamed to theta_stopped_vel"),
        ("trans_stopped_velocity", "renamed to trans_stopped_vel"),
        ("rot_stopped_velocity", "renamed to theta_stopped_vel"),
        ("acc_lim_th", "renamed to acc_lim_theta"),
        ("acc_limit_x", "renamed to acc_lim_x"),
        ("acc_limit_y", "renamed to acc_lim_y"),
        ("acc_limit_th", "renamed to acc_lim_theta"),
        ("acc_limit_trans", "renamed to acc_lim_trans"),
        ("pdist_scale", "renamed to path_distance_bias"),
        ("gdist_scale", "renamed to goal_distance_bias"),
        ("vtheta_samples", "renamed to vth_samples"),
        ("dwa", "renamed to use_dwa"),
        ("penalize_negative_x", "upstream has removed this critic"),
    ),
)
