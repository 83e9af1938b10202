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
from typing import NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.oscillation import Oscillation
from quad_nav.control.rollout import Rollout, Trajectory
from quad_nav.control.rollout_kernel import (
    OUT_OF_REACH,
    RolloutInputs,
    cheapest,
    cost_up_to,
    least_costs,
    occupancy_at_start,
)
from quad_nav.control.sample_motion import longest
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap.collision import COLLIDES, Triple
from quad_nav.costmap.cost_grid_kernel import cell_of
from quad_nav.files.kernel_cache import njit
from quad_nav.geometry import Pose2D

_ESCAPE_COST = 1.0
NO_SAMPLE = -1.0


class VelocityWindow(NamedTuple):
    """Velocities that can be reached."""

    min_vx_mps: float
    max_vx_mps: float
    min_vtheta_radps: float
    max_vtheta_radps: float


class SampleRules(NamedTuple):
    """Samples of a window, and which of them are tried."""

    vx_samples: int
    vtheta_samples: int
    holonomic: bool  # try two diagonals
    goes_forward: bool  # False to try only turns in place
    slowest_turn_radps: float  # slower turns in place are as fast as this
    lookahead_m: float  # turns in place are compared by the cell so far ahead
    stuck_left: bool  # forbids turns in place of negative vtheta
    stuck_right: bool  # forbids turns in place of positive vtheta


def sample_rules(params: TrajectoryPlannerParams, oscillation: Oscillation) -> SampleRules:
    """Return the rules that parameters and the trajectories before ask for."""
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


class _Search:
    """One search, from the robot's state on one costmap."""

    def __init__(
        self, rollout: Rollout, params: TrajectoryPlannerParams, oscillation: Oscillation
    ) -> None:
        self.rollout, self.params, self.oscillation = rollout, params, oscillation

    def follow_best(self, window: VelocityWindow) -> Optional[Trajectory]:
        """Return the trajectory of the first two stages, None if none is legal."""
        sample, cost, facing = search(
            self.rollout.inputs, window, sample_rules(self.params, self.oscillation)
        )
        if cost != NO_SAMPLE:
            self.oscillation.record_turn(sample, self.rollout.pose)
            return self._follow(sample)
        sideways = self._strafe(facing) if self.params.holonomic_robot else None
        if sideways is None:
            return None
        self.oscillation.record_strafe(sideways, self.rollout.pose)
        return self._follow(sideways)

    def ends_blocked_escape(self) -> bool:
        """End an escape whose way back is blocked; return whether it has ended."""
        if not (self.params.end_blocked_escape and self.oscillation.escaping):
            return False
        back = self._back()
        is_blocked = back.cost == OUT_OF_REACH or self._is_refused(back)
        self.oscillation.escaping = not is_blocked
        return is_blocked

    def escape(self) -> Trajectory:
        """Return the trajectory backwards, with a cost of its own if it collides."""
        trajectory = self._back()
        self._forget_if_moved()
        is_refused = self._is_refused(trajectory)
        if trajectory.cost > OUT_OF_REACH and not is_refused:
            self.oscillation.begin_escape(self.rollout.pose)
        self._end_escape()
        if trajectory.cost == COLLIDES and not is_refused:
            return Trajectory(trajectory.sample, _ESCAPE_COST, trajectory.points)
        return trajectory

    def _strafe(self, facing: float) -> Optional[Triple]:
        """Return the best sideways sample that ends facing the goal more than ``facing``."""
        oscillation, vels_mps = self.oscillation, self.params.y_vels_mps
        samples = np.zeros((len(vels_mps), 3))
        samples[:, 1] = vels_mps
        costs, ends = self.rollout.score(samples)
        best, best_cost = None, math.inf
        for k, vy in enumerate(vels_mps):
            stuck = oscillation.stuck_left_strafe if vy > 0.0 else oscillation.stuck_right_strafe
            if vy == 0.0 or stuck or not 0.0 <= costs[k] <= best_cost:
                continue
            ahead = Pose2D(*ends[k].tolist()).transform(self.params.heading_lookahead_m, 0.0)
            distance = self.rollout.goal_distance_at(*ahead)
            if distance is not None and distance < facing:
                best, best_cost, facing = (0.0, float(vy), 0.0), float(costs[k]), distance
        return best

    def _back(self) -> Trajectory:
        return self.rollout.trajectory((self.params.escape_vel_mps, 0.0, 0.0))

    def _is_refused(self, escape: Trajectory) -> bool:
        """Return whether an escape backwards is not taken because it collides."""
        collides = self.params.reject_colliding_escape and escape.cost == COLLIDES
        return collides and not self._leads_out()

    def _leads_out(self) -> bool:
        """Tell whether the robot is free where the escape ends. It may begin in contact."""
        back_m = math.copysign(self.params.escape_reset_dist_m, self.params.escape_vel_mps)
        return self.rollout.is_free(self.rollout.pose.compose(Pose2D(back_m, 0.0)))

    def _follow(self, sample: Triple) -> Trajectory:
        self._forget_if_moved()
        self._end_escape()
        return self.rollout.trajectory(sample)

    def _forget_if_moved(self) -> None:
        self.oscillation.forget_if_moved(self.rollout.pose, self.params.oscillation_reset_dist_m)

    def _end_escape(self) -> None:
        distance_m, turn_rad = self.params.escape_reset_dist_m, self.params.escape_reset_theta_rad
        self.oscillation.end_escape_if_moved(self.rollout.pose, distance_m, turn_rad)


