"""Trajectory rollout: simulate velocity samples and score them.

A sample (vx, vy, vtheta) is simulated for ``sim_time_s`` in steps of about ``sim_granularity_m``
or ``angular_sim_granularity_rad``, starting with the current velocity and approaching the sample
as the acceleration limits allow. With the last pose's distances to path and goal, in cells,

    cost = path_scale * path distance + goal_scale * goal distance
         + occdist_scale * highest cell cost under the footprint along the trajectory

The cost is negative when the footprint touches a lethal or unknown cell or leaves the costmap
(-1), or when a pose lies where neither path nor goal can be reached from (-2). With
``heading_scoring``, path and goal distances are those of one early pose only, and the angle to
the farthest visible plan point counts as well. With ``simple_attractor``, only the squared
distance to the plan's end counts.

The search for the best sample draws few footprints. Where a sample ends gives the least that it
can cost: path and goal distance of the last cell, and the cost of that cell alone. Samples are
tried in that order until the least is more than the best cost so far. The last cells of all
samples are found at once, with headings turned by series instead of cosines; within rounding of
a cell's border, and for every sample that is tried, the poses are computed as upstream does.

Source: B. Gerkey, K. Konolige, "Planning and control in unstructured terrain", ICRA Workshop on
Path Planning on Costmaps, 2008.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Optional, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.control import rollout_kernel as kernel
from quad_nav.control.map_grid import cost_cloud, distance_grids
from quad_nav.control.sample_motion import RolloutParams
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.costmap import collision
from quad_nav.costmap.collision import Triple
from quad_nav.costmap.cost_grid import costmap_view
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import INSCRIBED, LETHAL, GridSpec


@dataclass(frozen=True)
class Trajectory:
    """Simulated sample.

    Attributes:
        sample: (vx, vy, vtheta).
        cost: Its cost; negative if it is illegal.
        points: float64[k, 3], poses, rows x, y, yaw in the costmap's frame.
    """

    sample: Triple
    cost: float
    points: NDArray[np.float64]


class Rollout:
    """Simulation and scoring of samples from one robot state on one costmap.

    Attributes:
        spec: Grid of the costmap.
        pose: Pose of the robot, in single precision as upstream keeps it.
        velocity: (vx, vy, vtheta) of the robot, likewise.
        goal_x_m: End of the plan in the costmap.
        goal_y_m: End of the plan in the costmap.
        grids: Distances to plan and local goal.
        inputs: What the kernels start with and score against.
    """

    def __init__(
        self,
        params: TrajectoryPlannerParams,
        spec: GridSpec,
        costs: NDArray[np.uint8],
        footprint: NDArray[np.float64],
        plan: NDArray[np.float64],
        pose: Pose2D,
        velocity: Twist2D,
    ) -> None:
        self.spec = spec
        self.pose = Pose2D(*single(pose.x_m, pose.y_m, pose.yaw_rad))
        self.velocity = single(velocity.vx_mps, velocity.vy_mps, velocity.vyaw_radps)
        costmap = costmap_view(spec, costs)
        plan = np.ascontiguousarray(plan)
        self.goal_x_m, self.goal_y_m = plan[-1, :2].tolist()
        self.grids = distance_grids(costmap, plan, footprint, _triple(self.pose))
        self.inputs = kernel.RolloutInputs(
            _kernel_params(params, spec.resolution_m),
            _triple(self.pose),
            self.velocity,
            costmap,
            collision.highest_near(
                costmap,
                footprint,
                1.0,
                self.pose.x_m,
                self.pose.y_m,
                _travel_m(params, self.velocity),
            ),
            footprint,
            self.grids.path,
            self.grids.goal,
            plan,
        )

    def score(
        self, samples: NDArray[np.float64]
    ) -> Tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Score samples, float64[n, 3], rows vx, vy, vtheta.

        Returns:
            Costs, float64[n], and last poses, float64[n, 3].
        """
        return kernel.score(self.inputs, samples)

    def trajectory(self, sample: Triple) -> Trajectory:
        """Simulate a sample from the robot's state."""
        cost, points = kernel.trajectory(self.inputs, sample)
        return Trajectory(sample, cost, points)

    def is_valid(self, pose: Pose2D, velocity: Twist2D, command: Twist2D) -> bool:
        """Tell whether a command from a state, in double precision, is legal."""
        inputs = self.inputs._replace(pose=_triple(pose), velocity=_twist_triple(velocity))
        cost, _ = kernel.trajectory(inputs, _twist_triple(command))
        return bool(cost >= 0.0)

    def is_free(self, pose: Pose2D) -> bool:
        """Tell whether no obstacle is under or inside of the footprint at a pose."""
        costmap, footprint = self.inputs.costmap, self.inputs.footprint
        if collision.footprint_cost(costmap, footprint, _triple(pose)) < 0.0:
            return False
        inside = np.zeros(costmap.costs.shape, dtype=np.bool_)
        if len(footprint) > 2:
            collision.mark_footprint(costmap, footprint, _triple(pose), inside)
        return not bool((costmap.costs[inside] >= LETHAL).any())

    def goal_distance_at(self, x_m: float, y_m: float) -> Optional[int]:
        """Return the goal distance of a point in cells, None off the map."""
        cell = self.spec.cell_of(x_m, y_m)
        return None if cell is None else int(self.grids.goal[cell[1], cell[0]])

    def cost_cloud(self) -> NDArray[np.float32]:
        """Return the costs of every cell that the robot could be in; see ``map_grid.cost_cloud``.

        Cells in or behind obstacles and under the robot are left out.
        """
        costs, path = self.inputs.costmap.costs, self.grids.path
        usable = (path < costs.size) & (costs < INSCRIBED) & ~self.grids.within_robot
        params = self.inputs.params
        scales = params.path_scale, params.goal_scale, params.occupancy_scale
        return cost_cloud(self.inputs.costmap, path, self.grids.goal, usable, scales)


