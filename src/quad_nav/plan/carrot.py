"""The planner ``carrot_planner/CarrotPlanner``: straight to the goal, as near as the robot fits.

The goal is moved back along the line to the robot, position and heading alike, a hundredth of the
distance at a time, until the footprint's outline at that pose touches neither lethal nor unknown
cells. Obstacles between robot and goal are left to the local planner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quad_nav.costmap import collision
from quad_nav.costmap.cost_grid import costmap_view
from quad_nav.errors import NoPath
from quad_nav.geometry import Pose2D, wrap_angle
from quad_nav.grid import GridSpec

_SHARE_STEP = 0.01
_CORNERS_NEEDED = 3


@dataclass(frozen=True)
class CarrotParams:
    """Parameters of ``carrot_planner/CarrotPlanner``: none that changes anything."""


class Carrot:
    """The planner ``carrot_planner/CarrotPlanner``.

    Attributes:
        params: Parameters.
        footprint: Padded footprint, float64[n, 2] in the robot's frame.
    """

    def __init__(self, params: CarrotParams, footprint: NDArray[np.float64]) -> None:
        self.params = params
        self.footprint = np.array(footprint, dtype=np.float64)

    def make_plan(
        self, spec: GridSpec, costs: NDArray[np.uint8], start: Pose2D, goal: Pose2D
    ) -> NDArray[np.float64]:
        """Return the start and the nearest pose to the goal where the robot fits, float64[2, 3].

        Raises:
            NoPath: The robot fits nowhere on the line, not even where it is.
        """
        if len(self.footprint) >= _CORNERS_NEEDED:
            costmap = costmap_view(spec, costs)
            turn_rad = wrap_angle(goal.yaw_rad - start.yaw_rad)
            share = 1.0
            while share >= 0.0:
                pose = (
                    start.x_m + share * (goal.x_m - start.x_m),
                    start.y_m + share * (goal.y_m - start.y_m),
                    wrap_angle(start.yaw_rad + share * turn_rad),
                )
                if collision.footprint_cost(costmap, self.footprint, pose) >= 0.0:
                    return np.array([(start.x_m, start.y_m, start.yaw_rad), pose])
                share -= _SHARE_STEP
        raise NoPath(
            f"the robot fits nowhere on the line from ({start.x_m:.2f}, {start.y_m:.2f}) "
            f"to ({goal.x_m:.2f}, {goal.y_m:.2f}) m"
        )
