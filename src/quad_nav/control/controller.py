"""Interface of a local planner."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.grid import GridSpec

IDENTITY = Pose2D(0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Control:
    """Velocity command and the trajectory that it was chosen for.

    Attributes:
        command: The command, in the robot's frame.
        cost: Cost of the trajectory; nan while stopping or turning at the goal.
        local_plan: float64[k, 3], the trajectory, rows x, y, yaw in the local costmap's frame.
        global_plan: float64[m, 3], the part of the global plan that is followed, as above.
        goal_mode: True while stopping or turning at the goal.
    """

    command: Twist2D
    cost: float
    local_plan: NDArray[np.float64]
    global_plan: NDArray[np.float64]
    goal_mode: bool = False


class LocalPlanner(Protocol):
    """Planner that follows a global plan over the local costmap."""

    def set_plan(self, plan: NDArray[np.float64]) -> None:
        """Take a new global plan, float64[n, 3] rows x, y, yaw in its own frame."""
        ...

    def set_footprint(self, footprint: NDArray[np.float64]) -> None:
        """Take another padded footprint, float64[n, 2] in the robot's frame."""
        ...

    def compute_velocity(
        self,
        spec: GridSpec,
        costs: NDArray[np.uint8],
        pose: Pose2D,
        velocity: Twist2D,
        local_from_plan: Pose2D = IDENTITY,
    ) -> Control:
        """Compute the command for now.

        Args:
            spec: Grid of the local costmap.
            costs: uint8[H, W] on it.
            pose: Pose of the robot in the local costmap's frame.
            velocity: Velocity of the robot, in its own frame.
            local_from_plan: Pose of the plan's frame in the local costmap's frame.

        Returns:
            The command and its trajectory.

        Raises:
            ControlError: There is no legal command.
        """
        ...

    def is_goal_reached(self) -> bool:
        """Tell whether the robot has reached the plan's end, heading included."""
        ...

    def cost_cloud(self) -> NDArray[np.float32]:
        """Return the costs of cells in the last call, for the point cloud ``cost_cloud``.

        Returns:
            float32[n, 7]: x, y, z, path, goal, obstacle and total cost; float32[0, 7] for a
            planner that scores no cells.
        """
        ...
