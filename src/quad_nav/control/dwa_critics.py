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
"""

from __future__ import annotations

import math
from typing import NamedTuple, Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.dwa_samples import acceleration_limits, velocity_samples
from quad_nav.control.rollout import (
    Trajectory,
    Triple,
    costmap_view,
    footprint_reach_m,
    highest_near,
    single,
)
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec
from quad_nav.kernels import dwa as kernel
from quad_nav.kernels.map_grid import cells_on_plan, spread

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
    """

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
        self.spec = spec
        # Upstream keeps the robot's state in single precision.
        self.pose = Pose2D(*single(pose.x_m, pose.y_m, pose.yaw_rad))
        self.velocity = single(velocity.vx_mps, velocity.vy_mps, velocity.vyaw_radps)
        self.goal = Pose2D(*plan[-1].tolist())
        self.costmap = costmap_view(spec, costs)
        self.footprint = footprint
        self.grids = self._measure(plan) if grids is None else grids
        self.path_scale = params.path_distance_bias * spec.resolution_m  # per cell
        self.goal_scale = params.goal_distance_bias * spec.resolution_m
        self.motion = _motion(params)
        self.map_grids = self._weighed_grids()

    def choose(self, oscillation: OscillationCritic, control_period_s: float) -> Trajectory:
        """Return the cheapest sampled trajectory, of cost NO_LEGAL_TRAJECTORY if none is legal."""
        goal = Pose2D(*single(self.goal.x_m, self.goal.y_m, self.goal.yaw_rad))
        samples = velocity_samples(self.params, self.pose, self.velocity, goal, control_period_s)
        commands, distances, legal = kernel.travel(
            self.motion, self.map_grids, self.start, self.velocity, samples
        )
        legal &= ~oscillation.forbids(commands)
        scales = footprint_scales(self.params, commands)
        k, cost = kernel.cheapest(
            self.motion,
            self.obstacles(scales[legal]),
            self.start,
            self.velocity,
            kernel.Candidates(samples, self.terms(commands, distances), legal, scales),
        )
        if k < 0:
            return Trajectory((0.0, 0.0, 0.0), NO_LEGAL_TRAJECTORY, np.zeros((0, 3)))
        points, command = self.simulate(samples[k])
        return Trajectory(command, float(cost), points)

    def is_legal(self, sample: Triple) -> bool:
        """Tell whether a sample hits nothing and stays in reach of path and goal.

        A sample outside of the speed limits is not simulated, and counts as legal.
        """
        points, command = self.simulate(np.array(single(*sample)))
        scale = footprint_scales(self.params, np.array([command]))
        if (
            self.params.occdist_scale != 0.0
            and kernel.obstacle_cost(self.obstacles(scale), scale[0], points, len(points)) < 0.0
        ):
            return False
        return kernel.is_within_reach(self.map_grids, points, len(points), np.zeros(4))

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
        plan_xy = np.ascontiguousarray(plan[:, :2])
        front_xy = plan_xy.copy()
        ahead_rad = math.atan2(self.goal.y_m - self.pose.y_m, self.goal.x_m - self.pose.x_m)
        forward_m = self.params.forward_point_distance_m
        front_xy[-1] += Pose2D(0.0, 0.0, ahead_rad).rotate(forward_m, 0.0)
        nowhere = np.zeros(self.costmap.costs.shape, dtype=np.bool_)
        cells = cells_on_plan(self.costmap, plan_xy)
        front_cells = cells_on_plan(self.costmap, front_xy)
        path, goal, goal_front = (
            spread(self.costmap.costs, nowhere, sources)
            for sources in (cells, cells[-1:], front_cells[-1:])
        )
        return DwaGrids(path, goal, goal_front)

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

    def terms(
        self, commands: NDArray[np.float64], distances: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the critics' costs but the obstacles', float64[n, 5], in their order."""
        scales = np.zeros(4)
        scales[[kernel.GOAL_FRONT, kernel.GOAL]] = self.goal_scale
        scales[[kernel.ALIGNMENT, kernel.PATH]] = self.path_scale
        twirling = self.params.twirling_scale * np.abs(commands[:, 2])
        return np.column_stack((distances * scales, twirling))

    def obstacles(self, scales: NDArray[np.float64]) -> kernel.Obstacles:
        """Return the obstacle critic's input for trajectories with footprint scales, float64[n]."""
        largest = float(np.max(np.abs(scales[np.isfinite(scales)]), initial=1.0))
        reach_m = footprint_reach_m(self.footprint) * largest
        return kernel.Obstacles(
            self.costmap,
            highest_near(self.costmap, reach_m),
            self.footprint,
            scale=float(self.params.occdist_scale),
            sums=bool(self.params.sum_scores),
        )


def footprint_scales(params: DwaParams, commands: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the factors, float64[n], of the footprint's size at commands, float64[n, 3]."""
    speeds = np.hypot(commands[:, 0], commands[:, 1])
    room_mps = params.max_vel_trans_mps - params.scaling_speed_mps
    if room_mps == 0.0:
        return np.where(speeds > params.scaling_speed_mps, np.inf, 1.0)
    share = (speeds - params.scaling_speed_mps) / room_mps
    return np.where(speeds > params.scaling_speed_mps, params.max_scaling_factor * share + 1.0, 1.0)


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
