"""Velocity samples of the dynamic window controller.

They form a grid over the velocities that are allowed and can be reached: in one control period with
``use_dwa``, else in ``sim_time_s``, and then no faster than would overshoot the local goal.

Source: D. Fox, W. Burgard, S. Thrun, "The dynamic window approach to collision avoidance", IEEE
Robotics & Automation Magazine 4(1), 1997.
"""

from __future__ import annotations

from typing import Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.dwa_kernel import sample_grid
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.rollout import Triple, single
from quad_nav.geometry import Pose2D


def velocity_samples(
    params: DwaParams, pose: Pose2D, velocity: Triple, goal: Pose2D, control_period_s: float
) -> NDArray[np.float64]:
    """Return the velocities to try.

    Args:
        params: Parameters.
        pose: Pose of the robot in the local costmap's frame.
        velocity: (vx, vy, vtheta) of the robot, in its own frame.
        goal: End of the plan in the local costmap.
        control_period_s: Length of a control period.

    Returns:
        float64[n, 3], rows vx, vy, vtheta of single precision; vtheta varies fastest.
    """
    lowest, highest = _velocity_window(params, pose, velocity, goal, control_period_s)
    counts = int(params.vx_samples), int(params.vy_samples), int(params.vth_samples)
    return sample_grid(lowest, highest, counts)


def acceleration_limits(params: DwaParams) -> Triple:
    """Return the limits of x, y and theta in single precision, as upstream keeps them."""
    return single(params.acc_lim_x_mps2, params.acc_lim_y_mps2, params.acc_lim_theta_radps2)


def _velocity_window(
    params: DwaParams, pose: Pose2D, velocity: Triple, goal: Pose2D, control_period_s: float
) -> Tuple[Triple, Triple]:
    fastest_x, fastest_y = params.max_vel_x_mps, params.max_vel_y_mps
    period_s = control_period_s
    if not params.use_dwa:
        period_s = params.sim_time_s
        no_overshoot_mps = pose.distance_to(goal) / params.sim_time_s
        fastest_x = max(min(fastest_x, no_overshoot_mps), params.min_vel_x_mps)
        fastest_y = max(min(fastest_y, no_overshoot_mps), params.min_vel_y_mps)
    slowest = params.min_vel_x_mps, params.min_vel_y_mps, -params.max_vel_theta_radps
    fastest = fastest_x, fastest_y, params.max_vel_theta_radps
    change = [limit * period_s for limit in acceleration_limits(params)]
    return (
        single(*(max(a, v - c) for a, v, c in zip(slowest, velocity, change))),
        single(*(min(a, v + c) for a, v, c in zip(fastest, velocity, change))),
    )