def choose_trajectory(
    rollout: Rollout,
    params: TrajectoryPlannerParams,
    oscillation: Oscillation,
    control_period_s: float,
) -> Trajectory:
    """Choose the trajectory to follow; its cost is negative if none is legal.

    The oscillation is the state of earlier calls, and changes.
    """
    search = _Search(rollout, params, oscillation)
    window = velocity_window(rollout, params, control_period_s)
    best = search.follow_best(window)
    if best is None and search.ends_blocked_escape():
        best = search.follow_best(window)
    return search.escape() if best is None else best


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
    change_x = params.acc_lim_x_mps2 * period_s
    change_theta = params.acc_lim_theta_radps2 * period_s
    max_vx = min(params.max_vel_x_mps, to_goal_m / params.sim_time_s, vx + change_x)
    return VelocityWindow(
        min_vx_mps=float(max(params.min_vel_x_mps, vx - change_x)),
        max_vx_mps=float(max(max_vx, params.min_vel_x_mps)),
        min_vtheta_radps=float(max(params.min_vel_theta_radps, vtheta - change_theta)),
        max_vtheta_radps=float(min(params.max_vel_theta_radps, vtheta + change_theta)),
    )


@njit(cache=True, nogil=True)
def search(
    inputs: RolloutInputs, window: VelocityWindow, rules: SampleRules
) -> Tuple[Triple, float, float]:
    """Find the best forward sample or turn in place.

    Returns:
        The sample, its cost, NO_SAMPLE if none is legal, and the distance to the goal, in cells,
        of the cell that it ends facing, inf for a forward sample.
    """
    thetas, theta_step = spaced(
        window.min_vtheta_radps, window.max_vtheta_radps, rules.vtheta_samples
    )
    sample, cost = (0.0, 0.0, 0.0), NO_SAMPLE
    if rules.goes_forward:
        samples = forward_samples(window, thetas, rules)
        k, least = cheapest(inputs, samples)
        if k >= 0:
            sample, cost = (samples[k, 0], samples[k, 1], samples[k, 2]), least
    limit = cost if cost >= 0.0 and sample[1] == 0.0 else np.inf
    turns = turns_in_place(thetas, theta_step, rules)
    k, least, facing = best_turn(inputs, turns, limit, rules.lookahead_m)
    if k >= 0:
        sample, cost = (0.0, 0.0, turns[k, 2]), least
    return sample, cost, facing


@njit(cache=True, nogil=True)
def spaced(start: float, end: float, count: int) -> Tuple[NDArray[np.float64], float]:
    """Return ``count`` values from start to end, float64[n], and their step.

    The step is infinite for one value. Values are summed step by step, because equal costs are
    common and the last bit of a sample decides between them.
    """
    count = max(count, 1)
    values = np.empty(count)
    values[0] = start
    if count == 1:
        return values, np.inf
    step = (end - start) / (count - 1)
    for k in range(1, count):
        values[k] = values[k - 1] + step
    return values, step


@njit(cache=True, nogil=True)
def forward_samples(
    window: VelocityWindow, thetas: NDArray[np.float64], rules: SampleRules
) -> NDArray[np.float64]:
    """Return float64[n, 3]: for each vx straight ahead, then all vtheta but the last."""
    speeds, _ = spaced(window.min_vx_mps, window.max_vx_mps, rules.vx_samples)
    in_grid = speeds.size * thetas.size
    samples = np.zeros((in_grid + 2 if rules.holonomic else in_grid, 3))
    for k in range(in_grid):
        samples[k, 0] = speeds[k // thetas.size]
        turn = k % thetas.size
        samples[k, 2] = thetas[turn - 1] if turn > 0 else 0.0
    if rules.holonomic:
        samples[in_grid, 0], samples[in_grid, 1] = 0.1, 0.1
        samples[in_grid + 1, 0], samples[in_grid + 1, 1] = 0.1, -0.1
    return samples


@njit(cache=True, nogil=True)
def turns_in_place(
    thetas: NDArray[np.float64], theta_step: float, rules: SampleRules
) -> NDArray[np.float64]:
    """Return the turns that are fast enough and allowed, float64[n, 3]."""
    turns = np.zeros((thetas.size, 3))
    count = 0
    for theta in thetas:
        is_stuck = rules.stuck_left if theta < 0.0 else rules.stuck_right
        if is_stuck or not abs(theta) > theta_step:
            continue
        slowest = rules.slowest_turn_radps
        turns[count, 2] = max(theta, slowest) if theta > 0.0 else min(theta, -slowest)
        count += 1
    return turns[:count]


@njit(cache=True, nogil=True)
def best_turn(
    inputs: RolloutInputs, turns: NDArray[np.float64], limit: float, lookahead_m: float
) -> Tuple[int, float, float]:
    """Find the turn, of float64[n, 3], that ends facing the cell nearest to the goal.

    The limit is the highest cost of the first turn; each may cost no more than the one before.

    Returns:
        Index, cost and distance in cells; (-1, inf, inf) if no turn is legal.
    """
    best, best_cost, facing = -1, limit, np.inf
    at_start = occupancy_at_start(inputs)
    if at_start < 0.0:
        return best, np.inf, facing
    points = np.empty((longest(inputs.params, turns), 3))
    bounds = least_costs(inputs, turns, at_start, points)
    for k in range(turns.shape[0]):
        if bounds[k] == np.inf or bounds[k] > best_cost:
            continue
        cost, count = cost_up_to(inputs, turns[k], at_start, best_cost, points)
        if not 0.0 <= cost <= best_cost or cost == np.inf:
            continue
        x, y, theta = points[count - 1]
        cell_x, cell_y = cell_of(
            inputs.costmap, x + math.cos(theta) * lookahead_m, y + math.sin(theta) * lookahead_m
        )
        if cell_x >= 0 and cell_y >= 0 and inputs.goal_distance[cell_y, cell_x] < facing:
            best, best_cost = k, cost
            facing = float(inputs.goal_distance[cell_y, cell_x])
    return best, best_cost, facing
