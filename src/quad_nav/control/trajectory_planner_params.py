"""Parameters of the trajectory rollout controller."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Tuple

from quad_nav.files.number_texts import numbers_from_text
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
    text,
    whole,
)

_NUMBERS = "numbers of m/s separated by commas"


@dataclass(frozen=True)
class TrajectoryPlannerParams:
    """Parameters of ``base_local_planner/TrajectoryPlannerROS``.

    The defaults are those that dynamic_reconfigure sets, which differ from those in upstream's
    documentation.
    """

    acc_lim_x_mps2: float = number("acc_lim_x", 2.5, "m/s^2", 0, 20, "Acceleration limit in x.")
    acc_lim_y_mps2: float = number("acc_lim_y", 2.5, "m/s^2", 0, 20, "Acceleration limit in y.")
    acc_lim_theta_radps2: float = number(
        "acc_lim_theta", 3.2, "rad/s^2", 0, 20, "Rotational acceleration limit."
    )
    max_vel_x_mps: float = number("max_vel_x", 0.55, "m/s", 0, 20, "Largest velocity in x.")
    min_vel_x_mps: float = signed("min_vel_x", 0.0, "m/s", 0, 20, "Smallest velocity in x.")
    max_vel_theta_radps: float = signed(
        "max_vel_theta", 1.0, "rad/s", 0, 20, "Largest rotational velocity to the left."
    )
    min_vel_theta_radps: float = signed(
        "min_vel_theta", -1.0, "rad/s", -20, 0, "Largest rotational velocity to the right."
    )
    min_in_place_vel_theta_radps: float = number(
        "min_in_place_vel_theta", 0.4, "rad/s", 0, 20, "Smallest speed of a turn in place."
    )
    sim_time_s: float = positive("sim_time", 1.7, "seconds", 0, 10, "Duration of a rollout.")
    sim_granularity_m: float = positive(
        "sim_granularity", 0.025, "metres", 0, 5, "Distance between the points of a rollout."
    )
    angular_sim_granularity_rad: float = positive(
        "angular_sim_granularity", 0.025, "radians", 0, math.pi / 2, "Largest turn between points."
    )
    path_distance_bias: float = number(
        "path_distance_bias", 0.6, "", 0, 5, "Weight of the distance to the path."
    )
    goal_distance_bias: float = number(
        "goal_distance_bias", 0.8, "", 0, 5, "Weight of the distance to the goal."
    )
    occdist_scale: float = number("occdist_scale", 0.01, "", 0, 5, "Weight of obstacle costs.")
    oscillation_reset_dist_m: float = number(
        "oscillation_reset_dist", 0.05, "metres", 0, 5, "Movement that ends an oscillation."
    )
    escape_reset_dist_m: float = number(
        "escape_reset_dist", 0.1, "metres", 0, 5, "Movement that ends an escape."
    )
    escape_reset_theta_rad: float = number(
        "escape_reset_theta", math.pi / 2, "radians", 0, 5, "Turn that ends an escape."
    )
    vx_samples: int = whole("vx_samples", 20, "", 1, 300, "Sampled velocities in x.")
    vtheta_samples: int = whole("vtheta_samples", 20, "", 1, 300, "Sampled rotational velocities.")
    heading_lookahead_m: float = number(
        "heading_lookahead", 0.325, "metres", 0, 5, "Distance ahead at which turns are compared."
    )
    holonomic_robot: bool = flag("holonomic_robot", True, "The robot can fly sideways.")
    escape_vel_mps: float = signed("escape_vel", -0.1, "m/s", -2, 2, "Velocity in x of escapes.")
    dwa: bool = flag(
        "dwa", False, "Sample velocities that one period can reach, not a whole rollout."
    )
    heading_scoring: bool = flag(
        "heading_scoring", False, "Score the heading towards the path, not the distance from it."
    )
    heading_scoring_timestep_s: float = number(
        "heading_scoring_timestep", 0.1, "seconds", 0, 1, "Time ahead of the scored heading."
    )
    simple_attractor: bool = flag(
        "simple_attractor", False, "Score the straight distance to the goal point, not the path."
    )
    y_vels_mps: Tuple[float, ...] = text(
        "y_vels", "-0.3,-0.1,0.1,-0.3", _NUMBERS, "Velocities in y.", convert=numbers_from_text
    )

    max_rotational_vel_radps: float = fixed_number(
        "max_rotational_vel", 1.0, "rad/s", "Largest rotational velocity of the turn at the goal."
    )
    yaw_goal_tolerance_rad: float = fixed_number(
        "yaw_goal_tolerance", 0.05, "radians", "Tolerance of the heading at the goal."
    )
    xy_goal_tolerance_m: float = fixed_number(
        "xy_goal_tolerance", 0.1, "metres", "Tolerance of the distance to the goal."
    )
    latch_xy_goal_tolerance: bool = fixed_flag(
        "latch_xy_goal_tolerance", False, "Once at the goal, only turn, even if the robot drifts."
    )
    rot_stopped_velocity_radps: float = fixed_number(
        "rot_stopped_velocity", 0.01, "rad/s", "Rotational speed below which the robot has stopped."
    )
    trans_stopped_velocity_mps: float = fixed_number(
        "trans_stopped_velocity", 0.01, "m/s", "Speed below which the robot has stopped."
    )
    prune_plan: bool = fixed_flag("prune_plan", True, "Remove the plan behind the robot.")
    meter_scoring: bool = fixed_flag(
        "meter_scoring", True, "Score distances in metres, not cells, see respect_meter_scoring."
    )
    publish_cost_grid_pc: bool = fixed_flag(
        "publish_cost_grid_pc", False, "Publish the scores of all cells as a point cloud."
    )
    global_frame_id: str = fixed_text(
        "global_frame_id", "odom", "a frame's name", "Frame of the point cloud of scores."
    )
    controller_frequency_hz: Optional[float] = fixed_number(
        "controller_frequency", None, "Hz", "Rate that rollouts assume; move_base's if unset.", ANY
    )

    # Our own
    respect_meter_scoring: bool = flag(
        "respect_meter_scoring", False, "Upstream always scores in metres.", upstream=False
    )

    # Deviations from upstream
    reject_colliding_escape: bool = deviation()  # escape backwards only where nothing is hit
    end_blocked_escape: bool = deviation()  # an escape that cannot go on allows forward samples
    follow_footprint: bool = deviation()  # check with the footprint in force, not the first one
    predict_goal_turn: bool = deviation()  # turn no farther in one period than is left

    @property
    def scores_in_metres(self) -> bool:
        """True if distances are scored in metres, False in cells."""
        return self.meter_scoring or not self.respect_meter_scoring
