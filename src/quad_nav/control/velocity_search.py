"""Search of the trajectory planner: the velocities to try, and the one to take.

The first stage that yields a legal trajectory wins:

1. forwards: a grid of vx and vtheta and, for a holonomic robot, two diagonals; the cheapest wins,
   the first of equals. Turning in place then replaces it if that costs no more; of the turns the
   one wins that ends facing the cell nearest to the goal. While escaping only turns are tried.
2. sideways, for a holonomic robot, by the same rule.
3. backwards at ``escape_vel_mps``: taken even if it collides, unless path or goal are out of
   reach. With ``reject_colliding_escape`` it must lead out of the collision.

An escape lasts until the robot has moved or turned far enough. With ``end_blocked_escape`` it also
ends where no stage yields a trajectory, and the first two are tried again.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.oscillation import Oscillation
from quad_nav.control.rollout import Rollout, Trajectory, Triple
from quad_nav.control.rollout_kernel import OUT_OF_REACH
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.control.velocity_search_kernel import NO_SAMPLE, SampleRules, VelocityWindow
from quad_nav.costmap.collision import COLLIDES
from quad_nav.geometry import Pose2D

_ESCAPE_COST = 1.0


@dataclass(frozen=True)
class _Candidate:
    sample: Triple
    cost: float


def choose_trajectory(
    rollout: Rollout,
    params: TrajectoryPlannerParams,
    oscillation: Oscillation,
    control_period_s: float,
) -> Trajectory:
    """Choose the trajectory to follow.

    Args:
        rollout: Simulation from the robot's state.
        params: Parameters.
        oscillation: State of earlier calls, changed.
        control_period_s: Length of a control period.

    Returns:
        The trajectory; its cost is negative if none is legal.
    """
    window = velocity_window(rollout, params, control_period_s)
    best = _search(rollout, params, oscillation, window)
    if best is None and _ends_blocked_escape(rollout, params, oscillation):
        best = _search(rollout, params, oscillation, window)
    return _escape(rollout, params, oscillation) if best is None else best


def _search(
    rollout: Rollout,
    params: TrajectoryPlannerParams,
    oscillation: Oscillation,
    window: VelocityWindow,
) -> Optional[Trajectory]:
    """Return the trajectory of the first two stages, None if none is legal."""
    sample, cost, facing = rollout.search(window, _sample_rules(params, oscillation))
    if cost != NO_SAMPLE:
        oscillation.record_turn(sample, rollout.pose)
        return _follow(rollout, params, oscillation, sample)
    if params.holonomic_robot:
        best = _strafe(rollout, params, oscillation, facing)
        if best is not None:
            oscillation.record_strafe(best.sample, rollout.pose)
            return _follow(rollout, params, oscillation, best.sample)
    return None


def _ends_blocked_escape(
    rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation
) -> bool:
    """End an escape whose way back is blocked; return whether it has ended."""
    if not (params.end_blocked_escape and oscillation.escaping):
        return False
    back = rollout.trajectory((params.escape_vel_mps, 0.0, 0.0))
    is_blocked = back.cost == OUT_OF_REACH or _is_refused(rollout, params, back)
    oscillation.escaping = not is_blocked
    return is_blocked


def velocity_window(
    rollout: Rollout, params: TrajectoryPlannerParams, control_period_s: float
) -> VelocityWindow:
    """Return the velocities reachable in one control period with ``dwa``, else in ``sim_time_s``.

    vx is also kept low enough not to overshoot the local goal.
    """
    period_s = control_period_s if params.dwa else params.sim_time_s
    vx, _, vtheta = rollout.velocity
    to_goal_m = float(
        np.hypot(rollout.goal_x_m - rollout.pose.x_m, rollout.goal_y_m - rollout.pose.y_m)
    )
    change_x, change_theta = (
        params.acc_lim_x_mps2 * period_s,
        params.acc_lim_theta_radps2 * period_s,
    )
    max_vx = min(params.max_vel_x_mps, to_goal_m / params.sim_time_s, vx + change_x)
    return VelocityWindow(
        min_vx_mps=float(max(params.min_vel_x_mps, vx - change_x)),
        max_vx_mps=float(max(max_vx, params.min_vel_x_mps)),
        min_vtheta_radps=float(max(params.min_vel_theta_radps, vtheta - change_theta)),
        max_vtheta_radps=float(min(params.max_vel_theta_radps, vtheta + change_theta)),
    )


def _sample_rules(params: TrajectoryPlannerParams, oscillation: Oscillation) -> SampleRules:
    return SampleRules(
        vx_samples=int(params.vx_samples),
        vtheta_samples=int(params.vtheta_samples),
        holonomic=bool(params.holonomic_robot),
        goes_forward=not oscillation.escaping,
        slowest_turn_radps=float(params.min_in_place_vel_theta_radps),
        lookahead_m=float(params.heading_lookahead_m),
        stuck_left=oscillation.stuck_left,
        stuck_right=oscillation.stuck_right,
    )


def _strafe(
    rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation, facing: float
) -> Optional[_Candidate]:
    samples = np.zeros((len(params.y_vels_mps), 3))
    samples[:, 1] = params.y_vels_mps
    costs, ends = rollout.score(samples)
    best = None
    for k, vy in enumerate(params.y_vels_mps):
        stuck = oscillation.stuck_left_strafe if vy > 0.0 else oscillation.stuck_right_strafe
        if vy == 0.0 or stuck:
            continue
        if costs[k] >= 0.0 and (best is None or costs[k] <= best.cost):
            distance = _distance_ahead(rollout, params, ends[k])
            if distance is not None and distance < facing:
                best, facing = _Candidate(_row(samples, k), float(costs[k])), distance
    return best


def _distance_ahead(
    rollout: Rollout, params: TrajectoryPlannerParams, end: NDArray[np.float64]
) -> Optional[int]:
    """Return the goal distance of the cell that a pose faces, None off the map."""
    pose = Pose2D(*(float(value) for value in end))
    return rollout.goal_distance_at(*pose.transform(params.heading_lookahead_m, 0.0))


def _escape(
    rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation
) -> Trajectory:
    trajectory = rollout.trajectory((params.escape_vel_mps, 0.0, 0.0))
    oscillation.forget_if_moved(rollout.pose, params.oscillation_reset_dist_m)
    is_refused = _is_refused(rollout, params, trajectory)
    if trajectory.cost > OUT_OF_REACH and not is_refused:
        oscillation.begin_escape(rollout.pose)
    _end_escape(rollout, params, oscillation)
    if trajectory.cost == COLLIDES and not is_refused:
        return Trajectory(trajectory.sample, _ESCAPE_COST, trajectory.points)
    return trajectory


def _is_refused(rollout: Rollout, params: TrajectoryPlannerParams, escape: Trajectory) -> bool:
    """Return whether an escape backwards is not taken because it collides."""
    return (
        params.reject_colliding_escape
        and escape.cost == COLLIDES
        and not _leads_out(rollout, params)
    )


def _leads_out(rollout: Rollout, params: TrajectoryPlannerParams) -> bool:
    """Tell whether the robot is free where the escape ends. It may begin in contact."""
    back_m = math.copysign(params.escape_reset_dist_m, params.escape_vel_mps)
    return rollout.is_free(rollout.pose.compose(Pose2D(back_m, 0.0)))


def _follow(
    rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation, sample: Triple
) -> Trajectory:
    oscillation.forget_if_moved(rollout.pose, params.oscillation_reset_dist_m)
    _end_escape(rollout, params, oscillation)
    return rollout.trajectory(sample)


def _end_escape(
    rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation
) -> None:
    oscillation.end_escape_if_moved(
        rollout.pose, params.escape_reset_dist_m, params.escape_reset_theta_rad
    )


def _row(samples: NDArray[np.float64], k: int) -> Triple:
    vx, vy, vtheta = samples[k].tolist()
    return vx, vy, vtheta
