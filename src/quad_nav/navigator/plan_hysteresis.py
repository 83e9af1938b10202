"""Plan hysteresis: keep the way that a robot has taken until the planner insists on another one.

A gap about as wide as the robot closes in the costmap when noise moves one point of a scan into
the next cell, and opens again with the next scan. Each time the global planner changes between the
way through the gap and a way around; so it does between two ways of nearly the same cost. A robot
that follows each of these plans turns back and forth at the fork.
"""

from __future__ import annotations

import math
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.geometry import Pose2D

_Plan = NDArray[np.float64]

_SAMPLE_M = 0.2  # plans are compared at points about so far apart


class PlanHysteresis:
    """Chooses between the plan that a robot follows and a new one."""

    def __init__(self) -> None:
        """Create a hysteresis without a plan."""
        self._plan: Optional[_Plan] = None
        self._other_since_s = math.inf

    def forget(self) -> None:
        """Take the next plan, whatever it is."""
        self._plan = None
        self._other_since_s = math.inf

    def choose(
        self, new: _Plan, now_s: float, pose: Pose2D, delay_s: float, same_way_m: float
    ) -> _Plan:
        """Return the plan to follow from now on.

        A new plan along the way of the current one replaces it at once: it is the better informed
        one. Another way is taken when all plans of the last ``delay_s`` have led another way. A
        plan to another end is always taken.

        Args:
            new: The new plan, float64[n, 3] of (x_m, y_m, yaw_rad).
            now_s: Time of the search.
            pose: Pose of the robot in the plan's frame.
            delay_s: Time of the hysteresis.
            same_way_m: Plans no farther apart lead the same way.

        Returns:
            The new plan, or what is left of the current one.
        """
        left = None if self._plan is None else _rest(self._plan, pose)
        self._plan = new
        if left is None or _is_same_way(new, left, same_way_m):
            self._other_since_s = math.inf
            return new
        self._other_since_s = min(self._other_since_s, now_s)
        if now_s - self._other_since_s < delay_s:
            self._plan = left
        else:
            self._other_since_s = math.inf
        return self._plan


def _rest(plan: _Plan, pose: Pose2D) -> _Plan:
    """Return a plan from its point nearest to the robot on."""
    nearest = np.argmin(np.hypot(plan[:, 0] - pose.x_m, plan[:, 1] - pose.y_m))
    return plan[int(nearest) :]


def _is_same_way(plan: _Plan, other: _Plan, same_way_m: float) -> bool:
    """Return whether no point of a plan is farther from another plan, or their ends are apart."""
    end_x_m, end_y_m = plan[-1, :2] - other[-1, :2]
    if math.hypot(end_x_m, end_y_m) > same_way_m:
        return True
    points, others = _samples(plan), _samples(other)
    distances_m = np.hypot(
        points[:, None, 0] - others[None, :, 0], points[:, None, 1] - others[None, :, 1]
    )
    return float(distances_m.min(axis=1).max()) <= same_way_m


def _samples(plan: _Plan) -> _Plan:
    steps = np.diff(plan[:, :2], axis=0)
    length_m = float(np.hypot(steps[:, 0], steps[:, 1]).sum())
    count = min(len(plan), 2 + int(length_m / _SAMPLE_M))
    return plan[np.linspace(0, len(plan) - 1, count).astype(np.int64)]
