"""Parameters of ``DWAPlannerROS``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Optional

from quad_nav.parameter import (
    ANY,
    deviation,
    fixed_flag,
    fixed_number,
    fixed_text,
    flag,
    number,
    positive,
    signed,
    whole,
)


@dataclass(frozen=True)
class DwaParams:
    """Parameters of ``dwa_local_planner/DWAPlannerROS``.

    The defaults are those that dynamic_reconfigure sets. A negative
    ``min_vel_trans_mps``, ``min_vel_theta_radps`` or ``max_vel_trans_mps`` is no limit.
    """

    max_vel_trans_mps: float = number("max_vel_trans", 0.55, "m/s", 0, None, "Largest speed.")
    min_vel_trans_mps: float = number("min_vel_trans", 0.1, "m/s", 0, None, "Smallest speed.")
    max_vel_x_mps: float = signed("max_vel_x", 0.55, "m/s", None, None, "Largest velocity in x.")
    min_vel_x_mps: float = signed("min_vel_x", 0.0, "m/s", None, None, "Smallest velocity in x.")
    max_vel_y_mps: float = signed("max_vel_y", 0.1, "m/s", None, None, "Largest velocity in y.")
    min_vel_y_mps: float = signed("min_vel_y", -0.1, "m/s", None, None, "Smallest velocity in y.")
    max_vel_theta_radps: float = number(
        "max_vel_theta", 1.0, "rad/s", 0, None, "Largest rotational speed."
    )
    min_vel_theta_radps: float = number(
        "min_vel_theta", 0.4, "rad/s", 0, None, "Smallest rotational speed."
    )
    acc_lim_x_mps2: float = number("acc_lim_x", 2.5, "m/s^2", 0, 20, "Acceleration limit in x.")
    acc_lim_y_mps2: float = number("acc_lim_y", 2.5, "m/s^2", 0, 20, "Acceleration limit in y.")
    acc_lim_theta_radps2: float = number(
        "acc_lim_theta", 3.2, "rad/s^2", 0, 20, "Rotational acceleration limit."
    )
    acc_lim_trans_mps2: float = number("acc_lim_trans", 0.1, "m/s^2", 0, None, "Never used.")
    prune_plan: bool = flag("prune_plan", False, "Remove the plan behind the robot.")
    xy_goal_tolerance_m: float = number(
        "xy_goal_tolerance", 0.1, "metres", None, None, "Tolerance of the distance to the goal."
    )
    yaw_goal_tolerance_rad: float = number(
        "yaw_goal_tolerance", 0.1, "radians", None, None, "Tolerance of the heading at the goal."
    )
    trans_stopped_velocity_mps: float = number(
        "trans_stopped_vel", 0.1, "m/s", None, None, "Speed below which the robot has stopped."
    )
    rot_stopped_velocity_radps: float = number(
        "theta_stopped_vel", 0.1, "rad/s", None, None, "Slower turns count as stopped."
    )
    sim_time_s: float = positive("sim_time", 1.7, "seconds", 0, None, "Duration of a rollout.")
    sim_granularity_m: float = positive(
        "sim_granularity", 0.025, "metres", 0, None, "Distance between the points of a rollout."
    )
    angular_sim_granularity_rad: float = positive(
        "angular_sim_granularity", 0.1, "radians", 0, None, "Largest turn between points."
    )
    path_distance_bias: float = number(
        "path_distance_bias", 0.6, "", 0, None, "Weight of the distance to the path."
    )
    goal_distance_bias: float = number(
        "goal_distance_bias", 0.8, "", 0, None, "Weight of the distance to the goal."
    )
    occdist_scale: float = number("occdist_scale", 0.01, "", 0, None, "Weight of obstacle costs.")
    twirling_scale: float = number("twirling_scale", 0.0, "", 0, None, "Weight of rotations.")
    stop_time_buffer_s: float = number("stop_time_buffer", 0.2, "seconds", 0, None, "Never used.")
    oscillation_reset_dist_m: float = number(
        "oscillation_reset_dist", 0.05, "metres", 0, None, "Movement that ends an oscillation."
    )
    oscillation_reset_angle_rad: float = number(
        "oscillation_reset_angle", 0.2, "radians", 0, None, "Turn that ends an oscillation."
    )
    forward_point_distance_m: float = signed(
        "forward_point_distance", 0.325, "metres", None, None, "Distance ahead of a scored point."
    )
    scaling_speed_mps: float = number(
        "scaling_speed", 0.25, "m/s", 0, None, "Speed above which the footprint is scaled."
    )
    max_scaling_factor: float = number(
        "max_scaling_factor", 0.2, "", 0, None, "Largest scaling of the footprint."
    )
    vx_samples: int = whole("vx_samples", 3, "", 1, None, "Sampled velocities in x.")
    vy_samples: int = whole("vy_samples", 10, "", 1, None, "Sampled velocities in y.")
    vth_samples: int = whole("vth_samples", 20, "", 1, None, "Sampled rotational velocities.")
    use_dwa: bool = flag(
        "use_dwa", True, "Sample velocities that one period can reach, not a whole rollout."
    )

    latch_xy_goal_tolerance: bool = fixed_flag(
        "latch_xy_goal_tolerance", False, "Once at the goal, only turn, even if the robot drifts."
    )
    sum_scores: bool = fixed_flag(
        "sum_scores", False, "Sum the costs of cells along a trajectory, not use the highest."
    )
    cheat_factor: float = fixed_number(
        "cheat_factor", 1.0, "", "Scales how near to the goal the heading no longer counts."
    )
    publish_cost_grid_pc: bool = fixed_flag(
        "publish_cost_grid_pc", False, "Publish the scores of all cells as a point cloud."
    )
    publish_traj_pc: bool = fixed_flag(
        "publish_traj_pc", False, "Publish all sampled trajectories as a point cloud."
    )
    global_frame_id: str = fixed_text(
        "global_frame_id", "odom", "a frame's name", "Frame of trajectory_cloud as upstream."
    )
    odom_topic: str = fixed_text(
        "odom_topic", "odom", "a topic's name", "Topic of the odometry, in the node's namespace."
    )
    controller_frequency_hz: Optional[float] = fixed_number(
        "controller_frequency", None, "Hz", "Rate that sampling assumes; move_base's if unset.", ANY
    )

    # Deviations from upstream
    predict_goal_turn: bool = deviation()  # turn no farther in one period than is left
    stamp_frame_of_costmap: bool = deviation()  # trajectory_cloud names the frame that it is in

    # The turn at the goal has the limits of every turn, by the names of ``goal.GoalLimits``.
    @property
    def max_rotational_vel_radps(self) -> float:
        """Largest turn rate at the goal."""
        return self.max_vel_theta_radps

    @property
    def min_in_place_vel_theta_radps(self) -> float:
        """Smallest turn rate at the goal."""
        return self.min_vel_theta_radps