def _travel_m(params: TrajectoryPlannerParams, velocity: Triple) -> float:
    """Return the distance that no sample of the planner exceeds."""
    fastest_x = max(map(abs, (params.max_vel_x_mps, params.min_vel_x_mps, params.escape_vel_mps)))
    fastest_y = max(map(abs, params.y_vels_mps), default=0.0) if params.holonomic_robot else 0.0
    fastest_x, fastest_y = max(fastest_x, abs(velocity[0])), max(fastest_y, abs(velocity[1]))
    return float(params.sim_time_s * math.hypot(fastest_x, fastest_y))


def _kernel_params(params: TrajectoryPlannerParams, resolution_m: float) -> RolloutParams:
    # Biases are per metre with meter scoring, distances are in cells.
    per_cell = resolution_m if params.scores_in_metres else 1.0
    return RolloutParams(
        sim_time_s=float(params.sim_time_s),
        sim_granularity_m=float(params.sim_granularity_m),
        angular_sim_granularity_rad=float(params.angular_sim_granularity_rad),
        acc_lim_x_mps2=float(params.acc_lim_x_mps2),
        acc_lim_y_mps2=float(params.acc_lim_y_mps2),
        acc_lim_theta_radps2=float(params.acc_lim_theta_radps2),
        path_scale=params.path_distance_bias * per_cell,
        goal_scale=params.goal_distance_bias * per_cell,
        occupancy_scale=float(params.occdist_scale),
        heading_scoring=bool(params.heading_scoring),
        heading_scoring_timestep_s=float(params.heading_scoring_timestep_s),
        simple_attractor=bool(params.simple_attractor),
    )


def single(*values: float) -> Triple:
    """Round three numbers to single precision."""
    x, y, z = (float(np.float32(value)) for value in values)
    return x, y, z


def _triple(pose: Pose2D) -> Triple:
    return float(pose.x_m), float(pose.y_m), float(pose.yaw_rad)


def _twist_triple(twist: Twist2D) -> Triple:
    return float(twist.vx_mps), float(twist.vy_mps), float(twist.vyaw_radps)
