"""Limits on what a configuration makes a machine compute.

Values that are legal one by one can together need more memory or time than any machine has. The
sliders of rqt_reconfigure reach to 2147483647 samples and metres; with such values upstream
move_base runs out of memory or stops reacting.
"""

from __future__ import annotations

from typing import Any, Tuple

from quad_nav.control.dwa_planner import DwaParams
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.layered import CostmapParams
from quad_nav.files.values import memory_problem

MAX_POINTS = 10**8  # of all trajectories in one control period: some seconds


def size_problem(params: CostmapParams) -> str:
    """Return the reason why a costmap of this size is refused, "" if it is accepted."""
    columns = params.width_m / params.resolution_m
    rows = params.height_m / params.resolution_m
    size = f"{params.width_m:.15g} x {params.height_m:.15g} m"
    size += f" with cells of {params.resolution_m:g} m"
    if not min(columns, rows) >= 1.0:
        return f"{size} is not supported; expected at least 1 cell"
    problem = memory_problem(
        columns,
        rows,
        "cells",
        params.bytes_per_cell,
        "a smaller width and height, a larger resolution, or fewer layers",
    )
    return f"{size} is not supported: {problem}" if problem else ""


def rollout_problem(params: Any) -> str:
    """Return the reason why a local planner's trajectories are refused, "" if they are accepted.

    A trajectory has a point every ``sim_granularity`` or ``angular_sim_granularity``, whichever
    gives more points. Planners of users are not checked.
    """
    if not isinstance(params, (DwaParams, TrajectoryPlannerParams)):
        return ""
    samples, speed_mps = _samples_and_speed(params)
    points = max(
        speed_mps * params.sim_time_s / params.sim_granularity_m,
        params.max_vel_theta_radps * params.sim_time_s / params.angular_sim_granularity_rad,
        1.0,
    )
    if samples * points <= MAX_POINTS:
        return ""
    return (
        f"{samples} trajectories of up to {points:.3g} points are too many; expected at"
        f" most {MAX_POINTS} points in total (use fewer samples, a shorter sim_time, a lower"
        " speed or a coarser granularity)"
    )


def _samples_and_speed(params: Any) -> Tuple[int, float]:
    if isinstance(params, TrajectoryPlannerParams):
        return params.vx_samples * params.vtheta_samples, params.max_vel_x_mps
    samples = params.vx_samples * params.vy_samples * params.vth_samples
    fastest_mps = max(
        map(
            abs,
            (
                params.min_vel_x_mps,
                params.max_vel_x_mps,
                params.min_vel_y_mps,
                params.max_vel_y_mps,
            ),
        )
    )
    return samples, min(fastest_mps, params.max_vel_trans_mps)
