"""Interface of a global planner, and plans to points near the goal."""

from __future__ import annotations

import itertools
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
) -> Tuple[NDArray[np.float64], bool]:
    """Plan to the goal, or to the first point on square rings around it that has a plan.

    A point may be ``tolerance_m`` away along x or y. Other arguments are those of
    ``GlobalPlanner.make_plan``.

    Returns:
        The plan, and True if it is to a point beside the goal.

    Raises:
        PlanningError: No point has a plan; the error is the goal's own.
    """
    try:
        return planner.make_plan(spec, costs, start, goal), False
    except PlanningError as error:
        unreachable = error
    reach_m = min(_farthest_m(spec, goal), tolerance_m)  # NaN for a goal that is none
    for dx, dy in ring_offsets(spec.resolution_m, tolerance_m, reach_m):
        near = Pose2D(goal.x_m + dx, goal.y_m + dy, goal.yaw_rad)
        try:
            return planner.make_plan(spec, costs, start, near), True
        except PlanningError:
            continue
    raise unreachable


def _farthest_m(spec: GridSpec, goal: Pose2D) -> float:
    """Return how far from the goal, along x or y, the map ends: no farther point has a plan."""
    from_left_m, from_below_m = goal.x_m - spec.origin_x_m, goal.y_m - spec.origin_y_m
    width_m, height_m = spec.size_x * spec.resolution_m, spec.size_y * spec.resolution_m
    return max(from_left_m, width_m - from_left_m, from_below_m, height_m - from_below_m)


def ring_offsets(
    resolution_m: float, tolerance_m: float, reach_m: float
) -> Iterator[Tuple[float, float]]:
    """Yield points (dx, dy) on growing square rings, three cells apart, as upstream move_base.

    Sums are float32: on the border of two cells the last bit decides.

    Args:
        resolution_m: Side of a cell.
        tolerance_m: Distance of the rings, if it is shorter than three cells.
        reach_m: Distance of the last ring at most.
    """
    step = np.float32(3.0 * float(np.float32(resolution_m)))
    if 0.0 < tolerance_m < step:
        step = np.float32(tolerance_m)
    offsets = [np.float32(0.0)]
    while float(offsets[-1] + step) <= reach_m:
        offsets.append(offsets[-1] + step)
        ring = len(offsets) - 1
        for y, x in itertools.product(range(ring + 1), repeat=2):
            if max(x, y) < ring:
                continue
            for sign_y, sign_x in itertools.product((-1, 1), repeat=2):
                if (y == 0 and sign_y < 0) or (x == 0 and sign_x < 0):
                    continue
                yield sign_x * float(offsets[x]), sign_y * float(offsets[y])
