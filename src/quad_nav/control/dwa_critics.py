"""Critics of the dynamic window controller: simulate velocity samples and score them.

A sample (vx, vy, vtheta) is simulated for ``sim_time_s``; with ``use_dwa`` the
robot has its velocity at once, otherwise it approaches it as the acceleration
limits allow, and is commanded what it has after the first step. The critics,
in the order in which their costs are summed, weights in brackets:

* oscillation: no cost; forbids directions given up before.
* obstacle [occdist_scale]: the highest cell cost under the footprint along the trajectory
  (their sum with ``sum_scores``). Above ``scaling_speed_mps`` the footprint
  grows, up to 1 + ``max_scaling_factor`` at ``max_vel_trans_mps``. Forbids
  trajectories on which it touches a lethal or unknown cell.
* goal_front [goal_distance_bias], alignment [path_distance_bias]: distance from
  the robot's nose, ``forward_point_distance_m`` ahead, to the local goal moved
  as far ahead, and to the path. Near the goal there is no alignment.
* path [path_distance_bias], goal [goal_distance_bias]: distance from the robot's
  centre to the path and to the local goal. Forbid poses that neither can be
  reached from.
* twirling [twirling_scale]: the speed of the turn.

Distances are those of the trajectory's last pose over the free cells, in metres
(``map_grid``); unlike in trajectory rollout, obstacles under the robot are
obstacles. No pose and no nose may be off the map. A critic of weight 0 is not
used at all, not even to tell whether a trajectory is legal.

The search is that of trajectory rollout: where a sample ends, and what is under the footprint where
all of them begin, give the least that it can cost, and samples are tried in that order.

Source: D. Fox, W. Burgard, S. Thrun, "The dynamic window approach to collision avoidance", IEEE
Robotics & Automation Magazine 4(1), 1997.
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control import dwa_kernel as kernel
from quad_nav.control import dwa_search
from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.map_grid import distances_ahead
from quad_nav.control.rollout import Trajectory, single
from quad_nav.costmap.collision import Triple, highest_near
from quad_nav.costmap.cost_grid import costmap_view
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec

NO_LEGAL_TRAJECTORY = -7.0


class DwaGrids(NamedTuple):
    """Distances in cells, as in ``map_grid.DistanceGrids``.

    Attributes:
        path: int32[H, W], to the plan.
        goal: int32[H, W], to the local goal.
        goal_front: int32[H, W], to the local goal moved ahead.
    """

    path: NDArray[np.int32]
    goal: NDArray[np.int32]
    goal_front: NDArray[np.int32]


class Critics:
    """Critics for a robot in one state on one costmap.

    ``grids`` are those of an earlier call to use again; without them they are measured on ``plan``,
    float64[m, 3], m >= 1, in the costmap's frame.

    Attributes:
        searched: What ``choose`` scored, and the samples, float64[n, 3].
    """

    searched: Tuple[dwa_search.Critics, NDArray[np.float64]]

    def __init__(
        self,
        params: DwaParams,
        spec: GridSpec,
        costs: NDArray[np.uint8],
        footprint: NDArray[np.float64],
        plan: NDArray[np.float64],
        pose: Pose2D,
        velocity: Twist2D,
        grids: Optional[DwaGrids] = None,
    ) -> None:
        self.params = params
        # Upstream keeps the robot's state in single precision.
        self.pose = Pose2D(*single(pose.x_m, pose.y_m, pose.yaw_rad))
        self.velocity = single(velocity.vx_mps, velocity.vy_mps, velocity.vyaw_radps)
        self.goal = Pose2D(*plan[-1].tolist())
        self.costmap = costmap_view(spec, costs)
        self.footprint = footprint
        self.grids = self._measure(plan) if grids is None else grids
        self.path_scale = float(params.path_distance_bias * spec.resolution_m)  # per cell
        self.goal_scale = float(params.goal_distance_bias * spec.resolution_m)
        self.motion = _motion(params)
        self.map_grids = self._weighed_grids()
        self.weights = dwa_search.Weights(
            path_scale=self.path_scale,
            goal_scale=self.goal_scale,
            twirling_scale=float(params.twirling_scale),
            scaling_speed_mps=float(params.scaling_speed_mps),
            max_scaling_factor=float(params.max_scaling_factor),
            max_vel_trans_mps=float(params.max_vel_trans_mps),
        )

    def choose(self, oscillation: OscillationCritic, control_period_s: float) -> Trajectory:
        """Return the cheapest sampled trajectory, of cost NO_LEGAL_TRAJECTORY if none is legal."""
        goal = Pose2D(*single(self.goal.x_m, self.goal.y_m, self.goal.yaw_rad))
        samples = velocity_samples(self.params, self.pose, self.velocity, goal, control_period_s)
        self.searched = self.critics(samples, oscillation), samples
        k, cost = dwa_search.cheapest(*self.searched)
        if k < 0:
            return Trajectory((0.0, 0.0, 0.0), NO_LEGAL_TRAJECTORY, np.zeros((0, 3)))
        points, command = self.simulate(samples[k])
        return Trajectory(command, float(cost), points)

    def critics(
        self, samples: NDArray[np.float64], oscillation: OscillationCritic
    ) -> dwa_search.Critics:
        """Return what the kernels score samples, float64[n, 3], against."""
        scale = dwa_search.largest_footprint_scale(
            self.motion, self.weights, self.velocity, samples
        )
        return dwa_search.Critics(
            self.start,
            self.velocity,
            self.motion,
            self.map_grids,
            self.obstacles(scale),
            self.weights,
            oscillation.directions,
        )

    def is_legal(self, sample: Triple) -> bool:
        """Tell whether a sample hits nothing and stays in reach of path and goal.

        A sample outside of the speed limits is not simulated, and counts as legal.
        """
        points, command = self.simulate(np.array(single(*sample)))
        scale = dwa_search.footprint_scale(self.weights, command)
        obstacles = self.obstacles(scale)
        no_terms = np.zeros(0)
        if (
            obstacles.scale != 0.0
            and kernel.obstacle_cost(obstacles, scale, points, len(points), no_terms, np.inf) < 0.0
        ):
            return False
        return bool(kernel.is_within_reach(self.map_grids, points, len(points), np.zeros(4)))

    @property
    def start(self) -> Triple:
        """Pose of the robot: x, y, yaw."""
        return self.pose.x_m, self.pose.y_m, self.pose.yaw_rad

    def simulate(self, sample: NDArray[np.float64]) -> Tuple[NDArray[np.float64], Triple]:
        """Return poses, float64[k, 3], and the command of a sample, float64[3]."""
        points = np.empty((kernel.step_count(self.motion, sample), 3))
        _, command = kernel.simulate(self.motion, self.start, self.velocity, sample, points)
        return points, command

    def _measure(self, plan: NDArray[np.float64]) -> DwaGrids:
        ahead_rad = math.atan2(self.goal.y_m - self.pose.y_m, self.goal.x_m - self.pose.x_m)
        forward_m = self.params.forward_point_distance_m
        ahead_x_m, ahead_y_m = Pose2D(0.0, 0.0, ahead_rad).rotate(forward_m, 0.0)
        return DwaGrids(
            *distances_ahead(
                self.costmap,
                np.ascontiguousarray(plan),
                self.goal.x_m + ahead_x_m,
                self.goal.y_m + ahead_y_m,
            )
        )

    def _weighed_grids(self) -> kernel.MapGrids:
        follows_path = self.params.path_distance_bias != 0.0
        near_m2 = self.params.forward_point_distance_m**2 * self.params.cheat_factor
        to_goal_m2 = (self.pose.x_m - self.goal.x_m) ** 2 + (self.pose.y_m - self.goal.y_m) ** 2
        return kernel.MapGrids(
            self.costmap,
            *self.grids,
            float(self.params.forward_point_distance_m),
            follows_path=follows_path,
            follows_goal=self.params.goal_distance_bias != 0.0,
            aligns=follows_path and to_goal_m2 > near_m2,
        )

    @property
    def _travel_m(self) -> float:
        """Distance that no sample of the planner exceeds."""
        params, (vx, vy, _) = self.params, self.velocity
        fastest_x = max(map(abs, (params.max_vel_x_mps, params.min_vel_x_mps, vx)))
        fastest_y = max(map(abs, (params.max_vel_y_mps, params.min_vel_y_mps, vy)))
        return float(params.sim_time_s * math.hypot(fastest_x, fastest_y))

    def obstacles(self, footprint_scale: float) -> kernel.Obstacles:
        """Return the obstacle critic's input for footprints up to a factor of their size."""
        largest = max(abs(footprint_scale), 1.0) if math.isfinite(footprint_scale) else 1.0
        x_m, y_m, _ = self.start
        return kernel.Obstacles(
            self.costmap,
            highest_near(self.costmap, self.footprint, largest, x_m, y_m, self._travel_m),
            self.footprint,
            scale=float(self.params.occdist_scale),
            sums=bool(self.params.sum_scores),
        )


