"""The controller ``base_local_planner/TrajectoryPlannerROS``: trajectory rollout.

Each call cuts the global plan to the local costmap, measures distances to it (``map_grid``),
simulates velocities (``rollout``) and takes the best one (``velocity_search``). Within
``xy_goal_tolerance_m`` of the plan's last pose in the local costmap it stops and turns in place
instead (``plan_follower``).
"""

from __future__ import annotations

from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.controller import IDENTITY, Control
from quad_nav.control.oscillation import Oscillation
from quad_nav.control.plan_follower import NO_POSES, PlanFollower
from quad_nav.control.rollout import Rollout, Trajectory
from quad_nav.control.rollout_kernel import OUT_OF_REACH
from quad_nav.control.trajectory_planner_params import TrajectoryPlannerParams
from quad_nav.control.velocity_search import choose_trajectory
from quad_nav.errors import NoValidTrajectory
from quad_nav.geometry import Pose2D, Twist2D, angle_difference
from quad_nav.grid import GridSpec

__all__ = ["TrajectoryPlanner", "TrajectoryPlannerParams"]


class TrajectoryPlanner(PlanFollower):
    """Trajectory rollout; at the goal when any call since ``set_plan`` found the robot there.

    Attributes:
        oscillation: State kept from call to call.
        best: Trajectory chosen in the last call; None if it did not simulate.
        rollout: Rollout of the last call; None if it did not simulate.
    """

    def __init__(
        self,
        params: TrajectoryPlannerParams,
        footprint: NDArray[np.float64],
        control_period_s: float,
    ) -> None:
        super().__init__(params, footprint, control_period_s)
        self.oscillation = Oscillation()
        self.best: Optional[Trajectory] = None
        self.rollout: Optional[Rollout] = None

    def set_footprint(self, footprint: NDArray[np.float64]) -> None:
        """Take another padded footprint; upstream keeps that of the start."""
        if self.params.follow_footprint:
            super().set_footprint(footprint)

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
            NoValidTrajectory: Path or goal are out of reach, or the command at the goal would
                collide.
        """
        self.best = self.rollout = None
        plan = self._cut_plan(spec, pose, local_from_plan)
        goal = Pose2D(*plan[-1])
        if self.xy_tolerance_latch or pose.distance_to(goal) <= self.params.xy_goal_tolerance_m:
            self.xy_tolerance_latch = self.xy_tolerance_latch or self.params.latch_xy_goal_tolerance
            command = self._command_at_goal(spec, costs, pose, velocity, goal)
            return Control(command, float("nan"), NO_POSES, plan, goal_mode=True)
        best = self._search(spec, costs, pose, velocity)
        if best.cost < 0.0:
            reason = (
                "the global plan or its end in the local costmap is out of reach"
                if best.cost == OUT_OF_REACH
                else "every trajectory collides"
            )
            raise NoValidTrajectory(f"{reason} from ({pose.x_m:.2f}, {pose.y_m:.2f}) m")
        return Control(Twist2D(*best.sample), best.cost, best.points, plan)

    def cost_cloud(self) -> NDArray[np.float32]:
        """Return the cells' costs in the last call; empty if not wanted, or not simulated."""
        if self.rollout is None or not self.params.publish_cost_grid_pc:
            return np.zeros((0, 7), dtype=np.float32)
        return self.rollout.cost_cloud()

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
            self.rotating_to_goal = self.xy_tolerance_latch = False
            self._goal_reached = True
            return Twist2D()
        self._search(spec, costs, pose, velocity)  # updates the oscillation state
        command = self._stop_or_turn(turn_rad, velocity, self.params)
        assert self.rollout is not None
        if not self.rollout.is_valid(pose, velocity, command):
            raise NoValidTrajectory(
                f"no room to stop and turn at the goal, ({pose.x_m:.2f}, {pose.y_m:.2f}) m"
            )
        return command

    def _search(
        self, spec: GridSpec, costs: NDArray[np.uint8], pose: Pose2D, velocity: Twist2D
    ) -> Trajectory:
        plan = self.local_global_plan
        self.rollout = Rollout(self.params, spec, costs, self.footprint, plan, pose, velocity)
        self.best = choose_trajectory(
            self.rollout, self.params, self.oscillation, self.control_period_s
        )
        return self.best
