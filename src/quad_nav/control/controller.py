"""What the navigator asks of a local planner."""

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
    """A velocity command and what it was chosen from.

    ``cost`` is the chosen trajectory's, nan while stopping or turning at the
    goal (``goal_mode``). ``local_plan`` float64[k, 3] is that trajectory,
    ``global_plan`` float64[m, 3] the part of the global plan that was followed;
    both are rows x, y, yaw in the local costmap's frame.
    """

    command: Twist2D
    cost: float
    local_plan: NDArray[np.float64]
    global_plan: NDArray[np.float64]
    goal_mode: bool = False


class LocalPlanner(Protocol):
    """Follows a global plan over the local costmap."""

    def set_plan(self, plan: NDArray[np.float64]) -> None:
        """A new global plan, float64[n, 3] rows x, y, yaw in its own frame."""
        ...

    def set_footprint(self, footprint: NDArray[np.float64]) -> None:
        """The padded footprint, float64[n, 2] in the robot's frame."""
        ...

    def compute_velocity(
        self,
        spec: GridSpec,
        costs: NDArray[np.uint8],
        pose: Pose2D,
        velocity: Twist2D,
        local_from_plan: Pose2D = IDENTITY,
    ) -> Control:
        """The command for now. Raises a ``ControlError`` when there is none."""
        ...

    def is_goal_reached(self) -> bool:
        """Whether the plan's end was reached, heading included."""
        ...

    def cost_cloud(self) -> NDArray[np.float32]:
        """What each cell cost in the last call, float32[n, 7]: x, y, z, path, goal,
        obstacle and total; float32[0, 7] for a planner that scores no cells."""
        ...
