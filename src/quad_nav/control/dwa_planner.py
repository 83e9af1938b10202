"""The controller ``dwa_local_planner/DWAPlannerROS``: the dynamic window approach.

Each call cuts the global plan to the local costmap, samples velocities and takes the one
with the cheapest trajectory for the critics (``dwa_critics``, ``dwa_oscillation``).
Within ``xy_goal_tolerance_m`` of the global plan's end it stops and turns in place instead
(``plan_follower``).
"""

from __future__ import annotations

from dataclasses import replace
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.controller import IDENTITY, Control
from quad_nav.control.dwa_critics import Critics, DwaGrids, acceleration_limits
from quad_nav.control.dwa_oscillation import OscillationCritic
from quad_nav.control.dwa_planner_params import DwaParams
from quad_nav.control.dwa_trajectories import explored_points
from quad_nav.control.map_grid import cost_cloud
from quad_nav.control.plan_follower import NO_POSES, PlanFollower, is_stopped, plan_end
from quad_nav.control.rollout import Trajectory
from quad_nav.errors import NoValidTrajectory
from quad_nav.geometry import Pose2D, Twist2D, angle_difference
from quad_nav.grid import INSCRIBED, GridSpec

__all__ = ["DwaParams", "DwaPlanner"]


class DwaPlanner(PlanFollower):
    """Dynamic window approach; at the goal when the last call found the robot stopped there.

    Attributes:
        oscillation: State kept from call to call.
        best: Trajectory chosen in the last call; None if it did not search.
        critics: Critics of the last call; None if it used none.
    """

    def __init__(
        self, params: DwaParams, footprint: NDArray[np.float64], control_period_s: float
    ) -> None:
        super().__init__(params, footprint, control_period_s)
        self.oscillation = OscillationCritic()
        self.best: Optional[Trajectory] = None
        self.critics: Optional[Critics] = None
        self._grids: Optional[DwaGrids] = None  # of the last search
        self._shown: Optional[Critics] = None  # the last search, until it is asked for

    def set_plan(self, plan: NDArray[np.float64]) -> None:
        """Take a new global plan, and forget oscillation."""
        super().set_plan(plan)
        self.oscillation.reset()

    def compute_velocity(
        self,
        spec: GridSpec,
        costs: NDArray[np.uint8],
        pose: Pose2D,
        velocity: Twist2D,
        local_from_plan: Pose2D = IDENTITY,
    ) -> Control:
        """Compute the command for now; see ``LocalPlanner.compute_velocity``.

        Raises:
            NoLocalPlan: No part of the plan is near.
            NoValidTrajectory: No sampled trajectory is legal, or the command at the goal would
                collide.
        """
        self.best = self.critics = None
        self._goal_reached = False
        plan = self._cut_plan(spec, pose, local_from_plan)
        goal = plan_end(self.plan, local_from_plan)
        if self._is_at(goal, pose):
            self.xy_tolerance_latch = True
            self._goal_reached = abs(
                angle_difference(goal.yaw_rad, pose.yaw_rad)
            ) <= self.params.yaw_goal_tolerance_rad and is_stopped(velocity, self.params)
            command = self._command_at_goal(spec, costs, pose, velocity, goal)
            return Control(command, float("nan"), NO_POSES, plan, goal_mode=True)
        best = self._search(spec, costs, pose, velocity)
        if best.cost < 0.0:
            raise NoValidTrajectory(
                f"none of the sampled velocities is legal from "
                f"({pose.x_m:.2f}, {pose.y_m:.2f}) m: all collide, are too "
                f"slow or too fast, or leave the reach of the path or its end"
            )
        return Control(Twist2D(*best.sample), best.cost, best.points, plan)

    def cost_cloud(self) -> NDArray[np.float32]:
        """Return the cells' costs in the last call; empty if not wanted, or without a search."""
        if not self.params.publish_cost_grid_pc or self.best is None or self.critics is None:
            return np.zeros((0, 7), dtype=np.float32)
        critics, costs = self.critics, self.critics.costmap.costs
        usable = (critics.grids.path < costs.size) & (costs < INSCRIBED)
        scales = critics.path_scale, critics.goal_scale, critics.params.occdist_scale
        return cost_cloud(critics.costmap, critics.grids.path, critics.grids.goal, usable, scales)

    def pop_trajectories(self) -> Optional[NDArray[np.float32]]:
        """Return the points of all trajectories of a search once, see ``explored_points``.

        None without a search since the last call.
        """
        shown, self._shown = self._shown, None
        return None if shown is None else explored_points(*shown.searched)

    def _is_at(self, goal: Pose2D, pose: Pose2D) -> bool:
        latched = self.params.latch_xy_goal_tolerance and self.xy_tolerance_latch
        return latched or pose.distance_to(goal) <= self.params.xy_goal_tolerance_m

    def _command_at_goal(
        self,
        spec: GridSpec,
        costs: NDArray[np.uint8],
        pose: Pose2D,
        velocity: Twist2D,
        goal: Pose2D,
    ) -> Twist2D:
        turn_rad = angle_difference(goal.yaw_rad, pose.yaw_rad)
        if abs(turn_rad) <= self.params.yaw_goal_tolerance_rad:
            self.rotating_to_goal = False
            return Twist2D()
        command = self._stop_or_turn(turn_rad, velocity, _in_single_precision(self.params))
        self.oscillation.reset()
        # Upstream measures no distances here: it keeps those of the last search.
        grids = self._grids
        if grids is None or grids.path.shape != costs.shape:
            grids = DwaGrids(*np.zeros((3, *costs.shape), dtype=np.int32))
        plan = self.local_global_plan
        self.critics = Critics(
            self.params, spec, costs, self.footprint, plan, pose, velocity, grids
        )
        if not self.critics.is_legal((command.vx_mps, command.vy_mps, command.vyaw_radps)):
            raise NoValidTrajectory(
                f"no room to stop and turn at the goal, ({pose.x_m:.2f}, {pose.y_m:.2f}) m"
            )
        return command

    def _search(
        self, spec: GridSpec, costs: NDArray[np.uint8], pose: Pose2D, velocity: Twist2D
    ) -> Trajectory:
        plan = self.local_global_plan
        self.critics = Critics(self.params, spec, costs, self.footprint, plan, pose, velocity)
        self._grids, self._shown = self.critics.grids, self.critics
        self.best = self.critics.choose(self.oscillation, self.control_period_s)
        if self.best.cost >= 0.0:
            self.oscillation.record(
                self.best.sample,
                self.critics.pose,
                self.params.min_vel_trans_mps,
                self.params.oscillation_reset_dist_m,
                self.params.oscillation_reset_angle_rad,
            )
        return self.best


def _in_single_precision(params: DwaParams) -> DwaParams:
    """Return the parameters with the acceleration limits as upstream keeps them."""
    x, y, theta = acceleration_limits(params)
    return replace(params, acc_lim_x_mps2=x, acc_lim_y_mps2=y, acc_lim_theta_radps2=theta)
