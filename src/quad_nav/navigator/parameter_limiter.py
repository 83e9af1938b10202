"""Parameter limiter: temporary limits of a local planner's parameters.

Recoveries limit the speed for a while, and a stuck robot relaxes its obstacle weight.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, Dict, List, Tuple

from quad_nav.geometry import Pose2D
from quad_nav.recovery import ParameterLimit
from quad_nav.timing import Schedule


@dataclass
class _Imposed:
    """A limit in force, the pose since which it counts, and when that is checked."""

    limit: ParameterLimit
    since: Pose2D
    checks: Schedule

    def is_over(self, pose: Pose2D) -> bool:
        """Return whether the robot has moved far enough; upstream compares squares."""
        if not self.limit.check_period_s:
            return pose.distance_to(self.since) >= self.limit.distance_m
        dx, dy = pose.x_m - self.since.x_m, pose.y_m - self.since.y_m
        return dx * dx + dy * dy >= self.limit.distance_m * self.limit.distance_m


class ParameterLimiter:
    """Sets a local planner's parameters, with limits while there are any.

    A limit holds until the robot has moved far enough, for other goals as well: the reason for
    it is near the robot. Limits of different parameters hold side by side; a limit of the same
    parameters replaces the one before. The local planner has ``params``, a frozen dataclass,
    and ``set_params``; one without them cannot be limited.
    """

    def __init__(self, controller: Any) -> None:
        """Create a limiter without limits."""
        self._controller = controller
        self._limits: Dict[Tuple[str, ...], _Imposed] = {}
        self._usual: Any = None  # the parameters without limits, while there are any

    @property
    def usual(self) -> Any:
        """The local planner's parameters without limits, None if it has no parameters."""
        if self._limits:
            return self._usual
        return getattr(self._controller, "params", None)

    def set_params(self, params: Any) -> None:
        """Change the parameters without limits; limits stay in force."""
        self._usual = params
        for imposed in self._limits.values():
            params = _limited(params, imposed.limit)
        self._controller.set_params(params)

    def impose(self, limit: ParameterLimit, pose: Pose2D, now_s: float) -> None:
        """Impose a limit on a robot at ``pose``."""
        if not limit.greatest:
            return
        usual = self.usual
        checks = Schedule(1.0 / limit.check_period_s if limit.check_period_s else 0.0)
        checks.start(now_s + limit.check_period_s)
        self._limits[tuple(field for field, _ in limit.greatest)] = _Imposed(limit, pose, checks)
        self.set_params(usual)

    @property
    def due_s(self) -> float:
        """Time of the next check of a limit with a check period, +inf without one."""
        if not self._limits:
            return math.inf
        return min(imposed.checks.due_s for imposed in self._limits.values())

    def track(self, pose: Pose2D) -> None:
        """Lift the limits from which the robot has moved away; to be called in every cycle."""
        if not self._limits:
            return
        self._lift(
            [
                fields
                for fields, imposed in self._limits.items()
                if not imposed.limit.check_period_s and imposed.is_over(pose)
            ]
        )

    def check(self, now_s: float, pose: Pose2D) -> None:
        """Lift those with a check period, if that is over; to be called at ``due_s``."""
        if not self._limits:
            return
        self._lift(
            [
                fields
                for fields, imposed in self._limits.items()
                if imposed.checks.pop(now_s) and imposed.is_over(pose)
            ]
        )

    def lift(self) -> None:
        """Lift all limits."""
        self._lift(list(self._limits))

    def _lift(self, over: List[Tuple[str, ...]]) -> None:
        if over:
            usual = self.usual
            for fields in over:
                del self._limits[fields]
            self.set_params(usual)


def _limited(params: Any, limit: ParameterLimit) -> Any:
    if limit.raises:
        return replace(params, **dict(limit.greatest))
    return replace(
        params,
        **{
            field: max(-greatest, min(getattr(params, field), greatest))
            for field, greatest in limit.greatest
        },
    )
