"""The planner ``carrot_planner/CarrotPlanner``: straight for the goal, as near as the robot fits.

The goal is drawn back along the line to the robot, position and heading alike,
a hundredth of the way at a time, until the footprint's outline at that pose
touches neither lethal nor unknown cells. What lies between is left to the local
planner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import NoPath
from quad_nav.geometry import Pose2D, angle_difference, normalize_angle
from quad_nav.grid import GridSpec
from quad_nav.kernels import collision
from quad_nav.kernels.cost_grid import CostmapView

_SHARE_STEP = 0.01
_CORNERS_NEEDED = 3


@dataclass(frozen=True)
class CarrotParams:
    """``carrot_planner/CarrotPlanner`` has no parameter that changes anything."""


class Carrot:
    """The planner ``carrot_planner/CarrotPlanner``.

    ``footprint`` is the padded one, float64[n, 2] in the robot's frame.
    """

    def __init__(self, params: CarrotParams, footprint: NDArray[np.float64]) -> None:
        self.params = params
        self.footprint = np.array(footprint, dtype=np.float64)

    def make_plan(
        self, spec: GridSpec, costs: NDArray[np.uint8], start: Pose2D, goal: Pose2D
    ) -> NDArray[np.float64]:
        """The start and the nearest pose to the goal that the robot fits in, float64[2, 3].

        ``costs`` is uint8[H, W] on ``spec``. Raises NoPath when the robot fits
        nowhere on the line, not even where it stands.
        """
        if len(self.footprint) >= _CORNERS_NEEDED:
            costmap = CostmapView(
                np.ascontiguousarray(costs),
                float(spec.origin_x_m),
                float(spec.origin_y_m),
                float(spec.resolution_m),
            )
            turn_rad = angle_difference(goal.yaw_rad, start.yaw_rad)
            share = 1.0
            while share >= 0.0:
                pose = (
                    start.x_m + share * (goal.x_m - start.x_m),
                    start.y_m + share * (goal.y_m - start.y_m),
                    normalize_angle(start.yaw_rad + share * turn_rad),
                )
                if collision.footprint_cost(costmap, self.footprint, *pose) >= 0.0:
                    return np.array([(start.x_m, start.y_m, start.yaw_rad), pose])
                share -= _SHARE_STEP
        raise NoPath(
            f"the robot fits nowhere on the line from ({start.x_m:.2f}, {start.y_m:.2f}) "
            f"to ({goal.x_m:.2f}, {goal.y_m:.2f}) m"
        )
