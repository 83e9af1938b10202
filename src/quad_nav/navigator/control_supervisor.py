"""Control supervisor: runs the local planner and detects a robot that makes no progress.

Upstream move_base accepts in-place turns and circles as valid control for ever. Here a robot that
comes no nearer to the end of its plan for too long first gets a new plan and less weight of
obstacle costs, then none of it, then the recovery behaviours.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass
from typing import Optional

import numpy as np
from numpy.typing import NDArray

from quad_nav.control.controller import LocalPlanner
from quad_nav.costmap.layered import LayeredCostmap
from quad_nav.errors import ControlError
from quad_nav.geometry import Pose2D, Twist2D
from quad_nav.navigator.parameter_limiter import ParameterLimiter
from quad_nav.navigator.tick import RobotPoses, Tick
from quad_nav.parameter import number
from quad_nav.peers.peer_tracker import CRUISE_MPS
from quad_nav.recovery import ParameterLimit
from quad_nav.timing import ApproachTimer, StallTimer

_SLOW = 0.5  # share of its cruise speed at which a robot flies a detour at least
_NO_WEIGHT = 1e-6  # factor of obstacle costs; DWA checks no collisions at a weight of 0


@dataclass(frozen=True)
class ProgressParams:
    """Parameters of the progress checker.

    A robot that moves, or comes nearer to the end of its plan, by less than ``distance_m`` in
    ``timeout_s`` gets a new plan; from then on ``stuck_cost_factor`` weighs obstacles less until
    it has moved by the oscillation distance. After the same time again costs below lethal do not
    count, and then it runs the recoveries. Where the plan becomes longer, the robot has the time
    to fly that way, too. A time-out of 0 disables the checker.
    """

    timeout_s: float = number(
        "progress_timeout", 10.0, "seconds", 0, 100, "Time stuck until a new plan.", upstream=0.0
    )
    distance_m: float = number(
        "progress_distance", 0.1, "metres", 0, 10, "Motion and way that are progress.", own=True
    )
    stuck_cost_factor: float = number(
        "stuck_cost_factor", 0.1, "", 0, 1, "Factor of occdist_scale if stuck.", upstream=1.0
    )


class StuckAction(enum.Enum):
    """Reaction to missing progress."""

    NONE = "none"
    REPLAN = "replan"
    RECOVER = "recover"


class ControlSupervisor:
    """Runs the local planner of one robot.

    Attributes:
        limiter: Limits of the planner's parameters, from recoveries and stalls.
        plan: float64[n, 3], the last plan, in the global costmap's frame; None without one.
    """

    def __init__(self, controller: LocalPlanner) -> None:
        """Supervise a local planner that has no plan yet."""
        self.limiter = ParameterLimiter(controller)
        self.plan: Optional[NDArray[np.float64]] = None
        self._controller = controller
        self._last_valid_s = -math.inf
        self.reset()

    def change_controller(self, controller: LocalPlanner) -> None:
        """Supervise another local planner, without limits and without a plan."""
        self.limiter, self._controller = ParameterLimiter(controller), controller
        self.plan = None

    def reset(self) -> None:
        """Forget all progress, for another goal."""
        self._oscillation, self._progress = StallTimer(), StallTimer()
        self._approach = ApproachTimer()
        self._stalls = 0  # since the last progress

    def start(self, now_s: float) -> None:
        """Count the patience from now, for another goal."""
        self._last_valid_s = now_s

    def restart_timers(self, now_s: float) -> None:
        """Restart all stall timers of a robot that has to stand, for a peer or without data."""
        self._progress.restart(now_s)
        self._approach = ApproachTimer()  # it may have been on its way to a holding point
        self._oscillation.restart(now_s)
        self._last_valid_s = now_s

    def end_recovery(self, now_s: float) -> None:
        """Restart the stall timers after a recovery behaviour."""
        self._oscillation.restart(now_s)
        self._progress.restart(now_s)
        self._approach.restart(now_s)
        self._stalls = min(self._stalls, 1)  # what has been tried did not help

    def track(self, now_s: float, pose: Pose2D, oscillation_distance_m: float) -> bool:
        """Update limits and timers by the robot's pose; return whether it does not oscillate."""
        self.limiter.track(pose)
        return self._oscillation.has_moved(now_s, pose, oscillation_distance_m) and not self._stalls

    def set_plan(self, plan: NDArray[np.float64]) -> None:
        """Give the local planner a plan, float64[n, 3] of (x_m, y_m, yaw_rad)."""
        self.plan = plan
        self._controller.set_plan(plan)

    def is_goal_reached(self) -> bool:
        """Return whether the robot is at the end of its plan."""
        return self._controller.is_goal_reached()

    def is_oscillating(self, now_s: float, timeout_s: float) -> bool:
        """Return whether the robot has stayed near one place for too long; 0 disables it."""
        return self._oscillation.exceeds(now_s, timeout_s)

    def check_progress(
        self, tick: Tick, pose: Pose2D, params: ProgressParams, oscillation_distance_m: float
    ) -> StuckAction:
        """Return what is due for missing progress; warn of it. The time restarts after each."""
        assert self.plan is not None
        self._progress.has_moved(tick.now_s, pose, params.distance_m)
        left_m = way_left_m(self.plan, pose)
        if self._approach.has_approached(tick.now_s, left_m, params.distance_m):
            self._stalls = 0
        cruise_mps = getattr(self.limiter.usual, "max_vel_x_mps", 0.0) or CRUISE_MPS
        patience_s = params.timeout_s + self._approach.detour_m / (_SLOW * cruise_mps)
        circles = params.timeout_s > 0.0 and self._approach.exceeds(tick.now_s, patience_s)
        if not (circles or self._progress.exceeds(tick.now_s, params.timeout_s)):
            return StuckAction.NONE
        self._progress.restart(tick.now_s)
        self._approach.restart(tick.now_s)
        self._stalls += 1
        stalled_s = patience_s if circles else params.timeout_s
        stall = f"no progress for {stalled_s:.3g} s at ({pose.x_m:.2f}, {pose.y_m:.2f})"
        is_relaxed = self._stalls <= 2 and self._relax_obstacle_weight(
            params.stuck_cost_factor, pose, tick.now_s, oscillation_distance_m
        )
        if is_relaxed or self._stalls == 1:
            tick.warnings.append(f"{stall}, replanning")
            return StuckAction.REPLAN
        tick.warnings.append(f"{stall} after replanning, starting recoveries")
        return StuckAction.RECOVER

    def _relax_obstacle_weight(
        self, factor: float, pose: Pose2D, now_s: float, distance_m: float
    ) -> bool:
        """Lower the ``occdist_scale`` of a planner that has one until the robot has moved so far.

        A robot that spins in place has usually found that obstacle costs outweigh all progress.
        Trajectories that collide stay illegal.

        Returns:
            Whether there was a weight to lower.
        """
        weight = getattr(self.limiter.usual, "occdist_scale", None)
        if weight is None or factor >= 1.0:
            return False
        factor = max(factor if self._stalls == 1 else 0.0, _NO_WEIGHT)
        limit = ParameterLimit((("occdist_scale", factor * weight),), distance_m)
        self.limiter.impose(limit, pose, now_s)
        return True

    def compute_velocity(
        self, tick: Tick, costmap: LayeredCostmap, poses: RobotPoses, velocity: Twist2D
    ) -> bool:
        """Compute the tick's command; return False and warn if the local planner has none."""
        local_from_global = poses.local_from_global
        assert poses.in_local is not None and local_from_global is not None
        try:
            tick.control = self._controller.compute_velocity(
                costmap.spec, costmap.costs, poses.in_local, velocity, local_from_global
            )
        except ControlError as error:
            tick.warnings.append(str(error))
            return False
        tick.steer(tick.control.command)
        self._last_valid_s = tick.now_s
        return True

    def is_patience_exhausted(self, now_s: float, patience_s: float) -> bool:
        """Return whether the local planner has had no command for too long."""
        return now_s > self._last_valid_s + patience_s


def way_left_m(plan: NDArray[np.float64], pose: Pose2D) -> float:
    """Return the way from a pose to a plan, float64[n, 3] with n >= 1, and along it to its end."""
    points, at = np.vstack((plan[:, :2], plan[-1:, :2])), (pose.x_m, pose.y_m)
    steps = np.diff(points, axis=0)
    lengths = np.hypot(*steps.T)
    along = ((at - points[:-1]) * steps).sum(axis=1) / np.maximum(lengths**2, 1e-12)
    passed = np.clip(along, 0.0, 1.0)
    away = np.hypot(*(at - points[:-1] - passed[:, None] * steps).T)
    k = int(away.argmin())
    return float(away[k] + (1.0 - passed[k]) * lengths[k] + lengths[k + 1 :].sum())
