"""Values that are legal one by one and together ask for more than any machine has.

Sliders of rqt_reconfigure reach to 2147483647 samples and metres, as in the
original, which then runs out of memory or comes to a stand.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Iterator, Tuple

from quad_nav.config.plugins import plugin_name
from quad_nav.control.dwa_planner import DwaParams
from quad_nav.control.trajectory_planner import TrajectoryPlannerParams
from quad_nav.costmap.layered import CostmapParams

if TYPE_CHECKING:
    from quad_nav.config.configuration import Configuration

MOST_CELLS = 10**8  # of one costmap: some GB with its layers and the planner's potential
MOST_POINTS = 10**8  # of the trajectories in one control period: some seconds


def size_problem(params: CostmapParams) -> str:
    """Why no grid can be made of this size, "" when one can."""
    columns = params.width_m / params.resolution_m
    rows = params.height_m / params.resolution_m
    if min(columns, rows) >= 1.0 and columns * rows <= MOST_CELLS:
        return ""
    return (
        f"{params.width_m:.15g} x {params.height_m:.15g} m cannot be in cells of"
        f" {params.resolution_m:g} m; expected 1 to {MOST_CELLS} cells"
    )


def rollout_problem(params: Any) -> str:
    """Why a local planner cannot look at so many trajectories, "" when it can.

    A trajectory has a point every ``sim_granularity`` or ``angular_sim_granularity``,
    whichever are more. A user's planner answers for itself.
    """
    if not isinstance(params, (DwaParams, TrajectoryPlannerParams)):
        return ""
    samples, speed_mps = _samples_and_speed(params)
    points = max(
        speed_mps * params.sim_time_s / params.sim_granularity_m,
        params.max_vel_theta_radps * params.sim_time_s / params.angular_sim_granularity_rad,
        1.0,
    )
    if samples * points <= MOST_POINTS:
        return ""
    return (
        f"{samples} trajectories of up to {points:.3g} points are too many; expected at"
        f" most {MOST_POINTS} points altogether: fewer samples, less sim_time or speed, or a"
        " coarser granularity"
    )


def workload_problems(configuration: Configuration) -> Iterator[Tuple[str, str]]:
    """(namespace, problem) of what the configuration cannot be flown with."""
    found = {
        "global_costmap": size_problem(configuration.global_costmap),
        "local_costmap": size_problem(configuration.local_costmap),
        plugin_name(configuration.navigator.base_local_planner): rollout_problem(
            configuration.local_planner
        ),
    }
    return ((name, problem) for name, problem in found.items() if problem)


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
