"""Control supervisor: runs the local planner and detects a robot that makes no progress.

Upstream move_base accepts in-place turns as valid control for ever. Here a robot that stays
within a small distance for too long first gets a new plan and less weight of obstacle costs,
then the recovery behaviours.
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
from quad_nav.recovery import ParameterLimit
from quad_nav.timing import StallTimer


@dataclass(frozen=True)
class ProgressParams:
    """Parameters of the progress checker.

    A robot that stays within ``distance_m`` for ``timeout_s`` gets a new plan; from then on
    ``stuck_cost_factor`` weighs obstacles less until it has moved by the oscillation distance.
    After the same time again it runs the recoveries. A time-out of 0 disables the checker.
    """

    timeout_s: float = number(
        "progress_timeout", 10.0, "seconds", 0, 100, "Time stuck until a new plan.", upstream=0.0
    )
    distance_m: float = number(
        "progress_distance", 0.1, "metres", 0, 10, "Movement that is progress.", own=True
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
        self._has_replanned = False

    def start(self, now_s: float) -> None:
        """Count the patience from now, for another goal."""
        self._last_valid_s = now_s

    def restart_timers(self, now_s: float) -> None:
        """Restart all stall timers of a robot that has to stand, for a peer or without data."""
        self._progress.restart(now_s)
        self._oscillation.restart(now_s)
        self._last_valid_s = now_s

    def end_recovery(self, now_s: float) -> None:
        """Restart the stall timers after a recovery behaviour."""
        self._oscillation.restart(now_s)
        self._progress.restart(now_s)
        self._has_replanned = False

    def track(self, now_s: float, pose: Pose2D, oscillation_distance_m: float) -> bool:
        """Update limits and timers by the robot's pose; return whether it does not oscillate."""
        self.limiter.track(pose)
        return self._oscillation.has_moved(now_s, pose, oscillation_distance_m)

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
        if self._progress.has_moved(tick.now_s, pose, params.distance_m):
            self._has_replanned = False
        if not self._progress.exceeds(tick.now_s, params.timeout_s):
            return StuckAction.NONE
        self._progress.restart(tick.now_s)
        stall = f"no progress for {params.timeout_s:g} s at ({pose.x_m:.2f}, {pose.y_m:.2f})"
        if self._has_replanned:
            tick.warnings.append(f"{stall} after replanning, starting recoveries")
            return StuckAction.RECOVER
        self._has_replanned = True
        tick.warnings.append(f"{stall}, replanning")
        self._relax_obstacle_weight(
            params.stuck_cost_factor, pose, tick.now_s, oscillation_distance_m
        )
        return StuckAction.REPLAN

    def _relax_obstacle_weight(
        self, factor: float, pose: Pose2D, now_s: float, distance_m: float
    ) -> None:
        """Lower the ``occdist_scale`` of a planner that has one until the robot has moved so far.

        A robot that spins in place has usually found that obstacle costs outweigh all progress.
        Trajectories that collide stay illegal.
        """
        weight = getattr(self.limiter.usual, "occdist_scale", None)
        if weight is not None and factor < 1.0:
            limit = ParameterLimit((("occdist_scale", factor * weight),), distance_m)
            self.limiter.impose(limit, pose, now_s)

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
