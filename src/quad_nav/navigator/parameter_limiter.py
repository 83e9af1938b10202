"""Parameter limiter: temporary limits of a local planner's parameters.

Recoveries limit the speed for a while, and a stuck robot relaxes its obstacle weight.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, Dict, List, Tuple

from quad_nav.geometry import Pose2D
from quad_nav.recovery import ParameterLimit


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
        self._limits: Dict[Tuple[str, ...], Tuple[ParameterLimit, Pose2D]] = {}
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
        for limit, _ in self._limits.values():
            params = _limited(params, limit)
        self._controller.set_params(params)

    def impose(self, limit: ParameterLimit, pose: Pose2D) -> None:
        """Impose a limit on a robot at ``pose``."""
        if not limit.greatest:
            return
        usual = self.usual
        self._limits[tuple(field for field, _ in limit.greatest)] = limit, pose
        self.set_params(usual)

    def track(self, pose: Pose2D) -> None:
        """Lift the limits from which the robot has moved away; to be called in every cycle."""
        over = [
            fields
            for fields, (limit, since) in self._limits.items()
            if pose.distance_to(since) >= limit.distance_m
        ]
        self._lift(over)

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
    return replace(
        params,
        **{
            field: max(-greatest, min(getattr(params, field), greatest))
            for field, greatest in limit.greatest
        },
    )
