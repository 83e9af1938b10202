"""What the navigator asks of a global planner."""

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
    """Makes a path over the global costmap."""

    def make_plan(
        self, spec: GridSpec, costs: NDArray[np.uint8], start: Pose2D, goal: Pose2D
    ) -> NDArray[np.float64]:
        """A plan from start to goal, float64[n, 3] rows x, y, yaw.

        ``costs`` is the global costmap's own uint8[H, W] on ``spec``; start, goal
        and plan are in its frame. The last row is where the robot is to end, and
        which way it is to look there. Raises a ``PlanningError`` when there is no
        plan; a plan returned is never empty.
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
    """The plan to the goal, or to the first point around it that has one.

    The points lie on square rings three cells apart (or one tolerance, if that is
    less). ``append_goal`` ends such a plan at the goal all the same.

    Raises:
        PlanningError: as for the goal itself, when no point has a plan.
    """
    try:
        return planner.make_plan(spec, costs, start, goal)
    except PlanningError as error:
        unreachable = error
    step_m = 3.0 * spec.resolution_m
    if 0.0 < tolerance_m < step_m:
        step_m = tolerance_m
    for dx, dy in ring_offsets(step_m, tolerance_m):
        near = Pose2D(goal.x_m + dx, goal.y_m + dy, goal.yaw_rad)
        try:
            plan = planner.make_plan(spec, costs, start, near)
        except PlanningError:
            continue  # the next point may do; the goal's own error is raised in the end
        return np.vstack([plan, [goal.x_m, goal.y_m, goal.yaw_rad]]) if append_goal else plan
    raise unreachable


def ring_offsets(step_m: float, reach_m: float) -> Iterator[Tuple[float, float]]:
    """Points on growing square rings around a centre, in the original's order."""
    for ring in range(1, int(math.floor(reach_m / step_m + 1e-9)) + 1):
        for y, x in itertools.product(range(ring + 1), repeat=2):
            if max(x, y) < ring:
                continue
            for sign_y, sign_x in itertools.product((-1, 1), repeat=2):
                if (y == 0 and sign_y < 0) or (x == 0 and sign_x < 0):
                    continue
                yield sign_x * x * step_m, sign_y * y * step_m
