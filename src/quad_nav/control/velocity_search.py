"""Search of the trajectory planner: the velocities to try, and the one to take.

The first stage that yields a legal trajectory wins:

1. forwards: a grid of vx and vtheta and, for a holonomic robot, two diagonals; the cheapest wins,
   the first of equals. Turning in place then replaces it if that costs no more; of the turns the
   one wins that ends facing the cell nearest to the goal. While escaping only turns are tried.
2. sideways, for a holonomic robot, by the same rule.
3. backwards at ``escape_vel_mps``: taken even if it collides, unless path or goal are out of
   reach. With ``reject_colliding_escape`` it must lead out of the collision.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.oscillation import Oscillation
from quad_nav.control.rollout import Rollout, Trajectory, Triple
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.geometry import Pose2D
from quad_nav.kernels.collision import COLLIDES
from quad_nav.kernels.rollout import OUT_OF_REACH

_DIAGONALS = ((0.1, 0.1, 0.0), (0.1, -0.1, 0.0))
_ESCAPE_COST = 1.0


@dataclass(frozen=True)
class VelocityWindow:
    """Velocities that can be reached."""

    min_vx_mps: float
    max_vx_mps: float
    min_vtheta_radps: float
    max_vtheta_radps: float


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
    thetas, theta_step = spaced(
        window.min_vtheta_radps, window.max_vtheta_radps, params.vtheta_samples
    )
    best = None
    if not oscillation.escaping:
        best = _cheapest(rollout, _forward_samples(window, thetas, params))
    best, facing = _turn_in_place(rollout, params, oscillation, thetas, theta_step, best)
    if best is not None:
        oscillation.record_turn(best.sample, rollout.pose)
        return _follow(rollout, params, oscillation, best)
    if params.holonomic_robot:
        best = _strafe(rollout, params, oscillation, facing)
        if best is not None:
            oscillation.record_strafe(best.sample, rollout.pose)
            return _follow(rollout, params, oscillation, best)
    return _escape(rollout, params, oscillation)


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
        min_vx_mps=max(params.min_vel_x_mps, vx - change_x),
        max_vx_mps=max(max_vx, params.min_vel_x_mps),
        min_vtheta_radps=max(params.min_vel_theta_radps, vtheta - change_theta),
        max_vtheta_radps=min(params.max_vel_theta_radps, vtheta + change_theta),
    )


def spaced(start: float, end: float, count: int) -> Tuple[NDArray[np.float64], float]:
    """Return ``count`` values from start to end, float64[n], and their step.

    The step is infinite for one value. Values are summed step by step, because equal costs are
    common and the last bit of a sample decides between them.
    """
    count = max(count, 1)
    if count == 1:
        return np.array([start]), math.inf
    step = (end - start) / (count - 1)
    values = np.full(count, step)
    values[0] = start
    return np.add.accumulate(values), step


def _forward_samples(
    window: VelocityWindow, thetas: NDArray[np.float64], params: TrajectoryPlannerParams
) -> NDArray[np.float64]:
    """Return float64[n, 3]: for each vx straight ahead, then all vtheta but the last."""
    speeds, _ = spaced(window.min_vx_mps, window.max_vx_mps, params.vx_samples)
    turns = np.concatenate(([0.0], thetas[:-1]))
    samples = np.zeros((len(speeds) * len(turns), 3))
    samples[:, 0] = np.repeat(speeds, len(turns))
    samples[:, 2] = np.tile(turns, len(speeds))
    return np.vstack((samples, _DIAGONALS)) if params.holonomic_robot else samples


def _cheapest(rollout: Rollout, samples: NDArray[np.float64]) -> Optional[_Candidate]:
    """Return the legal sample of lowest cost, the first of equals."""
    found = rollout.cheapest(samples)
    return _Candidate(_row(samples, found[0]), found[1]) if found is not None else None


def _turn_in_place(
    rollout: Rollout,
    params: TrajectoryPlannerParams,
    oscillation: Oscillation,
    thetas: NDArray[np.float64],
    theta_step: float,
    best: Optional[_Candidate],
) -> Tuple[Optional[_Candidate], float]:
    """Return the best candidate so far or a turn, and the goal distance that it faces."""
    slowest = params.min_in_place_vel_theta_radps
    samples = np.zeros((len(thetas), 3))
    samples[:, 2] = np.where(
        thetas > 0.0, np.maximum(thetas, slowest), np.minimum(thetas, -slowest)
    )
    must_not_cost_more = best is not None and best.sample[1] == 0.0
    costs, ends = rollout.score(samples, best.cost if best and must_not_cost_more else math.inf)
    facing = math.inf
    for k, theta in enumerate(thetas):
        stuck = oscillation.stuck_left if theta < 0.0 else oscillation.stuck_right
        if stuck or not (theta > theta_step or theta < -theta_step):
            continue
        if costs[k] >= 0.0 and (best is None or costs[k] <= best.cost or best.sample[1] != 0.0):
            distance = _distance_ahead(rollout, params, ends[k])
            if distance is not None and distance < facing:
                best, facing = _Candidate(_row(samples, k), float(costs[k])), distance
    return best, facing


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
    is_refused = (
        params.reject_colliding_escape
        and trajectory.cost == COLLIDES
        and not _leads_out(rollout, params)
    )
    if trajectory.cost > OUT_OF_REACH and not is_refused:
        oscillation.begin_escape(rollout.pose)
    _end_escape(rollout, params, oscillation)
    if trajectory.cost == COLLIDES and not is_refused:
        return Trajectory(trajectory.sample, _ESCAPE_COST, trajectory.points)
    return trajectory


def _leads_out(rollout: Rollout, params: TrajectoryPlannerParams) -> bool:
    """Tell whether the robot is free where the escape ends. It may begin in contact."""
    back_m = math.copysign(params.escape_reset_dist_m, params.escape_vel_mps)
    return rollout.is_free(rollout.pose.compose(Pose2D(back_m, 0.0)))


def _follow(
    rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation, best: _Candidate
) -> Trajectory:
    oscillation.forget_if_moved(rollout.pose, params.oscillation_reset_dist_m)
    _end_escape(rollout, params, oscillation)
    return rollout.trajectory(best.sample)


def _end_escape(
    rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation
) -> None:
    oscillation.end_escape_if_moved(
        rollout.pose, params.escape_reset_dist_m, params.escape_reset_theta_rad
    )


def _row(samples: NDArray[np.float64], k: int) -> Triple:
    vx, vy, vtheta = samples[k].tolist()
    return vx, vy, vtheta