def _motion(params: DwaParams) -> kernel.Motion:
    return kernel.Motion(
        sim_time_s=float(params.sim_time_s),
        sim_granularity_m=float(params.sim_granularity_m),
        angular_sim_granularity_rad=float(params.angular_sim_granularity_rad),
        acceleration_limits=acceleration_limits(params),
        min_vel_trans_mps=float(params.min_vel_trans_mps),
        max_vel_trans_mps=float(params.max_vel_trans_mps),
        min_vel_theta_radps=float(params.min_vel_theta_radps),
        accelerates=not params.use_dwa,
    )


def velocity_samples(
    params: DwaParams, pose: Pose2D, velocity: Triple, goal: Pose2D, control_period_s: float
) -> NDArray[np.float64]:
    """Return the velocities to try, a grid over those that are allowed and can be reached.

    They can be reached in one control period with ``use_dwa``, else in ``sim_time_s``, and then no
    faster than would overshoot the local goal.

    Returns:
        float64[n, 3], rows vx, vy, vtheta of single precision; vtheta varies fastest.
    """
    lowest, highest = _velocity_window(params, pose, velocity, goal, control_period_s)
    counts = int(params.vx_samples), int(params.vy_samples), int(params.vth_samples)
    return kernel.sample_grid(lowest, highest, counts)


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
