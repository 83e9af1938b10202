"""Parameters of the trajectory rollout controller."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Tuple


@dataclass(frozen=True)
class TrajectoryPlannerParams:
    """Parameters of ``base_local_planner/TrajectoryPlannerROS``.

    The defaults are those that dynamic_reconfigure sets, which differ from those in upstream's
    documentation.
    """

    # Limits of the robot
    acc_lim_x_mps2: float = 2.5
    acc_lim_y_mps2: float = 2.5
    acc_lim_theta_radps2: float = 3.2
    max_vel_x_mps: float = 0.55
    min_vel_x_mps: float = 0.0
    max_vel_theta_radps: float = 1.0
    min_vel_theta_radps: float = -1.0
    min_in_place_vel_theta_radps: float = 0.4
    max_rotational_vel_radps: float = 1.0  # only for the turn at the goal
    escape_vel_mps: float = -0.1
    holonomic_robot: bool = True
    y_vels_mps: Tuple[float, ...] = (-0.3, -0.1, 0.1, -0.3)

    # Goal
    yaw_goal_tolerance_rad: float = 0.05
    xy_goal_tolerance_m: float = 0.1
    latch_xy_goal_tolerance: bool = False
    rot_stopped_velocity_radps: float = 0.01
    trans_stopped_velocity_mps: float = 0.01

    # Forward simulation
    sim_time_s: float = 1.7
    sim_granularity_m: float = 0.025
    angular_sim_granularity_rad: float = 0.025
    vx_samples: int = 20
    vtheta_samples: int = 20
    dwa: bool = False

    # Scoring
    meter_scoring: bool = True
    respect_meter_scoring: bool = False  # False: distances are always scored in metres
    path_distance_bias: float = 0.6
    goal_distance_bias: float = 0.8
    occdist_scale: float = 0.01
    heading_lookahead_m: float = 0.325
    heading_scoring: bool = False
    heading_scoring_timestep_s: float = 0.1
    simple_attractor: bool = False
    publish_cost_grid_pc: bool = False
    global_frame_id: str = "odom"

    # Oscillation and escape
    oscillation_reset_dist_m: float = 0.05
    escape_reset_dist_m: float = 0.1
    escape_reset_theta_rad: float = math.pi / 2.0

    # Global plan
    prune_plan: bool = True

    # Fixed upstream bugs; False restores upstream behaviour
    reject_colliding_escape: bool = True  # escape backwards only where nothing is hit
    end_blocked_escape: bool = True  # an escape that cannot go on allows forward samples again
    predict_goal_turn: bool = True  # turn no farther in one control period than is left

    @property
    def scores_in_metres(self) -> bool:
        """True if distances are scored in metres, False in cells."""
        return self.meter_scoring or not self.respect_meter_scoring
