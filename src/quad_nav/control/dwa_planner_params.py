"""Parameters of the dynamic window controller."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class DwaParams:
    """Parameters of ``dwa_local_planner/DWAPlannerROS``.

    The defaults are those that dynamic_reconfigure sets. A negative
    ``min_vel_trans_mps``, ``min_vel_theta_radps`` or ``max_vel_trans_mps`` is no limit.
    """

    # Limits of the robot
    max_vel_trans_mps: float = 0.55
    min_vel_trans_mps: float = 0.1
    max_vel_x_mps: float = 0.55
    min_vel_x_mps: float = 0.0
    max_vel_y_mps: float = 0.1
    min_vel_y_mps: float = -0.1
    max_vel_theta_radps: float = 1.0
    min_vel_theta_radps: float = 0.4
    acc_lim_x_mps2: float = 2.5
    acc_lim_y_mps2: float = 2.5
    acc_lim_theta_radps2: float = 3.2

    # Goal
    xy_goal_tolerance_m: float = 0.1
    yaw_goal_tolerance_rad: float = 0.1
    latch_xy_goal_tolerance: bool = False
    trans_stopped_velocity_mps: float = 0.1
    rot_stopped_velocity_radps: float = 0.1

    # Forward simulation
    sim_time_s: float = 1.7
    sim_granularity_m: float = 0.025
    angular_sim_granularity_rad: float = 0.1
    vx_samples: int = 3
    vy_samples: int = 10
    vth_samples: int = 20
    use_dwa: bool = True

    # Scoring
    path_distance_bias: float = 0.6
    goal_distance_bias: float = 0.8
    occdist_scale: float = 0.01
    twirling_scale: float = 0.0
    forward_point_distance_m: float = 0.325
    cheat_factor: float = 1.0
    scaling_speed_mps: float = 0.25
    max_scaling_factor: float = 0.2
    sum_scores: bool = False
    publish_cost_grid_pc: bool = False
    global_frame_id: str = "odom"

    # Oscillation
    oscillation_reset_dist_m: float = 0.05
    oscillation_reset_angle_rad: float = 0.2

    # Global plan
    prune_plan: bool = False

    # Fixed upstream bug; False restores upstream behaviour
    predict_goal_turn: bool = True  # turn no farther in one control period than is left

    # The turn at the goal has the limits of every turn, by the names of ``goal.GoalLimits``.
    @property
    def max_rotational_vel_radps(self) -> float:
        """Largest turn rate at the goal."""
        return self.max_vel_theta_radps

    @property
    def min_in_place_vel_theta_radps(self) -> float:
        """Smallest turn rate at the goal."""
        return self.min_vel_theta_radps
