"""Interface of a global planner, and plans to points near the goal."""

from __future__ import annotations

import itertools
import math
from typing import Iterator, Protocol, Tuple

import numpy as np
from numpy.typing import NDArray

from quad_nav.errors import PlanningError
from quad_nav.geometry import Pose2D
from quad_nav.grid import GridSpec


class GlobalPlanner(Protocol):
    """Planner of paths over the global costmap."""

    def make_plan(
        self, spec: GridSpec, costs: NDArray[np.uint8], start: Pose2D, goal: Pose2D
    ) -> NDArray[np.float64]:
        """Plan a path.

        Args:
            spec: Grid of the global costmap.
            costs: uint8[H, W], the costmap's own array; the planner may change it.
            start: Pose of the robot in the costmap's frame.
            goal: Pose of the goal in the costmap's frame.

        Returns:
            float64[n, 3], rows x, y, yaw in the costmap's frame, n >= 1. The last row is the
            pose where the robot ends.

        Raises:
            PlanningError: There is no plan.
        """
        ...


def plan_near(
    planner: GlobalPlanner,
    spec: GridSpec,
    costs: NDArray[np.uint8],
    start: Pose2D,
    goal: Pose2D,
    tolerance_m: float,
    append_goal: bool,
) -> NDArray[np.float64]:
    """Plan to the goal, or to the first point on square rings around it that has a plan.

    A point may be ``tolerance_m`` away along x or y; with ``append_goal`` its plan ends at the goal
    all the same. Other arguments are those of ``GlobalPlanner.make_plan``.

    Raises:
        PlanningError: No point has a plan; the error is the goal's own.
    """
    try:
        return planner.make_plan(spec, costs, start, goal)
    except PlanningError as error:
        unreachable = error
    step_m = _ring_step_m(spec.resolution_m, tolerance_m)
    for dx, dy in ring_offsets(step_m, tolerance_m):
        near = Pose2D(goal.x_m + dx, goal.y_m + dy, goal.yaw_rad)
        try:
            plan = planner.make_plan(spec, costs, start, near)
        except PlanningError:
            continue
        return np.vstack([plan, [goal.x_m, goal.y_m, goal.yaw_rad]]) if append_goal else plan
    raise unreachable


def _ring_step_m(resolution_m: float, tolerance_m: float) -> float:
    step_m = 3.0 * resolution_m
    return tolerance_m if 0.0 < tolerance_m < step_m else step_m


def ring_offsets(step_m: float, reach_m: float) -> Iterator[Tuple[float, float]]:
    """Yield points (dx, dy) on growing square rings, in the order of upstream move_base."""
    for ring in range(1, int(math.floor(reach_m / step_m + 1e-9)) + 1):
        for y, x in itertools.product(range(ring + 1), repeat=2):
            if max(x, y) < ring:
                continue
            for sign_y, sign_x in itertools.product((-1, 1), repeat=2):
                if (y == 0 and sign_y < 0) or (x == 0 and sign_x < 0):
                    continue
                yield sign_x * x * step_m, sign_y * y * step_m
